"""Starts a child process so that it and all that it starts can be ended together, on every platform."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence

from . import windows_job

TERMINATE_SECONDS = 1.0
"""A process that was asked to end gets this long before it is killed."""


class ProcessTree:
    """A child process and its descendants; `stdout` and `stderr` are its pipes."""

    def __init__(
        self, arguments: Sequence[str], environment: Mapping[str, str], folder: str, writable: bool = False
    ) -> None:
        """Start it; raises OSError when that fails. writable: whether process.stdin is a pipe."""
        self._job: int | None = None
        self._killer: threading.Thread | None = None
        self.process = subprocess.Popen(
            list(arguments),
            env=dict(environment),
            cwd=folder,
            stdin=subprocess.PIPE if writable else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            **_platform_options(),
        )
        assert self.process.stdout is not None and self.process.stderr is not None  # both are pipes
        self.stdout, self.stderr = self.process.stdout, self.process.stderr
        if sys.platform == "win32":
            self._job = windows_job.make_job(self.process)

    @property
    def running(self) -> bool:
        """Whether the child itself has not ended."""
        return self.process.poll() is None

    def end(self) -> None:
        """Ask the tree to end and return at once; what still runs after a second is killed."""
        if self._killer is None:
            self._terminate()
            self._killer = threading.Thread(target=self._kill_when_late, daemon=True)
            self._killer.start()

    def _kill_when_late(self) -> None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(TERMINATE_SECONDS)
        self.kill()

    def kill(self) -> None:
        """End the child and all its descendants at once; harmless when they have ended."""
        if sys.platform == "win32":
            windows_job.kill(self.process.pid, self._job)
            self._job = None
        else:
            _signal_group(self.process.pid, signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(TERMINATE_SECONDS)

    def _terminate(self) -> None:
        if sys.platform == "win32":
            with contextlib.suppress(OSError):
                self.process.send_signal(signal.CTRL_BREAK_EVENT)
        else:
            _signal_group(self.process.pid, signal.SIGTERM)


def _platform_options() -> dict:
    """On Windows no console window and a process group; elsewhere a session of its own."""
    if sys.platform != "win32":
        return {"start_new_session": True}
    startup = subprocess.STARTUPINFO()
    startup.dwFlags |= subprocess.STARTF_USESHOWWINDOW
    flags = subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW
    return {"startupinfo": startup, "creationflags": flags}


def _signal_group(group: int, number: int) -> None:
    """Signal every process of a group; the child leads it, and it lives on as long as one member does."""
    if sys.platform != "win32":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(group, number)
