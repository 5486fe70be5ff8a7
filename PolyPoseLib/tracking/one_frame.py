"""One frame of a pass: after those before it, or as the first of a sequence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.registration.fit.levels import Level
from PolyPoseLib.tracking.assessment import Assessment, assess, usual_step
from PolyPoseLib.tracking.comparison import better_poses
from PolyPoseLib.tracking.first_frame import starting_poses
from PolyPoseLib.tracking.frame_fit import ARRIVING, FOLLOWING, Frame
from PolyPoseLib.tracking.outcome import lost_frame, tracked_frame, with_poses_of
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found, predicted_poses
from PolyPoseLib.tracking.recovery import fit_again

UNEVEN_MM = 5.0
"""Usual change of a structure's step from frame to frame, mm of the scene, beyond which its prediction is rough."""


def first_frame(patient: Patient, number: int) -> TrackedFrame:
    """The first frame, from where its structures were put or are found; raises InputError where it shows nothing."""
    frame = Frame(patient, number)
    if not frame.observations:
        raise InputError(
            f"No camera shows anything in frame {frame.number}, the first one: start with another by the option "
            '"first".'
        )
    registers = patient.sequence.options.start == "registration"
    start = starting_poses(patient, frame if registers else None)
    free = [k for k in range(len(start)) if k not in patient.vouched]
    levels = FOLLOWING if registers else ARRIVING
    found = assess(patient, frame.fit(start, levels, free), None, ())
    sources = ["forward"] * len(start)
    if found.suspects:
        found, sources = look_again(frame, found, None, (), [start])
        if "restart" in sources and free != patient.moving:  # what stands still is free in this frame alone
            found = assess(patient, frame.fit(found.fit.poses, FOLLOWING[-1:], free), None, ())
    for k in patient.vouched:
        sources[k] = "given"
    return tracked_frame(patient, frame.number, found, patient.at_true_size(start), sources, ())


def next_frame(
    patient: Patient, number: int, past: Sequence[TrackedFrame], corrected: TrackedFrame | None = None
) -> TrackedFrame:
    """A frame after those before it, whichever way time goes.

    Parameters
    ----------
    patient : Patient
        What is tracked.
    number : int
        Of the frame.
    past : sequence of TrackedFrame
        The nearest last; at least one.
    corrected : TrackedFrame, optional
        The same frame as an earlier track has it: what was corrected by hand in it stays as it is.

    Returns
    -------
    TrackedFrame
        With the source "forward", "restart" or "none" of what is found here.

    """
    fixed = [] if corrected is None else corrected_in(patient, corrected)
    free = [k for k in patient.moving if k not in fixed]
    if corrected is not None and not free:
        return replace(corrected, cpu_seconds=0.0)
    found = _followed(patient, number, past, free, corrected)
    return found if corrected is None else with_poses_of(found, corrected, fixed)


def corrected_in(patient: Patient, frame: TrackedFrame) -> list[int]:
    """Structures whose pose in a frame somebody corrected by hand."""
    return [k for k in patient.moving if frame.sources[k] == "corrected"]


def _followed(
    patient: Patient,
    number: int,
    past: Sequence[TrackedFrame],
    free: list[int],
    corrected: TrackedFrame | None,
) -> TrackedFrame:
    """The frame with all structures that are free found, and the others where they were corrected."""
    frame = Frame(patient, number)
    options = patient.sequence.options
    centres = patient.sequence.structures.centroids(patient.sequence.ct.affine)
    moves_on = options.prediction == "constant_velocity"
    predicted = predicted_poses(past, centres, patient.reference, moves_on)
    if corrected is not None:
        fixed = corrected_in(patient, corrected)
        predicted[fixed] = corrected.poses[fixed]
    if not frame.observations:
        return lost_frame(patient, number, predicted, "no camera shows anything in this frame", past[-1])
    start = patient.enlarged(predicted)
    found = assess(patient, frame.fit(start, _levels(patient, past), free), start, past)
    sources = ["forward"] * len(start)
    suspects = tuple(k for k in found.suspects if k in free)
    if suspects:
        places = [start, patient.enlarged(past[-1].poses)]
        if any(past[-1].doubts[k] or not is_found(past[-1], k) for k in suspects):
            places += [patient.enlarged(each.poses) for each in past[-3:-1]]
        found, sources = look_again(frame, replace(found, suspects=suspects), start, past, places, free)
    return tracked_frame(patient, number, found, predicted, sources, past)


def _levels(patient: Patient, past: Sequence[TrackedFrame]) -> tuple[Level, ...]:
    """From coarser pixels on where no velocity is known yet, or where velocities change by too much for fine ones."""
    if len(past) < 2 or max(usual_step(patient, past, k) for k in patient.moving) > UNEVEN_MM:
        return ARRIVING
    return FOLLOWING


def look_again(
    frame: Frame,
    found: Assessment,
    predicted: np.ndarray | None,
    beside: Sequence[TrackedFrame],
    places: Sequence[np.ndarray],
    free: list[int] | None = None,
) -> tuple[Assessment, list[str]]:
    """Try other starts for suspects; returns the better poses with what is known of them, and where they come from.

    free: structures that may have another pose; all that move unless it is given.
    """
    patient = frame.patient
    free = patient.moving if free is None else free
    again = fit_again(frame, found.fit.poses, found.suspects, places)
    taken = better_poses(frame, found.fit.poses, again.poses, free)
    if not taken.any():
        return found, ["forward"] * len(taken)
    fit = again
    if not taken[patient.moving].all():
        mixed = np.where(taken[:, None, None], again.poses, found.fit.poses)
        fit = frame.fit(mixed, FOLLOWING[-1:], free)
    sources = ["restart" if each else "forward" for each in taken]
    return assess(patient, fit, predicted, beside), sources
