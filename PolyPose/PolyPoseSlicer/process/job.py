"""Runs PolyPoseLib as a child process: reader threads fill a queue, `poll` empties it on the main thread."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import IO, Any

from PolyPoseLib.data.progress import Progress
from PolyPoseLib.errors import InputError

from .process_tree import ProcessTree

POLL_SECONDS = 0.02
"""A poll returns after this long, however much the child has written."""

LINE_BYTES = 1 << 16
"""Longer lines are read in pieces, so that a child that never ends a line cannot fill the memory."""

KEPT_LOG_LINES = 400
_QUEUED_STEPS = 2000
_JOIN_SECONDS = 0.5


@dataclass(frozen=True)
class Step:
    """One step of a run; preview: what `load_preview` made of the file that it names, None when there is none."""

    progress: Progress
    preview: Any = None


class Job:
    """One run of a child process.

    `poll` returns what arrived since the last call; when `finished`, `exit_status` and `log` hold the rest.
    Nothing here touches nodes or widgets.
    """

    def __init__(
        self,
        arguments: Sequence[str],
        environment: Mapping[str, str],
        folder: str,
        load_preview: Callable[[str], Any] | None = None,
    ) -> None:
        """Start the process in a folder; raises OSError when that fails.

        load_preview: called in the reader thread with the path of a preview; what it raises is ignored.
        """
        self._steps: queue.Queue[Step] = queue.Queue(_QUEUED_STEPS)
        self._log: deque[str] = deque(maxlen=KEPT_LOG_LINES)
        self._log_lock = threading.Lock()
        self._load_preview = load_preview
        self._abandoned = threading.Event()
        self._finished = False
        self._ended_at: float | None = None
        self.cancelled = False
        self.exit_status: int | None = None
        self._tree = ProcessTree(arguments, environment, folder)
        self._readers = [
            threading.Thread(target=self._read, args=(stream, take), daemon=True)
            for stream, take in (
                (self._tree.stdout, self._take_output),
                (self._tree.stderr, self._keep),
            )
        ]
        for reader in self._readers:
            reader.start()

    @property
    def pid(self) -> int:
        """The child's process ID."""
        return self._tree.process.pid

    @property
    def finished(self) -> bool:
        """Whether the process has ended and every step was handed out."""
        return self._finished

    @property
    def log(self) -> list[str]:
        """The last lines that the child wrote and that were not progress."""
        with self._log_lock:
            return list(self._log)

    def poll(self, seconds: float = POLL_SECONDS) -> list[Step]:
        """The steps since the last call; returns within `seconds`, also when there are more."""
        deadline = time.monotonic() + seconds
        steps: list[Step] = []
        while time.monotonic() < deadline:
            try:
                steps.append(self._steps.get_nowait())
            except queue.Empty:
                self._notice_end()
                break
        return steps

    def cancel(self) -> None:
        """Ask the whole process tree to end and return at once; after a second it is killed."""
        if not self._finished and not self.cancelled:
            self.cancelled = True
            self._abandoned.set()
            self._tree.end()

    def close(self) -> None:
        """End the whole process tree now and forget the rest of its output; for clean-up and quitting."""
        self._abandoned.set()
        self._tree.kill()
        self._end_readers()
        self._finish()

    def _notice_end(self) -> None:
        """Finish when the child has ended; a descendant that holds the pipes open is killed."""
        if self._finished or self._tree.running:
            return
        if any(reader.is_alive() for reader in self._readers):
            self._ended_at = self._ended_at or time.monotonic()
            if time.monotonic() - self._ended_at > _JOIN_SECONDS:
                self._abandoned.set()
                self._tree.kill()
                self._end_readers()
                self._finish()
        elif self._steps.empty():
            self._tree.kill()
            self._finish()

    def _end_readers(self) -> None:
        for reader in self._readers:
            reader.join(_JOIN_SECONDS)

    def _finish(self) -> None:
        self.exit_status = self._tree.process.poll()
        for stream, reader in zip((self._tree.stdout, self._tree.stderr), self._readers, strict=True):
            if not reader.is_alive():  # closing a pipe that is being read would wait for its other end
                stream.close()
        self._finished = True

    def _read(self, stream: IO[bytes], take: Callable[[str], None]) -> None:
        """Runs in a thread of its own until the pipe closes."""
        with contextlib.suppress(OSError, ValueError):
            while line := stream.readline(LINE_BYTES):
                take(line.decode("utf-8", "replace").rstrip())

    def _keep(self, line: str) -> None:
        if line:
            with self._log_lock:
                self._log.append(line)

    def _take_output(self, line: str) -> None:
        step = step_of(line, self._load_preview)
        if step is None:
            self._keep(line)
            return
        while not self._abandoned.is_set():
            with contextlib.suppress(queue.Full):
                self._steps.put(step, timeout=0.1)
                return


def step_of(line: str, load_preview: Callable[[str], Any] | None = None) -> Step | None:
    """A progress line as a step; None for anything else that a child may print."""
    try:
        progress = Progress.from_json(line)
    except InputError:
        return None
    preview = None
    if load_preview is not None and progress.preview is not None:
        # A preview is optional: a half-written or missing one is left out.
        with contextlib.suppress(Exception):
            preview = load_preview(progress.preview)
    return Step(progress, preview)
