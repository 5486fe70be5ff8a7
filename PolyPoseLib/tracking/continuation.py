"""A track continued from a frame that was corrected by hand: other frames are kept, and all are one track again."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from PolyPoseLib.data.tracking.correction import Correction
from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.tracking.backward import looked_at_again
from PolyPoseLib.tracking.contradicted import with_contradictions, without_contradictions
from PolyPoseLib.tracking.corrected_frame import corrected_frame
from PolyPoseLib.tracking.gaps import bridged
from PolyPoseLib.tracking.jumps import with_jumps, without_jumps
from PolyPoseLib.tracking.kept import Kept
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.sweep import Course, swept


def tracked_on(patient: Patient, correction: Correction, kept: Kept) -> list[TrackedFrame]:
    """The frames that are tracked anew, in the order of time.

    From the corrected frame time goes forward, backward, or both; then, as in any tracking, back to it again, to keep
    the better of two poses. Nothing is taken from the earlier track but what was corrected by hand: beside a frame that
    needs to be corrected, others may be as wrong. And it is taken as it was followed: what the end of a tracking adds
    to flags and intervals is added to the new frames at their own end, once.
    """
    followed = tuple(_as_followed(patient, each) for each in correction.track.frames)
    correction = replace(correction, track=replace(correction.track, frames=followed))
    numbers, number = correction.renewed, correction.frame
    by_hand = {each.frame: each for each in correction.track.frames if "corrected" in each.sources}
    patient.run.step(0, len(numbers), None)
    here = kept.frame(number, lambda: corrected_frame(patient, correction))
    forward = Course(range(number + 1, numbers.stop), "forward", by_hand)
    backward = Course(range(number - 1, numbers.start - 1, -1), "backward", by_hand)
    later = swept(patient, [here], forward, kept) if forward.numbers else [here]
    sooner = swept(patient, [here], backward, kept) if backward.numbers else [here]
    if patient.sequence.options.backward:
        later = looked_at_again(patient, later, "backward", kept)
        sooner = looked_at_again(patient, [later[0], *sooner[1:]], "forward", kept)
    return [*sooner[:0:-1], sooner[0], *later[1:]]


def joined(
    patient: Patient, earlier: Sequence[TrackedFrame], new: Sequence[TrackedFrame]
) -> list[TrackedFrame]:
    """The earlier track's frames with the new ones in their places, as one track.

    Kept frames stay as they are, number for number, with two exceptions: a structure that was lost is bridged between
    the nearest frames that have it, new ones perhaps; and whether a pose lies between its neighbours' is said anew
    where one of these is new.
    """
    fresh = {each.frame: each for each in new}
    frames = bridged(patient, [fresh.get(each.frame, each) for each in earlier])
    judged = with_jumps(
        patient, [each if each.frame in fresh else _as_followed(patient, each) for each in frames]
    )
    return [
        with_contradictions(patient, [judged[n]])[0]
        if each.frame in fresh
        else replace(each, doubts=judged[n].doubts)
        if _is_beside(frames, n, fresh)
        else each
        for n, each in enumerate(frames)
    ]


def _as_followed(patient: Patient, frame: TrackedFrame) -> TrackedFrame:
    """A frame of a finished track as it was before its flags and intervals were completed."""
    return without_jumps(without_contradictions(patient, frame))


def _is_beside(frames: Sequence[TrackedFrame], n: int, fresh: Collection[int]) -> bool:
    """Whether the frame before the nth or the one after it is new."""
    return any(each.frame in fresh for each in frames[max(n - 1, 0) : n + 2])
