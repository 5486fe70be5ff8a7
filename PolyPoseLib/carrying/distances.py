"""Distances of points to every structure, coarse but quick, because they only weigh motions."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.grid import bounding_box

COARSE_MM = 3.0
"""Voxels of the label map are thinned to about this distance."""

MOST_SURFACE_POINTS = 20000
"""Of one structure."""

MANY = 20000
"""More points than this share distances with those of the same cell."""

CELL_MM = 2.0
"""Side of these cells."""


class StructureDistances:
    """Distances to K structures in the CT.

    Parameters
    ----------
    labels : Volume
        Structures 1 to K, each with a voxel or more.
    count : int
        K.

    """

    def __init__(self, labels: Volume, count: int) -> None:
        from scipy.spatial import KDTree

        steps = [max(1, int(COARSE_MM / spacing)) for spacing in labels.spacing]
        i, j, k = steps
        thinned = np.ascontiguousarray(labels.voxels[::k, ::j, ::i])
        self._centroids, self._trees, volumes = [], [], []
        for n in range(1, count + 1):
            index = _surface(thinned == n) * steps
            voxels = np.count_nonzero(thinned == n)
            if not len(index):  # smaller than the steps
                index = np.argwhere(labels.voxels == n)[:, ::-1]
                voxels = len(index) / (i * j * k)
            points = labels.to_world(index[:: 1 + len(index) // MOST_SURFACE_POINTS])
            self._centroids.append(points.mean(axis=0) if len(points) else labels.bounds_center)
            self._trees.append(KDTree(points) if len(points) else None)
            volumes.append(max(voxels, 1e-3))
        self.share = np.array(volumes) / sum(volumes)

    def centroid(self, n: int) -> np.ndarray:
        """(3,) about the centroid of the nth structure, LPS mm."""
        return self._centroids[n]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(K, N) mm of points (N, 3) of the CT; infinite for a structure without voxels."""
        if len(points) > MANY:  # vertices of a mesh lie close together
            cells = np.rint(points / CELL_MM).astype(np.int64)
            low = cells.min(axis=0)
            _, first, which = np.unique(
                np.ravel_multi_index((cells - low).T, (cells.max(axis=0) - low + 1).tolist()),
                return_index=True,
                return_inverse=True,
            )
            return self._each(cells[first] * CELL_MM)[:, which]
        return self._each(points)

    def _each(self, points: np.ndarray) -> np.ndarray:
        return np.stack(
            [np.full(len(points), np.inf) if tree is None else tree.query(points)[0] for tree in self._trees]
        )


def _surface(mask: np.ndarray) -> np.ndarray:
    """(N, 3) indices (i, j, k) of the voxels of a mask that touch others."""
    from scipy.ndimage import binary_erosion

    box = bounding_box(mask)
    if box is None:
        return np.empty((0, 3), int)
    within = mask[box]
    border = within & ~binary_erosion(within)
    return (np.argwhere(border) + [side.start for side in box])[:, ::-1]
