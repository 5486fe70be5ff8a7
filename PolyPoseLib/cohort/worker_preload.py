"""What a worker of this machine does before anything else: Ctrl+C in a terminal is for the cohort, which ends it."""

from __future__ import annotations

import signal
import threading


def dask_setup(worker: object) -> None:
    """Ignore interrupts in the worker's process; Dask calls this by its name."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
