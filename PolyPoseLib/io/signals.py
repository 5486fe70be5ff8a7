"""Moments in which a request to stop has to wait."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Let Ctrl+C and a request to end take effect only after a block, which must be short.

    Python handles signals in the main thread, so elsewhere nothing needs to be deferred.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[int] = []
    waiting = True

    def note(number: int, frame: FrameType | None) -> None:
        handler = earlier[number]
        if waiting or not callable(handler):
            arrived.append(number)
        else:  # while the handlers are restored
            handler(number, frame)

    earlier = {
        number: signal.getsignal(number)
        for name in ("SIGINT", "SIGTERM", "SIGBREAK")
        if (number := getattr(signal, name, None)) is not None
    }
    try:
        for number, handler in earlier.items():
            if callable(handler):
                signal.signal(number, note)
        yield
    finally:
        waiting = False
        for number, handler in earlier.items():
            if callable(handler):
                signal.signal(number, handler)
        for number in arrived:
            signal.raise_signal(number)
