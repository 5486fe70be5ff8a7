"""How a process of a benchmark begins: it ends with whoever started it, as by Ctrl+C, and reaches no other machine."""

from __future__ import annotations

import logging
import signal
import sys

from PolyPoseLib.benchmark.no_network import refuse_network
from PolyPoseLib.cohort.guarded import watch_stdin


def begin() -> None:
    """Watch stdin, let a request to end stop the work in order, refuse the network, and send the log to stderr."""

    def stop(number: int, _frame: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    watch_stdin()
    refuse_network()
    logging.basicConfig(stream=sys.stderr, format="%(levelname)s: %(message)s", level=logging.WARNING)
    logging.getLogger("PolyPoseLib").setLevel(logging.INFO)
