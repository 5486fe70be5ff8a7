"""Structures that were lost in some frames stand, relative to the reference, between where they were seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import between_poses, is_found


def bridged(patient: Patient, frames: Sequence[TrackedFrame]) -> list[TrackedFrame]:
    """The frames, with poses that were lost taken from the nearest frames that have them.

    Between two such frames a structure moves evenly, relative to the reference; before the first and after the last it
    stays with the reference. Its interval is that of a pose that no X-ray shows.
    """
    frames = list(frames)
    order = [patient.reference, *(k for k in range(len(patient.radii)) if k != patient.reference)]
    for k in order:
        seen = [n for n, each in enumerate(frames) if is_found(each, k)]
        if not seen:
            continue
        for n, frame in enumerate(frames):
            if is_found(frame, k):
                continue
            before = max((m for m in seen if m < n), default=None)
            after = min((m for m in seen if m > n), default=None)
            poses = frame.poses.copy()
            poses[k] = _stand_in(patient, frames, n, before, after, k)
            covariances = frame.covariances.copy()
            covariances[k] = PoseUncertainty.unseen().covariance
            frames[n] = replace(frame, poses=poses, covariances=covariances)
    return frames


def _stand_in(
    patient: Patient, frames: list[TrackedFrame], n: int, before: int | None, after: int | None, k: int
) -> np.ndarray:
    """(4, 4) a structure's pose from that in the frames before and after, of which there is one at least."""
    centre = patient.scene.centres[k] / patient.factor

    def relative(m: int) -> np.ndarray:
        """Relative to the reference, or to the rig for the reference itself."""
        pose = frames[m].poses[k]
        return pose if k == patient.reference else pose @ rigid_inverse(frames[m].poses[patient.reference])

    if before is None or after is None:
        nearest = after if before is None else before
        assert nearest is not None, "a structure that was never seen has no stand-in"
        found = relative(nearest)
    else:
        share = (frames[n].frame - frames[before].frame) / (frames[after].frame - frames[before].frame)
        found = between_poses(relative(before), relative(after), share, centre)
    return found if k == patient.reference else found @ frames[n].poses[patient.reference]
