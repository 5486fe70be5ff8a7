"""Fused polyrigid kernels for the CPU: warp, gather, sum and analytic Jacobian in one pass along every ray (numba).

The weights are those of the fixed frame: they do not change while the cameras stand still, so they are laid out
once, block by block, by :func:`fill_weights`. Callers go through ``polyrigid_projector``.
"""

import math

import numba
import numpy as np

from PolyPoseLib.rendering.polyrigid_stages import (
    LANES,
    ROWS,
    accumulate,
    blend,
    gather,
    pull_back,
    warp,
)

MASS, EPSILON, RIGID = 0, 1, 2
"""Numbers of the weight forms, in the order of ``warp.weights.WeightForm``."""


def first_blocks(count: np.ndarray) -> np.ndarray:
    """(R + 1,) int64 numbers of the rays' first blocks, for ``count`` (R,) samples a ray; the last is the total."""
    return np.concatenate([[0], np.cumsum(-(-count.astype(np.int64) // LANES))])


@numba.njit(parallel=True, fastmath=True, cache=True)
def integrate(volume, weights, blocks, first, step, count, logs, to_index, step_mm, image, jacobian):
    """Line integrals of a volume that is seen through a polyrigid warp, and their derivatives by the logarithms.

    volume: (D, H, W) float32 with a border of zeros; weights: (blocks, K, LANES) float32; blocks: (R + 1,) int64;
    first, step: (R, 3) float32 mm relative to the logarithms' centre; count: (R,) int32; logs: (K, 6) float32;
    to_index: (3, 4) float32, moving mm relative to the centre to voxel index; image: (R,) float32, overwritten;
    jacobian: (R, K, 6) float32, overwritten, or of no ray when it is not wanted.
    """
    wanted = len(jacobian) > 0
    scale = np.float32(step_mm)
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


@numba.njit(fastmath=True)
def signed_distance(maps, k, x, y, z, spacing):
    """Trilinear value of map k at index (x, y, z), with the distance to the grid's box added beyond it, in mm."""
    _, depth, height, width = maps.shape
    at_x = min(max(x, np.float32(0)), np.float32(width - 1))
    at_y = min(max(y, np.float32(0)), np.float32(height - 1))
    at_z = min(max(z, np.float32(0)), np.float32(depth - 1))
    i, j, h = min(int(at_x), width - 2), min(int(at_y), height - 2), min(int(at_z), depth - 2)
    fx, fy, fz = at_x - np.float32(i), at_y - np.float32(j), at_z - np.float32(h)
    c00 = maps[k, h, j, i] + fx * (maps[k, h, j, i + 1] - maps[k, h, j, i])
    c01 = maps[k, h, j + 1, i] + fx * (maps[k, h, j + 1, i + 1] - maps[k, h, j + 1, i])
    c10 = maps[k, h + 1, j, i] + fx * (maps[k, h + 1, j, i + 1] - maps[k, h + 1, j, i])
    c11 = maps[k, h + 1, j + 1, i] + fx * (maps[k, h + 1, j + 1, i + 1] - maps[k, h + 1, j + 1, i])
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    value = max(c0 + fz * (c1 - c0), np.float32(0))
    if x != at_x or y != at_y or z != at_z:
        ox, oy, oz = (x - at_x) * spacing[0], (y - at_y) * spacing[1], (z - at_z) * spacing[2]
        value += math.sqrt(ox * ox + oy * oy + oz * oz)
    return value


@numba.njit(fastmath=True)
def raw_weight(form, share, distance, constant):
    """Weight before normalisation; constant is epsilon ("epsilon") or delta^2 ("rigid")."""
    squared = distance * distance
    if form == MASS:
        return share / (np.float32(1) + squared)
    if form == EPSILON:
        return np.float32(1) / (np.float32(1) + constant * squared)
    return share / (constant + squared)


@numba.njit(parallel=True, fastmath=True, cache=True)
def fill_weights(maps, to_grid, spacing, share, form, constant, blocks, first, step, weights):
    """Weights of all samples, those that fill up a ray's last block included.

    maps: (K, d, h, w) float32 signed distances, 2 nodes or more along every axis; to_grid: (3, 4) float32, mm
    relative to the centre to the maps' index; spacing: (3,) float32 mm along (i, j, k); share: (K,) float32;
    form, constant: see raw_weight; the rest as in integrate; weights: (blocks, K, LANES) float32, overwritten.
    """
    structures = len(maps)
    for ray in numba.prange(len(first)):
        for number in range(blocks[ray + 1] - blocks[ray]):
            block = weights[blocks[ray] + number]
            for n in range(LANES):
                s = np.float32(number * LANES + n)
                x, y, z = (
                    first[ray, 0] + s * step[ray, 0],
                    first[ray, 1] + s * step[ray, 1],
                    first[ray, 2] + s * step[ray, 2],
                )
                i = to_grid[0, 0] * x + to_grid[0, 1] * y + to_grid[0, 2] * z + to_grid[0, 3]
                j = to_grid[1, 0] * x + to_grid[1, 1] * y + to_grid[1, 2] * z + to_grid[1, 3]
                h = to_grid[2, 0] * x + to_grid[2, 1] * y + to_grid[2, 2] * z + to_grid[2, 3]
                total = np.float32(0)
                for k in range(structures):
                    distance = signed_distance(maps, k, i, j, h, spacing)
                    raw = raw_weight(form, share[k], distance, constant)
                    block[k, n] = raw
                    total += raw
                for k in range(structures):
                    block[k, n] /= total
