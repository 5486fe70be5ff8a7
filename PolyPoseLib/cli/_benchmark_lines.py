"""A benchmark's progress for people: a line for every run that has ended, and on a terminal what runs now."""

from __future__ import annotations

import sys
from typing import TextIO

from PolyPoseLib.cli._console import JsonLines, NoProgress, ProgressBar
from PolyPoseLib.data.benchmark.progress import RUNNING, BenchmarkProgress

_NAMES_SHOWN = 3


class RunLines:
    """Lines on stderr: "3/18 polypose on case-1-2x60: done, 41 s since the start"."""

    def __init__(self, stream: TextIO | None = None) -> None:
        """Write to a stream, stderr by default."""
        self._stream = stream or sys.stderr
        self._live = self._stream.isatty()
        self._running: dict[tuple[str, str], None] = {}
        self._length = 0

    def __call__(self, progress: BenchmarkProgress) -> None:
        """Show that a run has begun or ended."""
        run = progress.system, progress.case
        if progress.status == RUNNING:
            self._running[run] = None
        else:
            self._running.pop(run, None)
            self._write(run_line(progress), "\n")
        if self._live and self._running:
            self._write(running_line(progress, list(self._running)), "\r")

    def close(self) -> None:
        """Remove what is said to run."""
        if self._live and self._length:
            self._write("", "\r")

    def _write(self, text: str, end: str) -> None:
        """A line in the place of the one that says what runs, which leaves the cursor at its beginning."""
        self._stream.write(text + " " * max(0, self._length - len(text)) + end)
        self._stream.flush()
        self._length = len(text) if end == "\r" else 0


class EndedRuns:
    """Gives another display only those runs that have ended."""

    def __init__(self, display: ProgressBar | JsonLines | NoProgress) -> None:
        self._display = display

    def __call__(self, progress: BenchmarkProgress) -> None:
        """Pass on the end of a run."""
        if progress.status != RUNNING:
            self._display(progress)

    def close(self) -> None:
        """End the display."""
        self._display.close()


def run_line(progress: BenchmarkProgress) -> str:
    """Of a run that has ended."""
    kept = " (kept from an earlier run)" if progress.reused else ""
    return (
        f"{progress.iteration}/{progress.of} {progress.system} on {progress.case}: {progress.status}{kept}, "
        f"{progress.seconds:.0f} s since the start"
    )


def running_line(progress: BenchmarkProgress, running: list[tuple[str, str]]) -> str:
    """Of the runs that have begun and not ended."""
    shown = [f"{system} on {case}" for system, case in running[:_NAMES_SHOWN]]
    more = [f"{len(running) - _NAMES_SHOWN} more"] if len(running) > _NAMES_SHOWN else []
    return f"{progress.iteration}/{progress.of} ended, running: {', '.join([*shown, *more])}"
