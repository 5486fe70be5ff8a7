"""A frame that somebody corrected by hand, from which others are tracked on.

A hand is off by millimetres and degrees, farther than a prediction. What it placed is fitted first and from coarse
pixels on, with all other structures where they were; then all are fitted together. Where that leads far away from the
hand's pose, it is flagged; where the X-rays contradict it besides, the hand's pose is kept.
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
from PolyPoseLib.tracking.assessment import AGAINST, Assessment, assess, distance_mm
from PolyPoseLib.tracking.frame_fit import ARRIVING, FOLLOWING, Frame
from PolyPoseLib.tracking.one_frame import corrected_in, look_again
from PolyPoseLib.tracking.outcome import tracked_frame, with_poses_of
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found

LEAVES_MM = 20.0
"""Distance, mm of the scene, from the hand's pose, rotation counted by the structure's radius, up to which a fit is a
correction of it. In simulated knees poses that were farther off did not lead to the right ones reliably."""

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
    found, sources = _fitted(frame, placed)
    away = _away(patient, found, placed)
    held = [k for k in away if _is_contradicted(found, k)]
    if held:
        found = _held(frame, found, placed, held)
    doubts = list(found.doubts)
    for k, line in away.items():
        doubts[k] = (f"{line}{', which is kept' if k in held else ''}", *doubts[k])
    for k in placed.by_hand:
        sources[k] = "corrected"
    lost = tuple(k for k in found.lost if k not in placed.by_hand)
    found = replace(found, doubts=tuple(doubts), lost=lost)
    predicted = patient.at_true_size(placed.start)
    result = tracked_frame(patient, frame.number, found, predicted, sources, [earlier])
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


def _fitted(frame: Frame, placed: _Placed) -> tuple[Assessment, list[str]]:
    """The fit as it is known, and the sources.

    Where X-rays contradict it, other starts are tried about the poses of the start: a hand's may lie beyond the reach
    of a fit.
    """
    patient, free = frame.patient, placed.free
    poses = placed.start
    if placed.by_hand:
        poses = frame.fit(poses, ARRIVING[:-1], placed.by_hand).poses
    found = assess(patient, frame.fit(poses, FOLLOWING, free), None, ())
    suspects = tuple(k for k in found.suspects if k in free)
    if not suspects:
        return found, ["forward"] * len(poses)
    return look_again(frame, replace(found, suspects=suspects), None, (), [placed.start], free)


def _away(patient: Patient, found: Assessment, placed: _Placed) -> dict[int, str]:
    """What to say of structures that the fit led far away from where they were placed, by index."""
    lines = {}
    for k in placed.by_hand:
        start, pose = placed.start[k], found.fit.poses[k]
        if distance_mm(patient, start, pose, k) > LEAVES_MM:
            away = perturbation_between(start, pose, patient.scene.centres[k])
            degrees, mm = np.degrees(np.linalg.norm(away[:3])), np.linalg.norm(away[3:]) / patient.factor
            lines[k] = f"the X-rays lead {mm:.0f} mm and {degrees:.0f} degrees away from the pose by hand"
    return lines


def _is_contradicted(found: Assessment, k: int) -> bool:
    return k in found.lost or any(line.startswith(AGAINST) for line in found.doubts[k])


def _held(frame: Frame, found: Assessment, placed: _Placed, which: Sequence[int]) -> Assessment:
    """The fit with some structures where they were placed."""
    patient = frame.patient
    poses = found.fit.poses.copy()
    poses[which] = placed.start[which]
    free = [k for k in placed.free if k not in which]
    held = assess(patient, frame.fit(poses, FOLLOWING, free), None, ())
    covariances = held.covariances.copy()
    scale = np.r_[np.ones(3), np.full(3, patient.factor)]
    covariances[which] = BY_HAND.covariance * np.outer(scale, scale)
    return replace(held, covariances=covariances)
