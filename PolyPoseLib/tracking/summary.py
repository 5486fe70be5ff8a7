"""What people should know of a whole track."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.tracking.patient import Patient
from PolyPoseLib.tracking.prediction import is_found

MOSTLY = 0.5
"""Share of the frames in which a structure is lost from which on its track is not to be trusted."""


def warnings_about(patient: Patient, frames: Sequence[TrackedFrame]) -> Iterator[str]:
    """Sentences about structures that were lost or are doubtful in some frames."""
    for k, name in enumerate(patient.scene.names):
        lost = [each.frame for each in frames if not is_found(each, k)]
        doubtful = [each.frame for each in frames if each.doubts[k] and is_found(each, k)]
        if lost:
            yield (
                f'"{name}" was lost in {_count(lost, frames)} ({_ranges(lost)}): its poses there are interpolated from '
                "the frames beside them."
            )
        if doubtful:
            yield f'The pose of "{name}" is doubtful in {_count(doubtful, frames)} ({_ranges(doubtful)}).'
    if len(patient.sequence.views) == 1:
        widest = max(
            float(np.median([PoseUncertainty(each.covariances[k]).widest_mm for each in frames]))
            for k in range(len(patient.scene.names))
        )
        yield (
            f"A single camera holds places along its beam to about {widest:.0f} mm only (half of a 95 % interval, of "
            "the least certain structure): a second camera would tell them."
        )
    for view in patient.sequence.views:
        if not any(
            _is_shown(patient, frame, k, view.camera) for frame in frames for k in range(len(frame.poses))
        ):
            yield (
                f'No structure projects into the images of the camera "{view.name}" where it was found: that camera '
                "tells nothing; check its calibration and its extrinsic."
            )
    if patient.scene.bare:
        yield (
            "The CT holds bones alone: its renderings lack the soft tissue that the X-rays show, and poses are less "
            "certain; give the whole CT if there is one."
        )


def reasons_for_distrust(patient: Patient, frames: Sequence[TrackedFrame]) -> Iterator[str]:
    """Sentences about structures that were never really followed."""
    for k, name in enumerate(patient.scene.names):
        share = sum(not is_found(each, k) for each in frames) / len(frames)
        if share > MOSTLY:
            yield (
                f'"{name}" was lost in {share:.0%} of the frames: check the cameras, and the poses of the first frame '
                "in the overlay."
            )


def _is_shown(patient: Patient, frame: TrackedFrame, k: int, camera: Camera) -> bool:
    """Whether some point of a structure projects into a camera's image."""
    fixed = rigid_inverse(frame.poses[k])
    points = patient.points[k] / patient.factor @ fixed[:3, :3].T + fixed[:3, 3]
    column, row = camera.project(points).T  # NaN behind the source
    return bool(((column > 0) & (column < camera.width) & (row > 0) & (row < camera.height)).any())


def _count(some: Sequence[int], frames: Sequence[TrackedFrame]) -> str:
    return f"{len(some)} of {len(frames)} frames"


def _ranges(numbers: Sequence[int], most: int = 5) -> str:
    """Numbers in order as ranges, such as "3-7, 9"; long lists are cut."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][1] + 1:
            parts[-1][1] = number
        else:
            parts.append([number, number])
    texts = [f"{a}" if a == b else f"{a}-{b}" for a, b in parts[:most]]
    return ", ".join(texts) + (", ..." if len(parts) > most else "")
