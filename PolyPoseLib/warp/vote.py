"""Labels between voxels: at every point the label, background included, of largest trilinear weight."""

from __future__ import annotations

from typing import Any

import numpy as np

_TIE = 1e-9
"""Shares that differ by less are equal."""

_CORNERS = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])
_VOXELS_PER_SLAB = 1 << 20


class LabelVote:
    """A label map that can be evaluated at any point.

    Equal to interpolating the mask of every label linearly and taking the largest (of equal ones the smallest
    label), but its cost does not depend on the number of labels: only cells whose eight corners differ vote.

    Parameters
    ----------
    labels : (k, j, i) array of integers
        0 is background.

    """

    def __init__(self, labels: np.ndarray) -> None:
        """Find the cells with more than one label."""
        self.labels = np.ascontiguousarray(labels)
        self._mixed = _mixed_cells(self.labels).ravel()
        self._size = np.array(labels.shape[::-1])
        self._stride = np.array([1, self._size[0], self._size[0] * self._size[1]])

    def __call__(self, index: np.ndarray) -> np.ndarray:
        """Labels (N,) at continuous indices (3, N) in the order i, j, k.

        Beyond the outermost voxels' centres the border's label holds for half a voxel, then 0.
        """
        flat = self.labels.ravel()
        inside = np.ones(index.shape[1], dtype=bool)
        start = np.zeros(index.shape[1], dtype=np.int64)
        for axis, size in enumerate(self._size):
            inside &= (index[axis] > -0.5) & (index[axis] < size - 0.5)
            low = np.clip(index[axis], 0, max(size - 2, 0)).astype(np.int64)
            low *= self._stride[axis]
            start += low
        out = flat[start]
        out[~inside] = 0
        voters = np.flatnonzero(inside & self._mixed[start])
        out[voters] = self._count(flat, start[voters], index[:, voters])
        return out

    def on_grid(self, matrix: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """Labels (k, j, i) at the nodes of a grid; matrix: (4, 4), its index (i, j, k) to the labels' index."""
        out = np.empty(shape, dtype=self.labels.dtype)
        thickness = max(_VOXELS_PER_SLAB // (shape[1] * shape[2]), 1)
        for start in range(0, shape[0], thickness):
            stop = min(start + thickness, shape[0])
            moved = matrix.copy()
            moved[:3, 3] += matrix[:3, 2] * start
            part = (stop - start, *shape[1:])
            out[start:stop] = self(grid_index(moved, part).reshape(3, -1)).reshape(part)
        return out

    def _count(self, flat: np.ndarray, start: np.ndarray, index: np.ndarray) -> np.ndarray:
        """Winning labels (N,) of cells that start at flat indices (N,), at continuous indices (3, N)."""
        last = (self._size - 1)[:, None]
        low = np.stack(np.unravel_index(start, self.labels.shape)[::-1])
        fraction = np.clip(index, 0, last) - low
        step = (np.minimum(low + 1, last) - low) * self._stride[:, None]
        found = np.stack([flat[start + bits @ step] for bits in _CORNERS])
        weight = np.stack(
            [np.prod(np.where(bits[:, None], fraction, 1 - fraction), axis=0) for bits in _CORNERS]
        )
        return winner(found, weight)


def winner(found: Any, share: Any) -> Any:
    """Labels (N,) of the largest sums of shares, of equal ones the smallest.

    found, share: (8, N) labels at the corners of cells and their weights, numpy arrays or torch tensors.
    """
    best, label = share[0] * 0 - 1, found[0] * 1
    for candidate in found:
        score = ((found == candidate) * share).sum(0)
        tied = abs(score - best) < _TIE
        better = (score > best + _TIE) | (tied & (candidate < label))
        best[better], label[better] = score[better], candidate[better]
    return label


def grid_index(matrix: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Where the nodes (k, j, i) of a grid lie: (3, k, j, i) of matrix (4, 4) applied to (i, j, k, 1)."""
    k, j, i = np.ogrid[: shape[0], : shape[1], : shape[2]]
    return np.stack([row[0] * i + row[1] * j + (row[2] * k + row[3]) for row in matrix[:3]])


def _mixed_cells(labels: np.ndarray) -> np.ndarray:
    """Where the cell of 2 x 2 x 2 voxels that starts at a voxel (k, j, i) holds more than one label."""
    mixed = np.zeros(labels.shape, dtype=bool)
    for axis in range(3):
        here, there = [slice(None)] * 3, [slice(None)] * 3
        here[axis], there[axis] = slice(0, -1), slice(1, None)
        differ = np.zeros(labels.shape, dtype=bool)
        differ[tuple(here)] = labels[tuple(here)] != labels[tuple(there)]
        for other in range(3):
            if other != axis:
                first, second = [slice(None)] * 3, [slice(None)] * 3
                first[other], second[other] = slice(0, -1), slice(1, None)
                differ[tuple(first)] |= differ[tuple(second)].copy()
        mixed |= differ
    return mixed
