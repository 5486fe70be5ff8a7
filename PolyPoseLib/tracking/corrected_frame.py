"""A frame that somebody corrected by hand, from which others are tracked on.

A hand is off by millimetres and degrees, farther than a prediction. What it placed is fitted first and from coarse
pixels on, with all other structures where they were; then all are fitted together. Structures that were placed are not
started elsewhere: where the fit leads far away from the hand's pose, that pose is kept, and flagged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.data.tracking.correction import Correction
from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import perturbation_between, rigid_inverse
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.tracking.assessment import Assessment, assess, distance_mm
from PolyPoseLib.tracking.frame_fit import ARRIVING, FOLLOWING, Frame
from PolyPoseLib.tracking.one_frame import corrected_in, look_again
from PolyPoseLib.tracking.outcome import tracked_frame, with_poses_of
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found

LEAVES_MM = 15.0
"""Distance, mm of the scene, from the hand's pose, rotation counted by the structure's radius, beyond which a fit has
run away from it."""

BY_HAND = PoseUncertainty.independent(4.0, 5.0)
"""Of a pose as a hand places it."""


@dataclass(frozen=True)
class _Placed:
    """Structures of a corrected frame, by index: placed by hand now, free to move, and (K, 4, 4) starts, all in the
    scene.
    """

    by_hand: list[int]
    free: list[int]
    start: np.ndarray


def corrected_frame(patient: Patient, correction: Correction) -> TrackedFrame:
    """The corrected frame, fitted from the poses that were given.

    Parameters
    ----------
    patient : Patient
        What is tracked.
    correction : Correction
        Of an earlier track of it.

    Returns
    -------
    TrackedFrame
        With the source "corrected" of what was placed by hand, now or in an earlier correction of the frame.

    Raises
    ------
    InputError
        A structure that was placed stands still, or no camera shows anything.

    """
    names, earlier = patient.scene.names, correction.corrected
    still = [name for name in correction.poses if names.index(name) in patient.still]
    if still:
        raise InputError(
            f'"{still[0]}" stands still ("still"), so that no single frame of it can be corrected: remove it from '
            '"still" and track again, or give its pose in "initial_poses".'
        )
    frame = Frame(patient, correction.frame)
    if not frame.observations:
        raise InputError(
            f"No camera shows anything in frame {correction.frame}: correct one that shows the structures."
        )
    placed = _placed(patient, correction)
    if not placed.free:
        return earlier
    found, held, sources = _fitted(frame, placed)
    lost = tuple(k for k in found.lost if k not in placed.by_hand)
    for k in placed.by_hand:
        sources[k] = "corrected"
    predicted = patient.at_true_size(placed.start)
    result = tracked_frame(patient, frame.number, replace(found, lost=lost), predicted, sources, [earlier])
    result = _with_held(patient, result, placed, held)
    return with_poses_of(result, earlier, [k for k in patient.moving if k not in placed.free])


def _placed(patient: Patient, correction: Correction) -> _Placed:
    """Where every structure starts."""
    names, earlier = patient.scene.names, correction.corrected
    by_hand = [names.index(name) for name in correction.poses]
    poses = earlier.poses.copy()
    for name, pose in correction.poses.items():
        poses[names.index(name)] = pose
    reference = patient.reference
    if not np.isfinite(poses[reference]).all():
        poses[reference] = next((pose for pose in poses if np.isfinite(pose).all()), np.eye(4))
    for k in range(len(poses)):
        if k in by_hand or k == reference:
            continue
        if not np.isfinite(poses[k]).all():
            poses[k] = poses[reference]  # as they lie in the CT
        elif not is_found(earlier, k) and np.isfinite(earlier.poses[reference]).all():
            poses[k] = poses[k] @ rigid_inverse(earlier.poses[reference]) @ poses[reference]
    kept = [k for k in corrected_in(patient, earlier) if k not in by_hand]
    return _Placed(by_hand, [k for k in patient.moving if k not in kept], patient.enlarged(poses))


def _fitted(frame: Frame, placed: _Placed) -> tuple[Assessment, dict[int, np.ndarray], list[str]]:
    """The fit as it is known, where it led structures (4, 4) whose pose is kept instead, and the sources."""
    patient, free = frame.patient, placed.free
    poses = placed.start
    if placed.by_hand:
        poses = frame.fit(poses, ARRIVING[:-1], placed.by_hand).poses
    fit = frame.fit(poses, FOLLOWING, free)
    left = {
        k: fit.poses[k]
        for k in placed.by_hand
        if distance_mm(patient, placed.start[k], fit.poses[k], k) > LEAVES_MM
    }
    if left:
        free = [k for k in free if k not in left]
        poses = poses.copy()
        poses[list(left)] = placed.start[list(left)]
        fit = frame.fit(poses, FOLLOWING, free)
    found = assess(patient, fit, None, ())
    sources = ["forward"] * len(poses)
    others = [k for k in free if k not in placed.by_hand]
    suspects = tuple(k for k in found.suspects if k in others)
    if suspects:
        found, sources = look_again(
            frame, replace(found, suspects=suspects), None, (), [placed.start], others
        )
        found = assess(patient, frame.fit(found.fit.poses, FOLLOWING[-1:], free), None, ())
    return found, left, sources


def _with_held(
    patient: Patient, frame: TrackedFrame, placed: _Placed, held: dict[int, np.ndarray]
) -> TrackedFrame:
    """The frame with the hand's own poses of structures that the fit led away from it."""
    poses, covariances = frame.poses.copy(), frame.covariances.copy()
    doubts: list[Sequence[str]] = list(frame.doubts)
    for k, led in held.items():
        poses[k] = patient.at_true_size(placed.start[k])
        covariances[k] = BY_HAND.covariance
        away = perturbation_between(placed.start[k], led, patient.scene.centres[k])
        degrees, mm = np.degrees(np.linalg.norm(away[:3])), np.linalg.norm(away[3:]) / patient.factor
        line = (
            f"the X-rays lead {mm:.0f} mm and {degrees:.0f} degrees away from the pose by hand, which is kept"
        )
        doubts[k] = (line, *doubts[k])
    return replace(frame, poses=poses, covariances=covariances, doubts=tuple(map(tuple, doubts)))
