"""Where the nodes of grids are, and displacement fields interpolated to the nodes of other grids."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField, trilinear
from PolyPoseLib.warp.vote import grid_index

POINTS_PER_CHUNK = 1 << 17
"""Points that are handled at once."""


def flat_points(affine: np.ndarray, shape: tuple[int, int, int], start: int, stop: int) -> np.ndarray:
    """LPS mm (N, 3) of the nodes start..stop of a grid in the order in which numpy lays out (k, j, i)."""
    rows, within = shape[1] * shape[2], affine.copy()
    first, last = start // rows, -(-stop // rows)
    within[:3, 3] += affine[:3, 2] * first
    points = grid_index(within, (last - first, *shape[1:])).reshape(3, -1).T
    return points[start - first * rows : stop - first * rows]


def field_on(field: DisplacementField, affine: np.ndarray, shape: tuple[int, int, int]) -> DisplacementField:
    """A field interpolated to the nodes of another grid, as its ``sample`` does but many times faster.

    Parameters
    ----------
    field : DisplacementField
        Fixed to moving.
    affine : (4, 4) array
        Index (i, j, k) of the other grid to fixed LPS mm.
    shape : tuple[int, int, int]
        Its nodes (k, j, i).

    Returns
    -------
    DisplacementField
        Trilinear between the field's nodes; beyond them the value of the nearest point.

    """
    return DisplacementField(_upsample(field, affine, shape), affine)


def _upsample(field: DisplacementField, affine: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """Displacements (k, j, i, 3) float32 on another grid; the value of the nearest point beyond the field."""
    to_index = np.linalg.inv(field.affine) @ affine
    scale = np.diag(to_index[:3, :3])
    if np.abs(to_index[:3, :3] - np.diag(scale)).max() > 1e-9:
        count = int(np.prod(shape))
        out = np.empty((count, 3), dtype=np.float32)
        for start in range(0, count, POINTS_PER_CHUNK):
            index = flat_points(to_index, shape, start, min(start + POINTS_PER_CHUNK, count))
            out[start : start + len(index)] = trilinear(field.vectors, index)
        return out.reshape(*shape, 3)
    # Parallel axes: trilinear interpolation is one linear interpolation after another along each axis.
    vectors = field.vectors
    for axis in range(3):
        column = 2 - axis
        place = scale[column] * np.arange(shape[axis]) + to_index[column, 3]
        vectors = _along(vectors, place, axis)
    return np.ascontiguousarray(vectors)


def _along(vectors: np.ndarray, place: np.ndarray, axis: int) -> np.ndarray:
    """Linear interpolation along one axis at continuous indices place (n,), clamped to the ends."""
    last = vectors.shape[axis] - 1
    place = np.clip(place, 0, last)
    low = np.minimum(place.astype(np.int64), max(last - 1, 0))
    shape = [1] * vectors.ndim
    shape[axis] = len(place)
    fraction = (place - low).astype(np.float32).reshape(shape)
    below = vectors.take(low, axis)
    above = vectors.take(np.minimum(low + 1, last), axis)
    above -= below
    above *= fraction
    above += below
    return above
