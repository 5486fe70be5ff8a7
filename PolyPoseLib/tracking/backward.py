"""The second pass, back in time: what was lost on the way there is found on the way back.

A frame whose poses lie where the frames after it lead is left alone: a fit from there would end where it is. Where they
do not, or where something speaks against them, the frame is fitted once more from there, and each structure keeps the
pose that the X-rays agree with better. A structure that was lost in an overlap and found after it is thus followed back
into the overlap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.tracking.assessment import WEAK, assess, distance_mm
from PolyPoseLib.tracking.comparison import better_poses
from PolyPoseLib.tracking.frame_fit import FOLLOWING, Frame
from PolyPoseLib.tracking.kept import Kept
from PolyPoseLib.tracking.one_frame import corrected_in
from PolyPoseLib.tracking.outcome import tracked_frame, with_poses_of
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found, predicted_poses
from PolyPoseLib.tracking.recovery import fit_again
from PolyPoseLib.tracking.sweep import STAGES, similarity_of

AGREES_MM = 2.5
"""Distance, mm of the scene, within which a fit from one pose ends at the other."""


def looked_at_again(
    patient: Patient, frames: Sequence[TrackedFrame], direction: str, kept: Kept
) -> list[TrackedFrame]:
    """Frames of a pass, with what the way back found better.

    Parameters
    ----------
    patient : Patient
        What was tracked.
    frames : sequence of TrackedFrame
        In the order of the pass.
    direction : {"forward", "backward"}
        Which way time goes on the way back.
    kept : Kept
        Takes every frame.

    Returns
    -------
    list of TrackedFrame
        Of the same numbers, in the same order, with the direction as the source where a pose is another. What was
        corrected by hand stays as it is.

    """
    run = patient.run.named(STAGES[direction])
    frames = list(frames)

    def found(n: int) -> TrackedFrame:
        run.step(len(frames) - 2 - n, len(frames) - 1, similarity_of(frames[n]))
        after, before = frames[:n:-1], frames[:n]
        return _looked_at_again(patient, frames[n], after, before, direction)

    for n in range(len(frames) - 2, -1, -1):
        frames[n] = kept.frame(frames[n].frame, partial(found, n))
    return frames


def _looked_at_again(
    patient: Patient,
    frame: TrackedFrame,
    after: Sequence[TrackedFrame],
    before: Sequence[TrackedFrame],
    direction: str,
) -> TrackedFrame:
    """A frame as the frames after it, the nearest last, would have it where that is better."""
    centres = patient.scene.centres / patient.factor
    moves_on = patient.sequence.options.prediction == "constant_velocity"
    expected = predicted_poses(after, centres, patient.reference, moves_on)
    start, here = patient.enlarged(expected), patient.enlarged(frame.poses)
    fixed = corrected_in(patient, frame)
    free = [k for k in patient.moving if k not in fixed]
    tried = [
        k
        for k in free
        if is_found(after[-1], k)
        and (
            not is_found(frame, k)
            or set(frame.doubts[k]) - {WEAK} - set(after[-1].doubts[k])
            or distance_mm(patient, start[k], here[k], k) > AGREES_MM
        )
    ]
    if not tried:
        return frame
    images = Frame(patient, frame.frame)
    if not images.observations:
        return frame
    mixed = here.copy()
    mixed[tried] = start[tried]
    fit = images.fit(mixed, FOLLOWING, free)
    # At the end of a sequence only the frames before it tell what is ordinary.
    beside = [*before, *after]
    found = assess(patient, fit, None, beside)
    suspects = [k for k in found.suspects if k in free]
    if suspects:
        places = [start] + ([patient.enlarged(before[-1].poses)] if before else [])
        again = fit_again(images, fit.poses, suspects, places)
        taken = better_poses(images, fit.poses, again.poses, free)
        fit = again if taken.all() else fit
        if taken.any() and not taken.all():
            poses = np.where(taken[:, None, None], again.poses, fit.poses)
            fit = images.fit(poses, FOLLOWING[-1:], free)
    taken = better_poses(images, here, fit.poses, free)
    lost = np.array([not is_found(frame, k) for k in range(len(taken))])
    taken |= lost & np.isin(np.arange(len(taken)), free)
    if not taken.any():
        return frame
    if not taken[free].all():
        poses = np.where(taken[:, None, None], fit.poses, here)
        fit = images.fit(poses, FOLLOWING[-1:], free)
    found = assess(patient, fit, None, beside)
    sources = [direction if each else source for each, source in zip(taken, frame.sources, strict=True)]
    result = tracked_frame(patient, frame.frame, found, frame.poses, sources, [frame])
    return replace(with_poses_of(result, frame, fixed), cpu_seconds=frame.cpu_seconds)
