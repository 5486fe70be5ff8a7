"""Waits for a child process's output while the application goes on, for code that would block until it has ended."""

from __future__ import annotations

import queue
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import slicer

from . import windows_job

_WAIT_SECONDS = 0.02
_LIST_SECONDS = 10.0


class ResponsiveProcess:
    """Stands for a subprocess.Popen whose reader only calls `stdout.readline`; all else is the process's own.

    While a line is awaited the application's events are processed. check: raises an exception when the process is
    no longer wanted; then it is killed with all that it started, and the reader gets the exception.
    """

    def __init__(self, process: subprocess.Popen[str], check: Callable[[], None]) -> None:
        """process: writes text to a pipe."""
        self._process, self._check = process, check
        self._lines: queue.Queue[str] = queue.Queue()
        self.stdout = self
        threading.Thread(target=self._read, daemon=True).start()

    def readline(self) -> str:
        """The next line; empty at the end of the output."""
        while True:
            slicer.app.processEvents()
            try:
                self._check()
            except Exception:
                self.kill()
                raise
            try:
                return self._lines.get(timeout=_WAIT_SECONDS)
            except queue.Empty:
                continue

    def kill(self) -> None:
        """Kill the process and all its descendants."""
        kill_tree(self._process)

    def _read(self) -> None:
        output = self._process.stdout
        line = "?"
        while line and output is not None:
            try:
                line = output.readline()
            except UnicodeDecodeError:
                continue
            except ValueError:  # the pipe was closed
                line = ""
            self._lines.put(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._process, name)


def kill_tree(process: subprocess.Popen[Any]) -> None:
    """Kill a process that was started without a group of its own, and all its descendants; wait until it has ended.

    Killing Slicer's launcher of Python alone would leave the Python that it has started.
    """
    if sys.platform == "win32":
        windows_job.kill(process.pid, None)
    else:
        _kill_with_descendants(process.pid)
    try:
        process.wait(_LIST_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()


def _kill_with_descendants(pid: int) -> None:
    """Kill by the table of processes, parents first, so that none is started again."""
    import contextlib
    import os
    import signal

    if sys.platform == "win32":
        return
    children: dict[int, list[int]] = {}
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        table = subprocess.run(
            ["ps", "-A", "-o", "pid=,ppid="],
            capture_output=True,
            text=True,
            timeout=_LIST_SECONDS,
            check=True,
        )
        for line in table.stdout.splitlines():
            child, parent = (int(number) for number in line.split())
            children.setdefault(parent, []).append(child)
    wanted = [pid]
    for each in wanted:
        wanted.extend(children.get(each, []))
    for each in wanted:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(each, signal.SIGKILL)
