"""Fused polyrigid kernels for the CPU: warp, gather, sum and analytic Jacobian in one pass along every ray (numba).

The weights are those of the fixed frame: they do not change while the cameras stand still, so they are laid out
once, block by block, by :func:`fill_weights`. Callers go through ``polyrigid_projector``.
"""

import math

import numba
import numpy as np

from PolyPoseLib.baselines.published.kernel_stages import (
    LANES,
    ROWS,
    accumulate,
    blend,
    gather,
    pull_back,
    warp,
)
from PolyPoseLib.compiled import compiled
from PolyPoseLib.warp.weight_kernel import raw_weight


def first_blocks(count: np.ndarray) -> np.ndarray:
    """(R + 1,) int64 numbers of the rays' first blocks, for ``count`` (R,) samples a ray; the last is the total."""
    return np.concatenate([[0], np.cumsum(-(-count.astype(np.int64) // LANES))])


@compiled(parallel=True, fastmath=True)
def integrate(volume, weights, rays, logs, to_index, image, jacobian):
    """Line integrals of a volume that is seen through a polyrigid warp, and their derivatives by the logarithms.

    volume: (D, H, W) float32 with a border of zeros; weights: (blocks, K, LANES) float32; rays: RayBlocks; logs: (K, 6)
    float32; to_index: (3, 4) float32, moving mm relative to the centre to voxel index; image: (R,) float32,
    overwritten; jacobian: (R, K, 6) float32, overwritten, or of no ray when it is not wanted.
    """
    blocks, first, step, count = rays.blocks, rays.first, rays.step, rays.counts
    wanted = len(jacobian) > 0
    scale = np.float32(rays.step_mm)
    for ray in numba.prange(len(count)):
        scratch = np.empty((ROWS, LANES), np.float32)
        total = np.float32(0)
        if wanted:
            jacobian[ray] = 0
        for number in range(blocks[ray + 1] - blocks[ray]):
            block = weights[blocks[ray] + number]
            start = number * LANES
            blend(block, logs, scratch)
            warp(first[ray], step[ray], start, to_index, scratch)
            total += gather(volume, count[ray] - start, scratch)
            if wanted:
                pull_back(first[ray], step[ray], start, to_index, scratch)
                accumulate(block, scratch, jacobian[ray])
        image[ray] = total * scale
        if wanted:
            for k in range(len(logs)):
                for c in range(6):
                    jacobian[ray, k, c] *= scale


@compiled(parallel=True, fastmath=True)
def fill_weights(field, rays, weights):
    """Weights of all samples, those that fill up a ray's last block included.

    field: WeightField; rays: RayBlocks; weights: (blocks, K, LANES) float32, overwritten.
    """
    maps, share, form, constant = field.maps, field.share, field.form, field.constant
    blocks, first, step = rays.blocks, rays.first, rays.step
    for ray in numba.prange(len(first)):
        cells = np.empty((3, LANES), np.int64)
        places = np.empty((4, LANES), np.float32)
        for number in range(blocks[ray + 1] - blocks[ray]):
            block = weights[blocks[ray] + number]
            _locate(field, first[ray], step[ray], number * LANES, cells, places)
            totals = np.zeros(LANES, np.float32)
            for k in range(len(maps)):
                _interpolate(maps[k], cells, places, block[k])
                for n in range(LANES):
                    raw = raw_weight(form, share[k], block[k, n], constant)
                    block[k, n] = raw
                    totals[n] += raw
            for n in range(LANES):
                totals[n] = np.float32(1) / totals[n]
            for k in range(len(maps)):
                for n in range(LANES):
                    block[k, n] *= totals[n]


@numba.njit(fastmath=True)
def _locate(field, first, step, start, cells, places):
    """Where a block's samples lie in the maps' grid: cells (3, LANES) and, in ``places`` (4, LANES), the fractions
    inside the cell (3) and the distance to the grid's box (mm).
    """
    to_grid, spacing = field.to_grid, field.spacing
    _, depth, height, width = field.maps.shape
    zero = np.float32(0)
    for n in range(LANES):
        s = np.float32(start + n)
        x, y, z = first[0] + s * step[0], first[1] + s * step[1], first[2] + s * step[2]
        i = to_grid[0, 0] * x + to_grid[0, 1] * y + to_grid[0, 2] * z + to_grid[0, 3]
        j = to_grid[1, 0] * x + to_grid[1, 1] * y + to_grid[1, 2] * z + to_grid[1, 3]
        h = to_grid[2, 0] * x + to_grid[2, 1] * y + to_grid[2, 2] * z + to_grid[2, 3]
        at_i = min(max(i, zero), np.float32(width - 1))
        at_j = min(max(j, zero), np.float32(height - 1))
        at_h = min(max(h, zero), np.float32(depth - 1))
        cells[0, n], cells[1, n] = min(int(at_i), width - 2), min(int(at_j), height - 2)
        cells[2, n] = min(int(at_h), depth - 2)
        places[0, n] = at_i - np.float32(cells[0, n])
        places[1, n] = at_j - np.float32(cells[1, n])
        places[2, n] = at_h - np.float32(cells[2, n])
        oi, oj, oh = (i - at_i) * spacing[0], (j - at_j) * spacing[1], (h - at_h) * spacing[2]
        places[3, n] = math.sqrt(oi * oi + oj * oj + oh * oh)


@numba.njit(fastmath=True)
def _interpolate(signed, cells, places, distance):
    """Trilinear distances (LANES,) of one map (d, h, w), at least 0, with the distance to its box added."""
    for n in range(LANES):
        i, j, h = cells[0, n], cells[1, n], cells[2, n]
        fx, fy, fz = places[0, n], places[1, n], places[2, n]
        c00 = signed[h, j, i] + fx * (signed[h, j, i + 1] - signed[h, j, i])
        c01 = signed[h, j + 1, i] + fx * (signed[h, j + 1, i + 1] - signed[h, j + 1, i])
        c10 = signed[h + 1, j, i] + fx * (signed[h + 1, j, i + 1] - signed[h + 1, j, i])
        c11 = signed[h + 1, j + 1, i] + fx * (signed[h + 1, j + 1, i + 1] - signed[h + 1, j + 1, i])
        c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
        distance[n] = max(c0 + fz * (c1 - c0), np.float32(0)) + places[3, n]
