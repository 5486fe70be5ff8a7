"""How far carried points may be off: the bones' covariances through the warp, and the soft tissue's own error.

A pose may be off by a rotation w and a shift t about its bone's centroid c in the CT. A point x of that bone is then
off by w x (x - c) + t. Between bones, a point follows the mean of their motions: each counts by its weight, and its
rotation by the share of it that tissue at that distance takes (see PolyPoseLib.warp.polyrigid).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from PolyPoseLib.carrying.distances import StructureDistances
from PolyPoseLib.carrying.soft_tissue_error import own_motion_variance, soft_tissue_variance
from PolyPoseLib.data.carried import Frame
from PolyPoseLib.data.result import StructureResult
from PolyPoseLib.data.volume import Volume

REACH_MM = 40.0
"""Distance at which tissue takes half of a bone's rotation."""

LEAST_MM = 0.01
"""Least standard deviation: the anchor is exact by definition, but numbers in files are rounded."""

POINTS_AT_ONCE = 1 << 17
"""Points whose covariances are computed at once."""


class PointUncertainty:
    """Covariances of points carried by a result's motions.

    Parameters
    ----------
    structures : Mapping[str, StructureResult]
        In the order of the labels; one without "covariance" is exact where it did not move and unknown otherwise.
    labels : Volume
        Of the structures in the CT, 1 to K.
    soft_tissue_deviation_mm : (3,) array, optional
        How far the X-rays let soft tissue far from bones move beside them, as :class:`Result` states it.

    """

    def __init__(
        self,
        structures: Mapping[str, StructureResult],
        labels: Volume,
        soft_tissue_deviation_mm: np.ndarray | None = None,
    ) -> None:
        each = list(structures.values())
        self._poses = np.stack([one.fixed_to_moving for one in each])
        self._covariances = np.stack([_covariance(one) for one in each])
        given = np.zeros(3) if soft_tissue_deviation_mm is None else soft_tissue_deviation_mm
        self._own_deviations = np.asarray(given, dtype=np.float64)
        self._distances = StructureDistances(labels, len(each))
        self._centroids = np.stack(
            [
                self._distances.centroid(k) if one.centroid is None else one.centroid
                for k, one in enumerate(each)
            ]
        )

    def covariances(self, moving: np.ndarray, bone: np.ndarray, to: Frame) -> np.ndarray:
        """Covariances (N, 3, 3) mm^2 in the frame to which points are carried.

        Parameters
        ----------
        moving : (N, 3) array
            The points in the CT, LPS mm.
        bone : (N,) array of int
            Index of the structure that moved each, -1 for the displacement field.
        to : {"xray", "ct"}
            Where they were carried.

        """
        out = np.empty((len(moving), 3, 3))
        for start in range(0, len(moving), POINTS_AT_ONCE):
            part = slice(start, start + POINTS_AT_ONCE)
            out[part] = self._part(moving[part], bone[part], to)
        return out + LEAST_MM**2 * np.eye(3)

    def _part(self, moving: np.ndarray, bone: np.ndarray, to: Frame) -> np.ndarray:
        out = np.empty((len(moving), 3, 3))
        for k in np.unique(bone[bone >= 0]):
            mine = bone == k
            ones = np.ones(np.count_nonzero(mine))
            in_ct = self._carried(k, moving[mine], ones, ones)
            turn = self._poses[k, :3, :3] if to == "xray" else np.eye(3)
            out[mine] = turn.T @ in_ct @ turn
        soft = np.flatnonzero(bone < 0)
        if len(soft):
            out[soft] = self._between_bones(moving[soft], to)
        return out

    def _between_bones(self, moving: np.ndarray, to: Frame) -> np.ndarray:
        """Of points (N, 3) of soft tissue; bones' errors count as independent of each other."""
        distance = self._distances(moving)
        weight = 1 / (1 + distance**2) * self._distances.share[:, None]
        weight /= weight.sum(axis=0)
        rotating = weight / (1 + (distance / REACH_MM) ** 2)
        total = np.zeros((len(moving), 3, 3))
        for k in range(len(self._poses)):
            in_ct = self._carried(k, moving, weight[k], rotating[k])
            turn = self._poses[k, :3, :3] if to == "xray" else np.eye(3)
            counts = weight[k] > 1e-4  # an unknown bone far away does not make everything unknown
            total[counts] += (turn.T @ in_ct @ turn)[counts]
        moved = np.stack([_displacement(pose, moving) for pose in self._poses])
        variance = soft_tissue_variance(distance, weight, moved)
        own = own_motion_variance(distance, self._own_deviations)
        return total + (variance[:, None] + own)[:, :, None] * np.eye(3)

    def _carried(self, k: int, moving: np.ndarray, weight: np.ndarray, rotating: np.ndarray) -> np.ndarray:
        """(N, 3, 3) covariance, in the CT, that a structure's error gives to points (N, 3) of these weights (N,)."""
        jacobian = np.empty((len(moving), 3, 6))
        jacobian[:, :, :3] = -rotating[:, None, None] * _cross_matrices(moving - self._centroids[k])
        jacobian[:, :, 3:] = weight[:, None, None] * np.eye(3)
        return jacobian @ self._covariances[k] @ jacobian.transpose(0, 2, 1)


def _covariance(structure: StructureResult) -> np.ndarray:
    """(6, 6) of a structure's pose: zero where it defines the frame, NaN where it moved but states none."""
    stated = None if structure.uncertainty is None else structure.uncertainty.get("covariance")
    if stated is not None:
        covariance = np.array(stated, dtype=np.float64)
        return (covariance + covariance.T) / 2
    still = np.array_equal(structure.fixed_to_moving, np.eye(4))
    return np.zeros((6, 6)) if still else np.full((6, 6), np.nan)


def _cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """(N, 3, 3) matrices M with M a = v x a, of vectors v (N, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)


def _displacement(pose: np.ndarray, moving: np.ndarray) -> np.ndarray:
    """(N, 3) mm from the X-rays to the CT that a bone's motion would give to points (N, 3) of the CT."""
    back = (moving - pose[:3, 3]) @ pose[:3, :3]
    return moving - back
