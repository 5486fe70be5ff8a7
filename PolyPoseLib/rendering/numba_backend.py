"""Rendering by the compiled kernels."""

from __future__ import annotations

import math

import numpy as np

from PolyPoseLib.rendering.backend import IndexField
from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.occupancy import OccupiedBlocks

_MOST_VALUES = 2**31 - 1


class NumbaBackend:
    """Compiled on first use; multi-threaded."""

    name = "numba"

    @property
    def must_compile(self) -> bool:
        """Whether no earlier run has left its loops to this one."""
        from PolyPoseLib.compiled import is_kept
        from PolyPoseLib.rendering import kernels

        return not is_kept(kernels.project)

    def project(
        self, voxels: np.ndarray, rays: IndexRays, moments: bool, occupied: OccupiedBlocks | None = None
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """See :class:`PolyPoseLib.rendering.backend.Backend`."""
        from PolyPoseLib.rendering import kernels

        near, far = _depth_ranges(occupied, np.zeros(3), rays)
        image = np.zeros(rays.shape, np.float32)
        volume, size = flat_voxels(voxels), voxels.shape
        if not moments:
            kernels.project(volume, size, rays, near, far, image)
            return image, None
        sums = np.zeros((*rays.shape, 6), np.float32)
        kernels.project_with_moments(volume, size, rays, near, far, image, sums)
        return image, sums

    def project_warped(
        self, voxels: np.ndarray, field: IndexField, rays: IndexRays, occupied: OccupiedBlocks | None = None
    ) -> np.ndarray:
        """See :class:`PolyPoseLib.rendering.backend.Backend`."""
        from PolyPoseLib.rendering import kernels

        reach = np.abs(field.vectors).reshape(-1, 3).max(axis=0)
        near, far = _depth_ranges(occupied, reach, rays)
        image = np.zeros(rays.shape, np.float32)
        kernels.project_warped(
            flat_voxels(voxels), voxels.shape, flat_voxels(field.vectors), field.vectors.shape[:3],
            field.scale, field.offset, tuple(field.low), tuple(field.high), rays, near, far, image,
        )  # fmt: skip
        return image


def flat_voxels(values: np.ndarray) -> np.ndarray:
    """The values in one row, as the kernels take them.

    Raises ValueError for less than a cell along an axis, or more values than 32-bit indices can count: the kernels do
    not look where they read.
    """
    if min(values.shape[:3]) < 2:
        raise ValueError(f"a grid of shape {values.shape[:3]} has no cell")
    if values.size > _MOST_VALUES:
        raise ValueError(f"a volume of {values.size} values is beyond what the kernels can index")
    return np.require(values, np.float32, ["C", "W"]).reshape(-1)


def _depth_ranges(
    occupied: OccupiedBlocks | None, reach: np.ndarray, rays: IndexRays
) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest depth (mm) per tile of the image at which a ray may meet an occupied block.

    reach: (3,) index units by which what a ray meets may be displaced.
    """
    from PolyPoseLib.rendering import kernels

    tiles = tuple(-(-size // kernels.TILE) for size in rays.shape)
    directions = rays.per_column, rays.per_row, rays.corner
    # What is not a number must not be hidden by an empty image.
    finite = all(math.isfinite(part.sum()) for part in (*directions, rays.source))
    if occupied is None or not finite:
        return np.zeros(tiles), np.full(tiles, kernels.FARTHEST)
    near, far = np.empty(tiles), np.empty(tiles)
    half_edges = np.asarray(occupied.half_edge + reach, np.float64)
    kernels.depth_ranges(occupied.centres, half_edges, rays.source, directions, near, far)
    return near, far
