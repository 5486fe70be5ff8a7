"""Silhouettes of label maps: the pixels whose ray meets any voxel of a mask, without sampling.

Scores in 2D must not share the renderer with the methods that are fitted by it, and a ray sum at steps can miss a
corner. Here every voxel is a closed box, and a ray meets it or does not (the slab test of Kay and Kajiya). What makes
that fast changes no pixel: full blocks of voxels are tested as one box, and boxes whose projection lies in what is
marked already are left out.

Source: T. Kay and J. Kajiya, "Ray tracing complex scenes", SIGGRAPH 1986.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import bounding_box

_BLOCKS = (8, 4, 2, 1)
"""Edges of the boxes, in voxels, of which each is a multiple of the next."""

_BOXES_AT_ONCE = 4096
_TESTS_AT_ONCE = 1 << 20


def silhouette(mask: Volume, camera: Camera) -> np.ndarray:
    """The pixels whose ray meets any voxel of a mask.

    Parameters
    ----------
    mask : Volume
        Voxels (k, j, i), zero outside the mask; affine of any handedness. A voxel reaches half a voxel from its centre.
    camera : Camera
        World LPS mm to pixels. Rays start at its source: what lies behind it is not met.

    Returns
    -------
    (H, W) array of bool
        True where the ray through the pixel's centre meets a voxel.

    """
    seen = np.zeros((camera.height, camera.width), dtype=bool)
    voxels = np.asarray(mask.voxels, dtype=bool)
    box = bounding_box(voxels)
    if box is None:
        return seen
    first = np.array([side.start for side in reversed(box)])
    size = np.array([side.stop - side.start for side in reversed(box)])
    low, high = (ends[0] for ends in _Shadows(mask, camera).rectangles(first[None] - 0.5, size))
    if (low > high).any():
        return seen
    window = slice(int(low[1]), int(high[1]) + 1), slice(int(low[0]), int(high[0]) + 1)
    part = np.zeros((window[0].stop - window[0].start, window[1].stop - window[1].start), dtype=bool)
    rays = _Rays(mask, camera.cropped(window[0].start, window[0].stop, window[1].start, window[1].stop))
    for corners, edge in _boxes(voxels[box]):
        # Every n-th box: the first few mark most of the silhouette, within which the others are then left out.
        parts = -(-len(corners) // _BOXES_AT_ONCE)
        for number in range(parts):
            rays.mark(part, corners[number::parts] + first, edge)
    seen[window] = part
    return seen


def _boxes(mask: np.ndarray) -> Iterator[tuple[np.ndarray, int]]:
    """First voxels (N, 3), as (i, j, k), of full cubes, and their edge in voxels; together they are the mask."""
    left = np.pad(mask, [(0, -size % _BLOCKS[0]) for size in mask.shape])
    for edge in _BLOCKS:
        cells = left.reshape([n for size in left.shape for n in (size // edge, edge)])
        full = np.asarray(cells.all(axis=(1, 3, 5)))
        if full.any():
            yield np.argwhere(full)[:, ::-1] * edge, edge
            cells[np.broadcast_to(full[:, None, :, None, :, None], cells.shape)] = False


class _Shadows:
    """Where boxes of a grid fall on a camera's detector."""

    def __init__(self, grid: Volume, camera: Camera) -> None:
        self._last = np.array([camera.width - 1, camera.height - 1])
        self._project = camera.intrinsics @ (camera.extrinsic @ grid.affine)[:3]

    def rectangles(self, corners: np.ndarray, edge: int | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First and last pixel (N, 2), (column, row), within which boxes project; last before first where nowhere.

        corners: (N, 3) their lowest corners, as (i, j, k); edge: their size in voxels, one or (3,).
        """
        ends = np.stack(np.meshgrid(*[(0, 1)] * 3, indexing="ij"), axis=-1).reshape(8, 3) * edge
        points = corners[:, None] + ends
        image = points @ self._project[:, :3].T + self._project[:, 3]
        depth = image[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = image[..., :2] / depth[..., None]
        slack = 1e-6  # of rounding; the slab test decides
        with np.errstate(invalid="ignore"):
            first = np.ceil(pixels.min(axis=1) - slack)
            last = np.floor(pixels.max(axis=1) + slack)
        behind, beside = (depth <= 0).all(axis=1), (depth <= 0).any(axis=1)
        first[beside], last[beside] = (
            0,
            self._last,
        )  # a box that reaches behind the source may project anywhere
        last[behind] = -1
        first = np.clip(first, 0, self._last + 1).astype(np.int64)
        return first, np.clip(last, -1, self._last).astype(np.int64)


class _Rays:
    """The rays of a camera in the index coordinates of a grid."""

    def __init__(self, grid: Volume, camera: Camera) -> None:
        self._shadows = _Shadows(grid, camera)
        self._source = grid.to_index(camera.source)
        to_index = np.linalg.inv(grid.affine[:3, :3])
        self._directions = camera.pixel_directions().reshape(-1, 3) @ to_index.T
        self._width = camera.width

    def mark(self, seen: np.ndarray, low: np.ndarray, edge: int) -> None:
        """Mark in seen (H, W) what meets the boxes from voxels low (N, 3) of an edge in voxels."""
        corners = low - 0.5
        first, last = self._shadows.rectangles(corners, edge)
        kept = ((first <= last).all(axis=1)) & ~_is_full(seen, first, last)
        corners, first, last = corners[kept], first[kept], last[kept]
        size = last - first + 1
        tests = np.cumsum(size.prod(axis=1))
        start = 0
        while start < len(corners):
            done = tests[start - 1] if start else 0
            stop = max(int(np.searchsorted(tests, done + _TESTS_AT_ONCE, side="right")), start + 1)
            self._test(seen, corners[start:stop], first[start:stop], size[start:stop], edge)
            start = stop

    def _test(
        self, seen: np.ndarray, corners: np.ndarray, first: np.ndarray, size: np.ndarray, edge: int
    ) -> None:
        """Mark the pixels from first (N, 2), size (N, 2) of them, whose ray meets their box."""
        count = size.prod(axis=1)
        box = np.repeat(np.arange(len(corners)), count)
        place = np.arange(len(box)) - np.repeat(np.cumsum(count) - count, count)
        columns = size[box, 0]
        pixel = (first[box, 1] + place // columns) * self._width + first[box, 0] + place % columns
        flat = seen.reshape(-1)
        fresh = ~flat[pixel]
        pixel, box = pixel[fresh], box[fresh]
        enter, leave = np.zeros(len(pixel)), np.full(len(pixel), np.inf)
        for axis in range(3):
            to_low = corners[box, axis] - self._source[axis]
            along = self._directions[pixel, axis]
            parallel = along == 0
            along = np.where(parallel, 1.0, along)
            one, other = to_low / along, (to_low + edge) / along
            between = (to_low <= 0) & (to_low + edge >= 0)
            enter = np.maximum(enter, np.where(parallel, 0.0, np.minimum(one, other)))
            leave = np.minimum(
                leave, np.where(parallel, np.where(between, np.inf, -1.0), np.maximum(one, other))
            )
        flat[pixel[enter <= leave]] = True


def _is_full(seen: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Whether all pixels of rectangles (N, 2), (column, row), both ends included, are True; by a summed-area table."""
    table = np.zeros((seen.shape[0] + 1, seen.shape[1] + 1), dtype=np.int64)
    np.cumsum(np.cumsum(seen, axis=0, dtype=np.int64), axis=1, out=table[1:, 1:])
    (left, top), (right, bottom) = first.T, (last + 1).T
    right, bottom = np.maximum(right, left), np.maximum(bottom, top)
    right, bottom = np.minimum(right, seen.shape[1]), np.minimum(bottom, seen.shape[0])
    left, top = np.minimum(left, right), np.minimum(top, bottom)
    total = table[bottom, right] - table[top, right] - table[bottom, left] + table[top, left]
    return total == (right - left) * (bottom - top)
