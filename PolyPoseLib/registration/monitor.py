"""Progress, cancelling, history and timing of one run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from PolyPoseLib.errors import CancelledError
from PolyPoseLib.progress import CancelQuery, Progress, ProgressCallback


class Monitor:
    """Tells the caller how far the run is, and asks whether to go on.

    history: one object per iteration; seconds: per stage; write_preview: writes a preview and returns its path.
    """

    def __init__(self, progress: ProgressCallback | None, cancel: CancelQuery | None) -> None:
        self._progress = progress
        self._cancel = cancel
        self._start = time.perf_counter()
        self.history: list[dict[str, Any]] = []
        self.seconds: dict[str, float] = {}

    @property
    def elapsed(self) -> float:
        """Seconds since the run began."""
        return time.perf_counter() - self._start

    def step(
        self,
        stage: str,
        iteration: int,
        of: int,
        similarity: float | None,
        preview: Callable[[], str | None] | None = None,
    ) -> None:
        """Report one iteration; raises CancelledError when the caller wants to stop."""
        if self._cancel is not None and self._cancel():
            raise CancelledError("The registration was cancelled.")
        if similarity is not None:
            self.history.append(
                {"stage": stage, "iteration": iteration, "similarity": similarity, "seconds": self.elapsed}
            )
        if self._progress is not None:
            path = preview() if preview is not None else None
            self._progress(Progress(stage, iteration, of, similarity, self.elapsed, path))

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time spent inside to the stage's seconds."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start
