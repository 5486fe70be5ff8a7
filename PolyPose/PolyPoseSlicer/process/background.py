"""Computes in a thread what would hold up the application; nodes are read before and filled afterwards."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import qt

_POLL_MS = 20


class Background:
    """One computation at a time; a new one takes the place of one whose outcome has not come."""

    def __init__(self) -> None:
        """Nothing is computed yet."""
        self._outcome: list[tuple[Any, Exception | None]] = []
        self._done: Callable[[Any], None] | None = None
        self._failed: Callable[[Exception], None] | None = None
        self._timer = qt.QTimer()
        self._timer.interval = _POLL_MS
        self._timer.connect("timeout()", self._poll)

    @property
    def busy(self) -> bool:
        """Whether an outcome is still to come."""
        return self._done is not None

    def run(
        self, work: Callable[[], Any], done: Callable[[Any], None], failed: Callable[[Exception], None]
    ) -> None:
        """Compute in a thread; then done gets the outcome, or failed the exception, on the main thread.

        work must not touch nodes, widgets or anything else of the application.
        """
        self.drop()
        self._done, self._failed = done, failed
        threading.Thread(target=_compute, args=(work, self._outcome), daemon=True).start()
        self._timer.start()

    def drop(self) -> None:
        """Forget a computation that is under way; it ends by itself."""
        self._timer.stop()
        self._done = self._failed = None
        self._outcome = []  # what was under way keeps the old one

    def _poll(self) -> None:
        if not self._outcome:
            return
        value, error = self._outcome[0]
        done, failed = self._done, self._failed
        self.drop()
        if error is not None and failed is not None:
            failed(error)
        elif error is None and done is not None:
            done(value)


def _compute(work: Callable[[], Any], outcome: list[tuple[Any, Exception | None]]) -> None:
    try:
        outcome.append((work(), None))
    except Exception as error:
        outcome.append((None, error))
