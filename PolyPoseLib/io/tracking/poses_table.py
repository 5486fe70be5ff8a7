"""The table of a track: one row a frame and structure, with 95 % intervals; units stand in the names of the columns."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.errors import one_line
from PolyPoseLib.geometry.rigid import rigid_inverse

INTERVALS = (
    "interval_along_view_mm", "interval_across_view_1_mm", "interval_across_view_2_mm", "interval_about_view_deg",
    "interval_about_across_1_deg", "interval_about_across_2_deg",
)  # fmt: skip
"""Half widths of 95 % intervals, along and across the cameras' common viewing direction."""

COLUMNS = (
    "frame", "time_s", "structure", "source", "doubtful", "lost", "residual",
    "centroid_x_mm", "centroid_y_mm", "centroid_z_mm",
    "rotation_vector_x_deg", "rotation_vector_y_deg", "rotation_vector_z_deg",
    "quaternion_w", "quaternion_x", "quaternion_y", "quaternion_z",
    *INTERVALS, "doubts",
)  # fmt: skip


def write_poses(track: Track, path: Path) -> None:
    """Write the table as CSV; what is not known is empty."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for frame in track.frames:
            writer.writerows(_rows(track, frame))


def _rows(track: Track, frame: TrackedFrame) -> Iterator[list[str]]:
    """One row for each structure."""
    time = frame.frame / track.frames_per_second
    for k, name in enumerate(track.names):
        lost = frame.sources[k] == "none"
        yield [
            str(frame.frame),
            f"{time:.6f}",
            one_line(name),
            frame.sources[k],
            "yes" if frame.doubts[k] else "no",
            "yes" if lost else "no",
            *_numbers([frame.residuals[k]], 4),
            *_pose(track, frame, k),
            *_numbers(intervals(track, frame, k), 3),
            one_line("; ".join(frame.doubts[k])),
        ]


def _pose(track: Track, frame: TrackedFrame, k: int) -> list[str]:
    """Where the centroid is in the rig's world, and how the bone is turned from the CT to the frame."""
    if not np.isfinite(frame.poses[k]).all():
        return [""] * 10
    motion = rigid_inverse(frame.poses[k])
    centroid = motion[:3, :3] @ track.centroids[k] + motion[:3, 3]
    rotation = Rotation.from_matrix(motion[:3, :3])
    x, y, z, w = rotation.as_quat(canonical=True)
    return [
        *_numbers(centroid, 4),
        *_numbers(np.degrees(rotation.as_rotvec()), 5),
        *_numbers([w, x, y, z], 9),
    ]


def intervals(track: Track, frame: TrackedFrame, k: int) -> list[float]:
    """Numbers of INTERVALS of a structure, NaN where they are not known."""
    from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty

    pose, covariance = frame.poses[k], frame.covariances[k]
    if not (np.isfinite(pose).all() and np.isfinite(covariance).all() and track.cameras):
        return [np.nan] * len(INTERVALS)
    stated = PoseUncertainty(covariance).to_dict(list(track.cameras.values()), pose, track.centroids[k])
    return [
        stated["along_mm"],
        *stated["across_mm"],
        stated["rotation_about_view_deg"],
        *stated["rotation_across_deg"],
    ]


def _numbers(values: np.ndarray | list[float], digits: int) -> list[str]:
    """Numbers as texts, without a minus before zero; those that are not finite are empty."""
    return [f"{round(float(each), digits) + 0.0:.{digits}f}" if np.isfinite(each) else "" for each in values]
