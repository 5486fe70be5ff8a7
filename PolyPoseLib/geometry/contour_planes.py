"""Which grid closed planar contours are filled on, and which of its slices each stands for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

FLAT = 0.5
"""Largest height of a contour, in voxels across its plane."""

_SAME_PLANE = 0.05
"""Voxels; contours no farther apart are in one plane."""

_TIE = 2e-3
"""Voxels by which a slice half way between two contours is given to the upper one, whatever rounding says."""


def plane_axis(contours: Sequence[np.ndarray], affine: np.ndarray) -> int | None:
    """The axis (0, 1, 2 for i, j, k) across which all contours are flat; None where they lie oblique in the grid.

    Parameters
    ----------
    contours
        Each (N, 3), LPS mm.
    affine
        (4, 4), index (i, j, k, 1) to LPS mm.

    """
    inverse = np.linalg.inv(affine[:3, :3])
    heights = np.max([np.ptp(each @ inverse.T, axis=0) for each in contours], axis=0)
    axis = int(np.argmin(heights))
    return axis if heights[axis] <= FLAT else None


def own_affine(
    contours: Sequence[np.ndarray], spacing_mm: float
) -> tuple[np.ndarray, tuple[int, int, int]] | None:
    """A grid along parallel contours, a slice a plane; None where they are not flat and parallel.

    Parameters
    ----------
    contours
        Each (N, 3), LPS mm.
    spacing_mm
        Of pixels within the planes.

    Returns
    -------
    numpy.ndarray
        (4, 4), index (i, j, k, 1) to LPS mm, k across the planes.
    tuple[int, int, int]
        Voxels along (k, j, i).

    """
    normals = [_area_vector(each) for each in contours]
    areas = np.linalg.norm(normals, axis=1)
    largest = int(np.argmax(areas))
    if areas[largest] <= 0:
        return None
    normal = normals[largest] / areas[largest]
    normal = normal if normal[np.argmax(np.abs(normal))] > 0 else -normal
    across = np.eye(3)[0] if abs(normal[0]) < 0.9 else np.eye(3)[1]
    across = across - (across @ normal) * normal
    across /= np.linalg.norm(across)
    axes = np.stack([across, np.cross(normal, across), normal])
    placed = [each @ axes.T for each in contours]
    gaps = np.diff(planes_of([each[:, 2].mean() for each in placed], _SAME_PLANE)[0])
    step = float(np.median(gaps)) if gaps.size else spacing_mm
    if max(float(np.ptp(each[:, 2])) for each in placed) > FLAT * step:
        return None
    points = np.concatenate(placed)
    points[:, 2] = np.concatenate([np.full(len(each), each[:, 2].mean()) for each in placed])
    spacing = np.array([spacing_mm, spacing_mm, step])
    size = np.rint(np.ceil(np.ptp(points, axis=0) / spacing - 1e-6)).astype(int) + 1
    affine = np.eye(4)
    affine[:3, :3] = axes.T * spacing
    affine[:3, 3] = axes.T @ points.min(axis=0)
    return affine, (int(size[2]), int(size[1]), int(size[0]))


def planes_of(depths: Sequence[float], apart: float = _SAME_PLANE) -> tuple[np.ndarray, np.ndarray]:
    """Depths that differ, ascending (P,), and which of them each depth is (N,)."""
    order = np.argsort(depths, kind="stable")
    ascending = np.asarray(depths, dtype=np.float64)[order]
    number = np.concatenate([[0], np.cumsum(np.diff(ascending) > apart)])
    which = np.empty(len(ascending), np.int64)
    which[order] = number
    return ascending[np.concatenate([[True], np.diff(number) > 0])], which


def usual_distances(depths: Sequence[Sequence[float]]) -> list[float]:
    """Voxels between the contours of each structure; those of few planes are like the others, 1 without any.

    A structure in two pieces, of one plane each, would else fill all that is between them.
    """
    own = [np.diff(planes_of(each)[0]) if len(each) else np.empty(0) for each in depths]
    usual = [
        float(np.median(each)) if len(each) > 1 and np.median(each) < 1.5 * each.min() else None
        for each in own
    ]
    known = [each for each in usual if each is not None]
    common = float(np.median(known)) if known else 1.0
    return [common if each is None else each for each in usual]


def slices_of_planes(planes: np.ndarray, distance: float, count: int) -> list[np.ndarray]:
    """The slices that each plane stands for: its slab, half way to its neighbours.

    Parameters
    ----------
    planes
        (P,) ascending, in slices.
    distance
        Usual distance of planes, in slices; those farther apart leave a gap.
    count
        Slices of the grid.

    """
    half = max(0.5, distance / 2)
    low = max(int(np.floor(planes[0] - half)), 0)
    slices = np.arange(low, min(int(np.ceil(planes[-1] + half)) + 1, count))
    places = slices + _TIE
    after = np.clip(np.searchsorted(planes, places), 1, max(len(planes) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(planes) - 1)
    nearest = np.where(np.abs(planes[after] - places) <= np.abs(planes[before] - places), after, before)
    held = np.abs(planes[nearest] - places) <= half
    return [slices[held & (nearest == plane)] for plane in range(len(planes))]


def _area_vector(points: np.ndarray) -> np.ndarray:
    """Normal of a polygon (N, 3), as long as its area."""
    offset = points - points[0]
    return np.cross(offset, np.roll(offset, -1, axis=0)).sum(axis=0) / 2
