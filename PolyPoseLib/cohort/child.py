"""One registration as a process of a worker: started, measured, and ended together with all that it has started."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_PAUSE_SECONDS = 0.1

_FIRST_PAUSE_SECONDS = 0.01
"""Within the first second, so that a short process is measured, too."""

_GRACE_SECONDS = 8.0
"""A process that was asked to end gets this long before it is killed; longer than it gives itself."""

_running: dict[str, list[Child]] = {}
_ended: set[str] = set()
_lock = threading.Lock()


@dataclass(frozen=True)
class ChildEnd:
    """How a process ended.

    Parameters
    ----------
    status : int
        Exit status; negative when a signal ended it.
    seconds, cpu_seconds : float
        Time, and processor time of all its threads.
    peak_memory_mib : float
        Largest memory in use; NaN where the system does not tell.
    late, asked : bool
        Whether it was ended for its time limit, or by request.

    """

    status: int
    seconds: float
    cpu_seconds: float
    peak_memory_mib: float
    late: bool
    asked: bool


class Child:
    """A running process whose output goes to a log."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str], log: Path) -> None:
        """Start it; raises OSError where the system refuses."""
        self._began = time.monotonic()
        self._asked = False
        self._peak_mib = float("nan")
        with log.open("ab") as stream:
            self._process = subprocess.Popen(
                list(command),
                env=dict(environment),
                stdin=subprocess.PIPE,  # its end is how the process learns that it shall end, see ``guarded``
                stdout=stream,
                stderr=subprocess.STDOUT,
                **_own_group(),
            )

    def wait(self, limit_seconds: float | None) -> ChildEnd:
        """Wait for its end, which comes soon after the limit (seconds) at the latest."""
        late_at = None if limit_seconds is None else self._began + limit_seconds
        late, kill_at = False, None
        while (end := self._poll()) is None:
            now = time.monotonic()
            if late_at is not None and now >= late_at and not late:
                late = True
                self._close_stdin()
            if (late or self._asked) and kill_at is None:
                kill_at = now + _GRACE_SECONDS
            if kill_at is not None and now >= kill_at:
                self._kill()
            time.sleep(_PAUSE_SECONDS if now > self._began + 1 else _FIRST_PAUSE_SECONDS)
        self._kill()  # what it has started and left
        self._close_stdin()
        seconds = time.monotonic() - self._began
        return ChildEnd(end[0], seconds, end[1], end[2], late, self._asked)

    def end(self) -> None:
        """Ask it to end, and return at once."""
        self._asked = True
        self._close_stdin()

    def _poll(self) -> tuple[int, float, float] | None:
        """Status, processor seconds and peak memory in MiB once it has ended."""
        if sys.platform == "win32":
            return self._poll_windows()
        # What wait4 tells of memory counts what this process held when it started the other.
        self._peak_mib = _peak_memory_mib(self._process.pid, self._peak_mib)
        pid, status, usage = os.wait4(self._process.pid, os.WNOHANG)
        if pid == 0:
            return None
        self._process.returncode = code = os.waitstatus_to_exitcode(status)
        peak = usage.ru_maxrss / (1 << 20) if sys.platform == "darwin" else self._peak_mib
        return code, usage.ru_utime + usage.ru_stime, peak

    def _poll_windows(self) -> tuple[int, float, float] | None:
        code = self._process.poll()
        return None if code is None else (code, float("nan"), float("nan"))

    def _close_stdin(self) -> None:
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()

    def _kill(self) -> None:
        """End the process and all of its group at once; harmless when they have ended."""
        if sys.platform == "win32":
            self._process.kill()
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)


def _peak_memory_mib(pid: int, before: float) -> float:
    """Largest resident memory so far of a running process on Linux; ``before`` where nothing is told of it."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text(errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / (1 << 10)
    return before


def run_child(
    command: Sequence[str],
    environment: Mapping[str, str],
    log: Path,
    run: str,
    limit_seconds: float | None = None,
) -> ChildEnd | None:
    """Run a process to its end.

    Parameters
    ----------
    command, environment, log
        What to run, with which variables, and the file to which its output is added.
    run : str
        Name of the cohort's run, by which ``end_children`` finds it.
    limit_seconds : float or None
        It is ended after that.

    Returns
    -------
    ChildEnd or None
        None when the run was ended before this process was started.

    """
    with _lock:
        if run in _ended:
            return None
        child = Child(command, environment, log)
        _running.setdefault(run, []).append(child)
    try:
        return child.wait(limit_seconds)
    finally:
        with _lock:
            _running[run].remove(child)


def end_children(run: str) -> int:
    """End all processes of a run in this worker, and start no more; returns how many there were."""
    with _lock:
        _ended.add(run)
        children = list(_running.get(run, ()))
    for child in children:
        child.end()
    return len(children)


def _own_group() -> dict[str, Any]:
    """A group of its own, so that Ctrl+C in a terminal reaches the cohort alone, which ends it in order."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}
