"""Frames followed one after the other, forward or backward in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.tracking.kept import Kept
from PolyPoseLib.tracking.one_frame import next_frame
from PolyPoseLib.tracking.patient import Patient

STAGES = {"forward": "tracking", "backward": "tracking back"}
"""What progress calls a pass, by the way that time goes."""


@dataclass(frozen=True)
class Course:
    """Which way a pass goes.

    Attributes
    ----------
    numbers : range
        Of the frames that it finds, in its order.
    direction : {"forward", "backward"}
        Which way time goes; the source of poses that it finds.
    corrected : mapping of int to TrackedFrame
        Frames of an earlier track that hold poses which were corrected by hand, and are kept.

    """

    numbers: range
    direction: str = "forward"
    corrected: Mapping[int, TrackedFrame] = field(default_factory=dict)


def swept(patient: Patient, frames: Sequence[TrackedFrame], course: Course, kept: Kept) -> list[TrackedFrame]:
    """The frames that a pass begins with (at least one, the nearest last), and those that it finds after them."""
    run = patient.run.named(STAGES[course.direction])
    frames = list(frames)
    total = len(frames) + len(course.numbers)

    def found(number: int) -> TrackedFrame:
        run.step(len(frames), total, similarity_of(frames[-1]))
        frame = next_frame(patient, number, frames, course.corrected.get(number))
        return _as_found(patient, frame, course.direction)

    for number in course.numbers:
        frames.append(kept.frame(number, partial(found, number)))
    run.step(total, total, similarity_of(frames[-1]))
    return frames


def similarity_of(frame: TrackedFrame) -> float:
    """Mean over the structures, as progress reports it."""
    return 1 - float(frame.residuals.mean())


def _as_found(patient: Patient, frame: TrackedFrame, direction: str) -> TrackedFrame:
    """The frame with the way that time goes as the source of what moves and was found at once."""
    sources = [
        direction if k in patient.moving and source == "forward" else source
        for k, source in enumerate(frame.sources)
    ]
    return replace(frame, sources=tuple(sources))
