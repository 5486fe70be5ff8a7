"""The rigid motion of one bone between two scans of a patient, from its labels in both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box, set_grid
from PolyPoseLib.geometry.rigid import rigid_inverse, rotation_angle_deg, rotation_matrix

_GRID_MM = 2.0
_MARGIN_MM = 16.0
_FARTHEST_MM = 12.0
"""Signed distances are cut there: what lies farther from a surface says nothing about where it is."""

_BLUR_VOXELS = 1.2
"""Of the coarser scan's largest spacing. A blurred mask tells its surface to a small part of a voxel; whole voxels lie
up to half of one off, the same way over large parts of it."""

_FEWEST_VOXELS = 64
_COARSE_POINTS = 200
_FINE_POINTS = 4000
"""Of each surface, while starts are compared and in the end."""

_STARTS_DEG = 25.0
_RADIUS_MM = 50.0
"""Of a turn about the centroid: by it, turns and shifts have one unit."""

_STEP_MM = 0.1
"""Of the differences that stand for derivatives of interpolated distances."""

_SOFT_MM = 1.0
"""Beyond it, labels that differ pull with constant force."""


@dataclass(frozen=True, eq=False)
class AnchorAlignment:
    """How a bone lies in two scans.

    Attributes
    ----------
    to_first
        (4, 4) from the second scan's world to the first's, LPS mm.
    residual_mm
        Mean distance of the aligned surfaces: what no rigid motion explains (the labels' own errors).
    moved_mm, moved_deg
        How far the bone's centroid is carried, and by what angle: what the scans' own worlds disagree by.

    """

    to_first: np.ndarray
    residual_mm: float
    moved_mm: float
    moved_deg: float


def align_anchor(first: Volume, second: Volume) -> AnchorAlignment:
    """Align one bone's mask in a second scan to its mask in a first one.

    Points of both surfaces should have the same signed distance in both scans. scipy's least squares with a soft loss
    finds the motion, from the centroids upon each other and turns of 25 degrees either way about each axis, by
    distances between voxels (SimpleITK's Maurer filter). The best is refined by those that the blurred masks tell.

    Parameters
    ----------
    first, second : Volume
        Not 0 in the bone; each in its own world.

    Raises
    ------
    InputError
        A mask is nearly empty.

    References
    ----------
    S. Lavallee and R. Szeliski, "Recovering the position and orientation of free-form objects from image contours
    using 3D distance maps", IEEE TPAMI 1995.

    """
    for mask in (first, second):
        if np.count_nonzero(mask.voxels) < _FEWEST_VOXELS:
            raise InputError(f"the anchor has fewer than {_FEWEST_VOXELS} voxels in one of the scans.")
    coarse = _Fit(_Surface.of(first), _Surface.of(second), _COARSE_POINTS)
    starts = [np.zeros(6)]
    for axis in range(3):
        for turn in (-_STARTS_DEG, _STARTS_DEG):
            starts.append(np.eye(6)[axis] * np.radians(turn) * _RADIUS_MM)
    best = min((coarse.solve(start, 15) for start in starts), key=lambda found: found[1])[0]
    blur_mm = _BLUR_VOXELS * float(max(first.spacing.max(), second.spacing.max()))
    surfaces = (_Surface.of(first, blur_mm), _Surface.of(second, blur_mm))
    fine = _Fit(*surfaces, _FINE_POINTS)
    parameters, _ = fine.solve(best, 60)
    to_first = fine.motion(parameters)
    centre = surfaces[1].centroid
    return AnchorAlignment(
        to_first,
        float(np.abs(fine.differences(parameters)).mean()),
        float(np.linalg.norm(_moved(to_first, centre) - centre)),
        rotation_angle_deg(to_first[:3, :3]),
    )


@dataclass(frozen=True, eq=False)
class _Surface:
    """A bone in one scan: its signed distances on a grid around it, border voxels (N, 3) in mm, and centroid (3,)."""

    distances: Volume
    points: np.ndarray
    centroid: np.ndarray

    @classmethod
    def of(cls, mask: Volume, blur_mm: float = 0.0) -> _Surface:
        """From a mask, by whole voxels unless it is to be blurred."""
        from scipy.ndimage import binary_erosion

        box = bounding_box(mask.voxels)
        assert box is not None
        whole = np.asarray(mask.voxels[box], dtype=bool)
        corner = np.array([side.start for side in box])
        border = np.argwhere(whole & ~np.asarray(binary_erosion(whole), dtype=bool)) + corner
        centroid = mask.to_world((np.argwhere(whole) + corner).mean(axis=0)[::-1])
        return cls(_distances(whole, corner, mask, blur_mm), mask.to_world(border[:, ::-1]), centroid)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Signed distances (N,) at points (N, 3), cut at both ends."""
        from scipy.ndimage import map_coordinates

        index = self.distances.to_index(points)[:, ::-1].T
        return map_coordinates(self.distances.voxels, index, order=1, mode="nearest")


class _Fit:
    """Two surfaces, and what differs between them under a motion from the second scan to the first."""

    def __init__(self, first: _Surface, second: _Surface, most: int) -> None:
        self._first, self._second = first, second
        self._points = [each.points[:: -(-len(each.points) // most)] for each in (first, second)]
        # A border voxel's centre lies inside by some part of a voxel: each has a distance of its own.
        self._own = [each.at(points) for each, points in zip((first, second), self._points, strict=True)]

    def motion(self, parameters: np.ndarray) -> np.ndarray:
        """(4, 4) from the second scan's world to the first's: a turn about the centroid, which is then shifted."""
        motion = np.eye(4)
        motion[:3, :3] = rotation_matrix(parameters[:3] / _RADIUS_MM)
        motion[:3, 3] = self._first.centroid + parameters[3:] - motion[:3, :3] @ self._second.centroid
        return motion

    def differences(self, parameters: np.ndarray) -> np.ndarray:
        """Mm by which the distances of all points differ."""
        motion = self.motion(parameters)
        there = self._second.at(_moved(rigid_inverse(motion), self._points[0])) - self._own[0]
        back = self._first.at(_moved(motion, self._points[1])) - self._own[1]
        return np.concatenate([there, back]).astype(np.float64)

    def solve(self, start: np.ndarray, evaluations: int) -> tuple[np.ndarray, float]:
        """Parameters (6,) of the least differences from a start after so many evaluations, and what they cost."""
        from scipy.optimize import least_squares

        slopes: Any = self._slopes  # scipy's stubs know names of schemes only
        found = least_squares(
            self.differences,
            start,
            self._slopes,
            loss="soft_l1",
            f_scale=_SOFT_MM,
            xtol=1e-5,
            ftol=1e-6,
            max_nfev=evaluations,
        )
        return found.x, float(found.cost)

    def _slopes(self, parameters: np.ndarray) -> np.ndarray:
        """Central differences, (N, 6)."""
        steps = np.eye(6) * _STEP_MM
        return np.stack(
            [
                (self.differences(parameters + d) - self.differences(parameters - d)) / (2 * _STEP_MM)
                for d in steps
            ],
            axis=1,
        )


def _moved(motion: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (..., 3) under a rigid motion (4, 4)."""
    return points @ motion[:3, :3].T + motion[:3, 3]


def _distances(whole: np.ndarray, corner: np.ndarray, mask: Volume, blur_mm: float) -> Volume:
    """Signed distance in mm to the surface of a mask's part, cut at both ends, on a coarser grid around it; float32."""
    import SimpleITK as sitk

    margin = np.ceil(_MARGIN_MM / mask.spacing).astype(int)[::-1]
    affine = mask.affine.copy()
    affine[:3, 3] = mask.to_world((corner - margin)[::-1])
    image = sitk.GetImageFromArray(np.pad(whole.astype(np.uint8), [(n, n) for n in margin]))
    set_grid(image, affine)
    if blur_mm > 0:
        blurred = sitk.SmoothingRecursiveGaussian(sitk.Cast(image, sitk.sitkFloat32), [blur_mm] * 3)
        return Volume(_from_blurred(sitk.GetArrayFromImage(blurred), blur_mm), affine)
    distance = sitk.SignedMaurerDistanceMap(
        image, insideIsPositive=False, squaredDistance=False, useImageSpacing=True
    )
    spacing = np.maximum(np.array(image.GetSpacing()), _GRID_MM)
    size = np.ceil((np.array(image.GetSize()) - 1) * np.array(image.GetSpacing()) / spacing).astype(int) + 1
    distance = sitk.Resample(
        sitk.Cast(distance, sitk.sitkFloat32),
        size.tolist(),
        sitk.Transform(3, sitk.sitkIdentity),
        sitk.sitkLinear,
        image.GetOrigin(),
        spacing.tolist(),
        image.GetDirection(),
        _FARTHEST_MM,
        sitk.sitkFloat32,
    )
    return Volume.from_sitk(sitk.Clamp(distance, sitk.sitkFloat32, -_FARTHEST_MM, _FARTHEST_MM))


def _from_blurred(share: np.ndarray, blur_mm: float) -> np.ndarray:
    """Signed distance in mm to a flat surface that a Gaussian made these shares of, cut at two of its deviations."""
    from scipy.special import ndtri

    return (-blur_mm * ndtri(np.clip(share, 0.0228, 0.9772))).astype(np.float32)
