"""The second pass, backward in time: what was lost on the way there is found on the way back.

A frame whose poses lie where the frames after it lead is left alone: a fit from there would end where it is. Where they
do not, or where something speaks against them, the frame is fitted once more from there, and each structure keeps the
pose that the X-rays agree with better. A structure that was lost in an overlap and found after it is thus followed back
into the overlap.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.tracking.assessment import WEAK, assess, distance_mm
from PolyPoseLib.tracking.comparison import better_poses
from PolyPoseLib.tracking.frame_fit import FOLLOWING, Frame
from PolyPoseLib.tracking.outcome import tracked_frame
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found, predicted_poses
from PolyPoseLib.tracking.recovery import fit_again

AGREES_MM = 2.5
"""Distance, mm of the scene, within which a fit from one pose ends at the other."""

REMEMBERED = 20
"""Frames after one that its fit may look at."""


def corrected_backward(patient: Patient, frames: Sequence[TrackedFrame]) -> list[TrackedFrame]:
    """Frames of the forward pass, with what the way back found better.

    Parameters
    ----------
    patient : Patient
        What was tracked.
    frames : sequence of TrackedFrame
        In the order of time.

    Returns
    -------
    list of TrackedFrame
        Of the same numbers, with the source "backward" where a pose is another.

    """
    run = patient.run.named("tracking back")
    frames = list(frames)
    for n in range(len(frames) - 2, -1, -1):
        similarity = 1 - float(frames[n].residuals.mean())
        run.step(len(frames) - 2 - n, len(frames) - 1, similarity)
        before = time.process_time()
        after = frames[n + 1 : n + 1 + REMEMBERED][::-1]
        found = _looked_at_again(patient, frames[n], after, frames[max(n - REMEMBERED, 0) : n])
        seconds = found.cpu_seconds + time.process_time() - before
        frames[n] = replace(found, cpu_seconds=seconds)
    return frames


def _looked_at_again(
    patient: Patient, frame: TrackedFrame, after: Sequence[TrackedFrame], before: Sequence[TrackedFrame]
) -> TrackedFrame:
    """A frame as the frames after it, the nearest last, would have it where that is better."""
    centres = patient.scene.centres / patient.factor
    moves_on = patient.sequence.options.prediction == "constant_velocity"
    expected = predicted_poses(after, centres, patient.reference, moves_on)
    start, here = patient.enlarged(expected), patient.enlarged(frame.poses)
    tried = [
        k
        for k in patient.moving
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
    fit = images.fit(mixed, FOLLOWING, patient.moving)
    found = assess(patient, fit, None, after)
    if found.suspects:
        places = [start] + ([patient.enlarged(before[-1].poses)] if before else [])
        again = fit_again(images, fit.poses, found.suspects, places)
        taken = better_poses(images, fit.poses, again.poses, patient.moving)
        fit = again if taken.all() else fit
        if taken.any() and not taken.all():
            poses = np.where(taken[:, None, None], again.poses, fit.poses)
            fit = images.fit(poses, FOLLOWING[-1:], patient.moving)
    taken = better_poses(images, here, fit.poses, patient.moving)
    lost = np.array([not is_found(frame, k) for k in range(len(taken))])
    taken |= lost & np.isin(np.arange(len(taken)), patient.moving)
    if not taken.any():
        return frame
    if not taken[patient.moving].all():
        poses = np.where(taken[:, None, None], fit.poses, here)
        fit = images.fit(poses, FOLLOWING[-1:], patient.moving)
    found = assess(patient, fit, None, [*after])
    sources = ["backward" if each else source for each, source in zip(taken, frame.sources, strict=True)]
    result = tracked_frame(patient, frame.frame, found, frame.poses, sources, [frame])
    return replace(result, cpu_seconds=frame.cpu_seconds)
