"""How a process of a benchmark begins: it ends with whoever started it, and as by Ctrl+C."""

from __future__ import annotations

import logging
import signal
import sys

from PolyPoseLib.cohort.guarded import watch_stdin


def begin() -> None:
    """Watch stdin, let a request to end stop the work in order, and send the package's log to stderr."""

    def stop(number: int, _frame: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    watch_stdin()
    logging.basicConfig(stream=sys.stderr, format="%(levelname)s: %(message)s", level=logging.WARNING)
    logging.getLogger("PolyPoseLib").setLevel(logging.INFO)
