"""What people and programs see on the console: progress, tables, one-line errors."""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TextIO

from PolyPoseLib.data.progress import Progress, ProgressCallback
from PolyPoseLib.errors import cut
from PolyPoseLib.io.native_output import stderr_is_ours

_BAR_WIDTH = 24
_BAR_PAUSE_SECONDS = 0.1
_PLAIN_PAUSE_SECONDS = 5.0


class ProgressBar:
    """One line on stderr that is drawn again and again; on a file or pipe, a line every few seconds."""

    def __init__(self, stream: TextIO | None = None) -> None:
        """Draw on a stream, stderr by default."""
        self._stream = stream or sys.stderr
        self._live = self._stream.isatty()
        self._last_time = 0.0
        self._last_stage = ""
        self._length = 0

    def __call__(self, progress: Progress) -> None:
        """Show one step, unless the last one was shown just now."""
        now = time.monotonic()
        finished = progress.iteration >= progress.of
        pause = _BAR_PAUSE_SECONDS if self._live else _PLAIN_PAUSE_SECONDS
        changed = progress.stage != self._last_stage
        if not (changed or (finished and self._live)) and now - self._last_time < pause:
            return
        if changed and self._last_stage and self._live:
            self._stream.write("\n")
            self._length = 0
        self._last_time, self._last_stage = now, progress.stage
        line = bar_line(progress)
        if self._live:
            self._stream.write("\r" + line + " " * max(0, self._length - len(line)))
            self._length = len(line)
        else:
            self._stream.write(line + "\n")
        self._stream.flush()

    def close(self) -> None:
        """End the line."""
        if self._live and self._length:
            self._stream.write("\n")
            self._stream.flush()
            self._length = 0


def bar_line(progress: Progress) -> str:
    """Stage, bar, count, similarity and seconds of one step, in plain ASCII."""
    share = min(1.0, progress.iteration / progress.of) if progress.of else 1.0
    filled = round(share * _BAR_WIDTH)
    similarity = "" if progress.similarity is None else f"  similarity {progress.similarity:.4f}"
    bar = "#" * filled + "." * (_BAR_WIDTH - filled)
    count = f"{progress.iteration}/{progress.of}"
    return f"{progress.stage:<20} [{bar}] {count}{similarity}  {progress.seconds:.0f} s"


class JsonLines:
    """One JSON object a line on stdout, flushed at once."""

    def __call__(self, progress: Progress) -> None:
        """Write one step; a reader that went away ends the run as an interrupt does."""
        try:
            print(progress.to_json(), flush=True)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise KeyboardInterrupt from None

    def close(self) -> None:
        """Nothing is left open."""


class NoProgress:
    """Shows nothing."""

    def __call__(self, progress: Progress) -> None:
        """Show nothing."""

    def close(self) -> None:
        """Nothing is left open."""


def progress_display(kind: str) -> ProgressBar | JsonLines | NoProgress:
    """The display that --progress names."""
    return {"bar": ProgressBar, "json": JsonLines, "none": NoProgress}[kind]()


class _OneLine(logging.Formatter):
    """A message on one line, cut where what it repeats is too long for people."""

    def format(self, record: logging.LogRecord) -> str:
        """Level and message."""
        return cut(" ".join(super().format(record).split()))


def start_logging(quiet: bool, debug: bool = False) -> None:
    """Send the package's log to stderr, one line a message; with debug everything, quiet nothing but errors."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_OneLine("%(levelname)s: %(message)s"))
    logger = logging.getLogger("PolyPoseLib")
    logger.handlers[:] = [handler]
    logger.propagate = False
    logger.setLevel(logging.DEBUG if debug else logging.ERROR if quiet else logging.INFO)


@contextmanager
def libraries_quiet(debug: bool) -> Iterator[None]:
    """Keep what other libraries say by themselves away from people for a block; with debug it is logged.

    These are Python's warnings (RuntimeWarning and the like), the logs of other packages, and what native code writes
    to stderr while files are read and written.
    """
    root = logging.getLogger()
    handler: logging.Handler = logging.NullHandler()
    if debug:
        handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(_OneLine("DEBUG: %(name)s: %(message)s"))
    root.addHandler(handler)  # without one, Python prints warnings of every package to stderr
    logging.captureWarnings(True)
    try:
        with stderr_is_ours():
            yield
    finally:
        logging.captureWarnings(False)
        root.removeHandler(handler)


def table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table in plain text: texts to the left, numbers to the right."""
    cells = [[_cell(value) for value in row] for row in rows]
    widths = [max(len(each[n]) for each in [list(header), *cells]) for n in range(len(header))]
    numeric = [all(not isinstance(row[n], str) for row in rows) for n in range(len(header))]

    def line(row: Sequence[str]) -> str:
        return "  ".join(
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(row, widths, numeric, strict=True)
        ).rstrip()

    return "\n".join(
        [line(header), "  ".join("-" * width for width in widths), *(line(row) for row in cells)]
    )


def peak_memory_mib() -> float | None:
    """Largest resident memory of this process so far in MiB, or None where the system does not tell."""
    try:
        import resource
    except ImportError:
        return None
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used / (1 << 20) if sys.platform == "darwin" else used / (1 << 10)


def _cell(value: object) -> str:
    """A value in a table."""
    if value is None:
        return "-"
    if isinstance(value, float):
        return "-" if value != value else f"{round(value, 2) + 0.0:.2f}"  # without a minus before zero
    return str(value)


__all__ = [
    "JsonLines",
    "NoProgress",
    "ProgressBar",
    "ProgressCallback",
    "bar_line",
    "peak_memory_mib",
    "table",
]
