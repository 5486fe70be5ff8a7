"""Progress of a running registration, its times, and the question whether to go on."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from PolyPoseLib.errors import CancelledError, InputError


class Monitor:
    """Reports progress to the caller, and asks whether to go on.

    Parameters
    ----------
    progress : callable, optional
        Called with a Progress after every iteration.
    cancel : callable, optional
        Asked at every iteration; True ends the run with CancelledError.

    Attributes
    ----------
    history : list of dict
        One entry per iteration that has a similarity: stage, iteration, similarity, seconds, and level_mm where the
        stage has resolution levels.
    seconds : dict
        Time of every stage.

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
        level_mm: float | None = None,
    ) -> None:
        """Report one iteration; raises CancelledError when the caller wants to stop.

        level_mm: size of the pixels and voxels that are compared, in the patient.
        """
        self.poll()
        if similarity is not None:
            entry = {
                "stage": stage,
                "iteration": iteration,
                "similarity": similarity,
                "seconds": self.elapsed,
            }
            self.history.append(entry if level_mm is None else {**entry, "level_mm": level_mm})
        if self._progress is not None:
            path = preview() if preview is not None else None
            self._progress(Progress(stage, iteration, of, similarity, self.elapsed, path))

    def poll(self) -> None:
        """Raise CancelledError when the caller wants to stop."""
        if self._cancel is not None and self._cancel():
            raise CancelledError("The registration was cancelled.")

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time spent inside to the stage's seconds."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Progress:
    """One step of a run.

    Parameters
    ----------
    stage : str
        Name of the step of the registration, such as "camera ap" or "joint 4 mm".
    iteration, of : int
        How far the stage is, 0 <= iteration <= of.
    similarity : float or None
        Mean similarity over the views in [-1, 1], or None while there is none.
    seconds : float
        Since the run began.
    preview : str or None
        Path of the coarse displacement field that was just written.

    """

    stage: str
    iteration: int
    of: int
    similarity: float | None
    seconds: float
    preview: str | None = None

    @property
    def fraction(self) -> float:
        """Share of the stage that is done, 0 to 1; 0 while it is not known how long the stage is."""
        return min(max(self.iteration / self.of, 0.0), 1.0) if self.of > 0 else 0.0

    @classmethod
    def from_json(cls, line: str) -> Progress:
        """Read what ``to_json`` wrote, whatever further fields it holds; raises InputError for any other text."""
        try:
            fields = json.loads(line)
            similarity, preview = fields.get("similarity"), fields.get("preview")
            return cls(
                stage=str(fields["stage"]),
                iteration=int(fields["iteration"]),
                of=int(fields["of"]),
                similarity=None if similarity is None or not math.isfinite(similarity) else float(similarity),
                seconds=float(fields.get("seconds", 0.0)),
                preview=preview if isinstance(preview, str) else None,
            )
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
            raise InputError("This line is no step of a run as --progress json writes it.") from error

    def to_json(self) -> str:
        """One JSON object on one line; similarity is null where it is unknown or not finite."""
        similarity = None
        if self.similarity is not None and math.isfinite(self.similarity):
            similarity = round(float(self.similarity), 6)
        fields: dict[str, object] = {
            "stage": self.stage,
            "iteration": int(self.iteration),
            "of": int(self.of),
            "similarity": similarity,
            "seconds": round(float(self.seconds), 3),
        }
        if self.preview is not None:
            fields["preview"] = self.preview
        return json.dumps(fields)


ProgressCallback = Callable[[Progress], None]
"""Called after every iteration, on the thread that registers."""

CancelQuery = Callable[[], bool]
"""Asked at every iteration; True stops the registration with CancelledError."""
