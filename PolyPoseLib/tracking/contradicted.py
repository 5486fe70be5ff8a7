"""Poses that an X-ray contradicts have the interval of such a pose, whatever the residual's spread says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.tracking.assessment import AGAINST
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found


def with_contradictions(patient: Patient, frames: Sequence[TrackedFrame]) -> list[TrackedFrame]:
    """The frames, with wider covariances where a pose was found that some camera's X-ray does not match.

    A fit in a wrong local minimum is as sharp as one in the right one: its curvature tells nothing of how far it is
    off. While frames are followed their own covariances count, because most of such poses are right after all.
    """
    doubted = patient.covariances_at_true_size(PoseUncertainty.doubted().covariance)
    widened = []
    for frame in frames:
        covariances = frame.covariances.copy()
        for k in range(len(covariances)):
            if _is_contradicted(frame, k):
                covariances[k] += doubted
        widened.append(replace(frame, covariances=covariances))
    return widened


def without_contradictions(patient: Patient, frame: TrackedFrame) -> TrackedFrame:
    """A frame with covariances as they were before :func:`with_contradictions`, but for rounding."""
    doubted = patient.covariances_at_true_size(PoseUncertainty.doubted().covariance)
    covariances = frame.covariances.copy()
    for k in range(len(covariances)):
        if _is_contradicted(frame, k):
            covariances[k] -= doubted
    return replace(frame, covariances=covariances)


def _is_contradicted(frame: TrackedFrame, k: int) -> bool:
    return is_found(frame, k) and any(line.startswith(AGAINST) for line in frame.doubts[k])
