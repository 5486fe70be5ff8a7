"""What is kept of a frame, in the patient's millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import orthonormalised
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.tracking.assessment import Assessment
from PolyPoseLib.tracking.patient import Patient

GIVEN = PoseUncertainty.independent(0.1, 0.1)
"""Of a pose that somebody vouches for."""


def tracked_frame(
    patient: Patient,
    number: int,
    found: Assessment,
    predicted: np.ndarray,
    sources: Sequence[str],
    beside: Sequence[TrackedFrame],
) -> TrackedFrame:
    """A frame whose lost structures stand where they were expected.

    Parameters
    ----------
    patient : Patient
        The structures.
    number : int
        Of the frame.
    found : Assessment
        Of its fit.
    predicted : (K, 4, 4) ndarray
        In the patient's mm.
    sources : sequence of str
        Where the poses come from.
    beside : sequence of TrackedFrame
        From the last of which structures that stand still have their pose and all that is known of it.

    Returns
    -------
    TrackedFrame
        With the source "none" for what was lost.

    """
    poses = orthonormalised(patient.at_true_size(found.fit.poses))
    covariances = patient.covariances_at_true_size(found.covariances)
    origin = list(sources)
    for k in found.lost:
        poses[k], covariances[k], origin[k] = predicted[k], PoseUncertainty.unseen().covariance, "none"
    if beside:
        frame = TrackedFrame(number, poses, covariances, found.residuals, found.doubts, tuple(origin))
        return _with_still(patient.still, frame, beside[-1])
    for k in patient.still:
        if origin[k] == "given":  # somebody vouches for it
            poses[k], covariances[k] = predicted[k], GIVEN.covariance
    return TrackedFrame(number, poses, covariances, found.residuals, found.doubts, tuple(origin))


def lost_frame(
    patient: Patient, number: int, predicted: np.ndarray, why: str, before: TrackedFrame
) -> TrackedFrame:
    """A frame of which nothing is known but what the one before it says.

    predicted: (K, 4, 4) in the patient's mm. What stands still is where it was.
    """
    count = len(predicted)
    frame = TrackedFrame(
        number,
        predicted,
        np.stack([PoseUncertainty.unseen().covariance] * count),
        np.ones(count),
        ((why,),) * count,
        ("none",) * count,
    )
    return _with_still(patient.still, frame, before)


def with_poses_of(frame: TrackedFrame, other: TrackedFrame, which: Sequence[int]) -> TrackedFrame:
    """A frame in which some structures are as in another, with all that is known of them there."""
    residuals = frame.residuals.copy()
    residuals[which] = other.residuals[which]
    return replace(_with_still(which, frame, other), residuals=residuals)


def _with_still(still: Sequence[int], frame: TrackedFrame, beside: TrackedFrame) -> TrackedFrame:
    """A frame in which the structures that stand still are as in another, with what speaks against them there."""
    poses, covariances = frame.poses.copy(), frame.covariances.copy()
    doubts, sources = list(frame.doubts), list(frame.sources)
    for k in still:
        poses[k], covariances[k] = beside.poses[k], beside.covariances[k]
        doubts[k], sources[k] = beside.doubts[k], beside.sources[k]
    return replace(frame, poses=poses, covariances=covariances, doubts=tuple(doubts), sources=tuple(sources))
