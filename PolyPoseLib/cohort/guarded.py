"""The command line in a process that ends with whoever started it: ``python -m PolyPoseLib.cohort.guarded ...``.

It ends when its stdin does, as happens when the worker that holds the other end is killed. A registration that went on
without its worker would write to where the next attempt writes.
"""

from __future__ import annotations

import os
import runpy
import signal
import sys
import threading
import time

GRACE_SECONDS = 5.0
"""For the process to leave its places tidy, before it is ended at once."""


def watch_stdin() -> None:
    """End this process when stdin ends: as by Ctrl+C at first, then with everything that it has started."""

    def watch() -> None:
        while os.read(0, 4096):
            pass
        if sys.platform != "win32":
            os.kill(os.getpid(), signal.SIGTERM)  # the command line ends as by Ctrl+C
            time.sleep(GRACE_SECONDS)
            if os.getpgrp() == os.getpid():
                os.killpg(os.getpgrp(), signal.SIGKILL)
        os._exit(130)

    threading.Thread(target=watch, daemon=True, name="stdin").start()


def main() -> None:
    """Run ``python -m PolyPoseLib`` with the arguments of this process, watched."""
    watch_stdin()
    runpy.run_module("PolyPoseLib", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
