"""Rendering by the compiled kernels."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.rendering.backend import IndexField, IndexRays
from PolyPoseLib.rendering.occupancy import OccupiedBlocks

_MOST_VALUES = 2**31 - 1


class NumbaBackend:
    """Compiled on first use; multi-threaded."""

    name = "numba"

    def project(
        self,
        voxels: np.ndarray,
        rays: IndexRays,
        step_mm: float,
        shape: tuple[int, int],
        moments: bool,
        occupied: OccupiedBlocks | None = None,
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """See :class:`Backend`."""
        from PolyPoseLib.rendering import kernels

        near, far = _depth_ranges(occupied, np.zeros(3), rays, shape)
        image = np.zeros(shape, np.float32)
        arguments = (_flat(voxels), voxels.shape, *_rays(rays), float(step_mm), near, far, image)
        if not moments:
            kernels.project(*arguments)
            return image, None
        sums = np.zeros((*shape, 6), np.float32)
        kernels.project_with_moments(*arguments, sums)
        return image, sums

    def project_warped(
        self,
        voxels: np.ndarray,
        field: IndexField,
        rays: IndexRays,
        step_mm: float,
        shape: tuple[int, int],
        occupied: OccupiedBlocks | None = None,
    ) -> np.ndarray:
        """See :class:`Backend`."""
        from PolyPoseLib.rendering import kernels

        reach = np.abs(field.vectors).reshape(-1, 3).max(axis=0)
        near, far = _depth_ranges(occupied, reach, rays, shape)
        image = np.zeros(shape, np.float32)
        kernels.project_warped(
            _flat(voxels), voxels.shape, _flat(field.vectors), field.vectors.shape[:3], field.scale, field.offset,
            tuple(field.low), tuple(field.high), *_rays(rays), float(step_mm), near, far, image,
        )  # fmt: skip
        return image


def _flat(values: np.ndarray) -> np.ndarray:
    """The values in one row, as the kernels take them.

    Raises ValueError for less than a cell along an axis, or more values than 32-bit indices can count: the kernels do
    not look where they read.
    """
    if min(values.shape[:3]) < 2:
        raise ValueError(f"a grid of shape {values.shape[:3]} has no cell")
    if values.size > _MOST_VALUES:
        raise ValueError(f"a volume of {values.size} values is beyond what the kernels can index")
    return np.require(values, np.float32, ["C", "W"]).reshape(-1)


def _rays(rays: IndexRays) -> tuple[np.ndarray, ...]:
    """The rays in the kernels' order of arguments."""
    return rays.source, rays.corner, rays.per_column, rays.per_row, rays.inverse_intrinsics


def _depth_ranges(
    occupied: OccupiedBlocks | None, reach: np.ndarray, rays: IndexRays, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest depth (mm) per tile of the image at which a ray may meet an occupied block.

    reach: (3,) index units by which what a ray meets may be displaced.
    """
    from PolyPoseLib.rendering import kernels

    tiles = tuple(-(-size // kernels.TILE) for size in shape)
    near, far = np.zeros(tiles), np.full(tiles, kernels.FARTHEST)
    directions = np.stack([rays.per_column, rays.per_row, rays.corner], axis=1)
    # What is not a number must not be hidden by an empty image.
    if occupied is not None and np.isfinite(directions).all() and np.isfinite(rays.source).all():
        half_edges = np.asarray(occupied.half_edge + reach, np.float64)
        kernels.depth_ranges(occupied.centres, half_edges, rays.source, np.linalg.inv(directions), near, far)
    return near, far
