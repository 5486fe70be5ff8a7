"""Points carried from the CT to the patient as X-rayed, and back.

A point inside a bone moves by that bone's own rigid motion, exactly. All others move by the dense transform: its
displacements from the X-rays to the CT, and the inverse of them, found at every point, from the CT to the X-rays.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.carrying.uncertainty import PointUncertainty
from PolyPoseLib.data.carried import (
    DISPLACEMENT_FIELD,
    CarriedPoints,
    Frame,
    require_frame,
    require_points,
)
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.warp.inverse import invert_at

TOLERANCE_MM = 1e-3
"""The inverse is exact to this wherever the transform has one."""


@dataclass(frozen=True)
class _Moved:
    """points: (N, 3) carried; bone: (N,) index of the structure that moved each, or -1; residual: (N,) mm, by how
    much the transform misses the given point where it has no inverse.
    """

    points: np.ndarray
    bone: np.ndarray
    residual: np.ndarray


class PointCarrier:
    """Carries points by one result; what is prepared for it once serves any number of points.

    Parameters
    ----------
    result : Result
        With its label map of structures.

    Raises
    ------
    InputError
        The result has no label map of structures, as those of earlier versions.

    """

    def __init__(self, result: Result) -> None:
        if result.structure_labels is None:
            raise InputError(
                "The result holds no structures.nii.gz, which says where its bones are; it was written by an earlier "
                "version: register again."
            )
        self._labels: Volume = result.structure_labels
        self._field: DisplacementField = result.transform
        self._names = tuple(result.structures)
        self._poses = np.stack([each.fixed_to_moving for each in result.structures.values()])
        self._uncertainty = PointUncertainty(result.structures, self._labels, result.soft_tissue_deviation_mm)

    def __call__(self, points: np.ndarray, to: str = "xray") -> CarriedPoints:
        """Carry points (N, 3) LPS mm to "xray" or "ct"; raises InputError for other shapes, numbers and names."""
        frame, points = require_frame(to), require_points(points)
        moved = self._to_xray(points) if frame == "xray" else self._to_ct(points)
        moving, fixed = (points, moved.points) if frame == "xray" else (moved.points, points)
        covariances = self._uncertainty.covariances(moving, moved.bone, frame)
        covariances += moved.residual[:, None, None] ** 2 * np.eye(3)
        names = (*self._names, DISPLACEMENT_FIELD)
        return CarriedPoints(
            moved.points, covariances, tuple(names[k] for k in moved.bone), in_grid(self._field, fixed)
        )

    def bones_at(self, points: np.ndarray, to: str) -> list[str]:
        """Name of the bone that moves each point (N, 3) of the frame from which it is carried, "" for none."""
        moved = self._to_xray(points) if require_frame(to) == "xray" else self._to_ct(points)
        return [self._names[k] if k >= 0 else "" for k in moved.bone]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the bones."""
        return self._names

    def near_bones(self, points: np.ndarray, to: str, steps: np.ndarray) -> Iterator[np.ndarray]:
        """For each bone, (N,) whether points (N, 3) of the frame from which they are carried lie in it or near it.

        steps: (S, 3) whole numbers of voxels (i, j, k) to look from a point's own voxel; with 0, 0, 0 for itself.
        """
        frame = require_frame(to)
        for n, pose in enumerate(self._poses):
            moving = points if frame == "xray" else _apply(pose, points)
            own = np.rint(self._labels.to_index(moving))
            found = np.zeros(len(points), dtype=bool)
            for step in steps:
                found |= self._labels.voxels_at(own + step, 0) == n + 1
            yield found

    def rigidly(
        self, carried: CarriedPoints, points: np.ndarray, which: Sequence[int], name: str, to: str
    ) -> CarriedPoints:
        """Carried points of which some are moved by one bone, whether they lie in it or not.

        carried: of ``points`` (N, 3); which: of them; name: the bone's.
        """
        frame, index, k = require_frame(to), list(which), self._names.index(name)
        pose = self._poses[k]
        out, covariances = carried.points.copy(), carried.covariances.copy()
        out[index] = _apply(rigid_inverse(pose) if frame == "xray" else pose, points[index])
        moving = points[index] if frame == "xray" else out[index]
        covariances[index] = self._uncertainty.covariances(moving, np.full(len(index), k), frame)
        those = set(index)
        moved_by = tuple(name if n in those else each for n, each in enumerate(carried.moved_by))
        return CarriedPoints(out, covariances, moved_by, carried.inside)

    def move(self, points: np.ndarray, to: Frame) -> np.ndarray:
        """Points (N, 3) carried, without their uncertainty."""
        return (self._to_xray(points) if to == "xray" else self._to_ct(points)).points

    def _to_xray(self, points: np.ndarray) -> _Moved:
        bone = self._bone_at(points)
        out, residual = points.copy(), np.zeros(len(points))
        for k in np.unique(bone[bone >= 0]):
            out[bone == k] = _apply(rigid_inverse(self._poses[k]), points[bone == k])
        soft = np.flatnonzero(bone < 0)
        shift, missed = invert_at(self._field, points[soft], TOLERANCE_MM)
        out[soft] += shift
        residual[soft] = np.where(missed > TOLERANCE_MM, missed, 0)
        return _Moved(out, bone, residual)

    def _to_ct(self, points: np.ndarray) -> _Moved:
        """Where the motions bring several bones to one place, the one whose motion is nearest to the field's counts."""
        out = self._field(points)
        smooth, nearest = out.copy(), np.full(len(points), np.inf)
        bone = np.full(len(points), -1)
        for k, pose in enumerate(self._poses):
            moving = _apply(pose, points)
            distance = np.linalg.norm(moving - smooth, axis=1)
            better = (self._bone_at(moving) == k) & (distance < nearest)
            out[better], bone[better], nearest[better] = moving[better], k, distance[better]
        return _Moved(out, bone, np.zeros(len(points)))

    def _bone_at(self, moving: np.ndarray) -> np.ndarray:
        """(N,) index of the structure in whose voxel each point (N, 3) of the CT lies, -1 in none."""
        return self._labels.voxels_at(self._labels.to_index(moving), 0).astype(np.int64) - 1


def in_grid(field: DisplacementField, points: np.ndarray) -> np.ndarray:
    """(N,) whether points (N, 3), LPS mm, lie between the nodes of a field."""
    inverse = np.linalg.inv(field.affine)
    index = points @ inverse[:3, :3].T + inverse[:3, 3]
    last = np.array(field.shape[::-1]) - 1
    return ((index >= -1e-6) & (index <= last + 1e-6)).all(axis=1)


def _apply(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ pose[:3, :3].T + pose[:3, 3]
