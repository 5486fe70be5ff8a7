"""Exact Euclidean distances to one structure: at every voxel, or only at the nodes of a coarser parallel grid.

Distances are signed: 0 at voxels on the structure's border, negative inside, positive outside, in mm between
voxel centres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def distance_at_voxels(mask: np.ndarray, spacing: np.ndarray, pad: np.ndarray) -> np.ndarray:
    """Signed distance at every voxel and up to pad voxels beyond.

    C. Maurer et al., "A linear time algorithm for computing exact Euclidean distance transforms", TPAMI 2003, as
    in ITK. mask: (k, j, i) bool, not empty; spacing: (3,) mm along (i, j, k); pad: (3,) voxels along (i, j, k).
    Returns (k + 2 pad_k, j + 2 pad_j, i + 2 pad_i) float32 mm.
    """
    import SimpleITK as sitk

    image = sitk.GetImageFromArray(np.pad(mask.view(np.uint8), [(int(p), int(p)) for p in pad[::-1]]))
    image.SetSpacing(spacing.tolist())
    return sitk.GetArrayFromImage(
        sitk.SignedMaurerDistanceMap(
            image, insideIsPositive=False, squaredDistance=False, useImageSpacing=True
        )
    )


def distance_at_nodes(
    mask: np.ndarray, box: tuple[slice, ...], spacing: np.ndarray, nodes: Sequence[np.ndarray]
) -> np.ndarray:
    """Signed distance at the nodes of a grid whose axes are parallel to the voxels'.

    Outside, the squared distance is separable: min over k of (z - z_k)^2 + min over j of (y - y_j)^2 + min over i
    of (x - x_i)^2 (P. Felzenszwalb and D. Huttenlocher, Theory of Computing 2012), where only voxels inside the
    structure's box and only the nodes need to be visited. Inside, the distance at the voxels is interpolated.

    Args:
        mask: (k, j, i) bool, the structure's voxels inside its box.
        box: slices (k, j, i) of that box among all voxels.
        spacing: (3,) mm along (i, j, k).
        nodes: positions of the nodes along i, j and k in voxels, three arrays.

    Returns:
        (k, j, i) float32 mm at the nodes.

    """
    low = np.array([s.start for s in box[::-1]])
    places = [(np.asarray(nodes[n]) - low[n]) * spacing[n] for n in range(3)]
    squared = _along_rows(mask, spacing[0], places[0])
    squared = _lower_envelope(squared, spacing[1], places[1])
    squared = _lower_envelope(squared.transpose(1, 0, 2), spacing[2], places[2]).transpose(1, 0, 2)
    distance = np.sqrt(squared)
    _interpolate_inside(distance, mask, spacing, places)
    return distance


def _along_rows(inside: np.ndarray, step: float, places: np.ndarray) -> np.ndarray:
    """Squared distance (k, j, n) along each row (k, j) to its nearest voxel; infinite in empty rows."""
    count = inside.shape[2]
    index = np.arange(count, dtype=np.float32)
    before = np.maximum.accumulate(np.where(inside, index, -np.inf), axis=2)
    after = np.minimum.accumulate(np.where(inside, index, np.inf)[:, :, ::-1], axis=2)[:, :, ::-1]
    position = places / step
    low = np.floor(position).astype(int)
    left = np.where(low >= 0, before[:, :, np.clip(low, 0, count - 1)], -np.inf)
    right = np.where(low < count - 1, after[:, :, np.clip(low + 1, 0, count - 1)], np.inf)
    nearest = np.minimum(position - left, right - position) * step
    return np.square(nearest).astype(np.float32)


def _lower_envelope(squared: np.ndarray, step: float, places: np.ndarray) -> np.ndarray:
    """Minimum over the middle axis of squared (a, m, n) plus the squared distance to places (p,): (a, p, n)."""
    count = squared.shape[1]
    cost = np.square(places[:, None] - np.arange(count) * step).astype(np.float32)
    out = np.full((squared.shape[0], len(places), squared.shape[2]), np.inf, dtype=np.float32)
    for layer, result in zip(squared, out, strict=True):
        for m in np.flatnonzero(np.isfinite(layer).any(axis=1)):
            np.minimum(result, cost[:, m, None] + layer[m], out=result)
    return out


def _interpolate_inside(
    distance: np.ndarray, inside: np.ndarray, spacing: np.ndarray, places: Sequence[np.ndarray]
) -> None:
    """Replace the distance at nodes within a voxel of the structure by the interpolated signed one, in place."""
    from scipy.ndimage import map_coordinates

    signed = distance_at_voxels(inside, spacing, np.full(3, 2))
    near = np.nonzero(distance < spacing.max())
    index = [places[2 - axis][near[axis]] / spacing[2 - axis] + 2 for axis in range(3)]
    distance[near] = map_coordinates(signed, index, order=1, mode="nearest")
