"""The fused polyrigid kernel for weights that travel with the bones (numba, CPU).

Distances are measured at T_k x, so that every pose changes every weight: they are looked up again in each pass, and
the Jacobian has a second part. With w_k = f(d_k) / sum f, a change of d_k changes V = sum w_j v_j by
(f'(d_k) / sum f) (v_k - V).
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
from PolyPoseLib.warp.weight_kernel import _float, _relative_slope, raw_weight


@compiled(parallel=True, fastmath=True)
def integrate_moving(volume, field, rays, motion, to_index, image, jacobian, by_pose):
    """As ``kernel_fixed.integrate``, for weights that are looked up at T_k x.

    field: WeightField; motion: logarithms (K, 6) float32, and T_k (K, 3, 4) float32 in coordinates relative to the
    centre; jacobian: (R, K, 6) the part by the logarithms with weights held; by_pose: (R, K, 6) the part by the
    weights, by a perturbation [rotation, translation] on the left of T_k about the centre.
    """
    blocks, first, step, count = rays.blocks, rays.first, rays.step, rays.counts
    logs, poses = motion
    structures = len(logs)
    wanted = len(jacobian) > 0
    scale = _float(rays.step_mm)
    for ray in numba.prange(len(count)):
        scratch = np.empty((ROWS, LANES), np.float32)
        block = np.empty((structures, LANES), np.float32)
        points = np.empty((structures, 7, LANES), np.float32)
        total = _float(0)
        if wanted:
            jacobian[ray] = 0
            by_pose[ray] = 0
        for number in range(blocks[ray + 1] - blocks[ray]):
            start = number * LANES
            _weigh(field, first[ray], step[ray], start, poses, block, points)
            blend(block, logs, scratch)
            warp(first[ray], step[ray], start, to_index, scratch)
            total += gather(volume, count[ray] - start, scratch)
            if wanted:
                means = scratch[:6].copy()
                pull_back(first[ray], step[ray], start, to_index, scratch)
                accumulate(block, scratch, jacobian[ray])
                _accumulate_by_pose(logs, means, points, scratch, by_pose[ray])
        image[ray] = total * scale
        if wanted:
            for k in range(structures):
                for c in range(6):
                    jacobian[ray, k, c] *= scale
                    by_pose[ray, k, c] *= scale


@numba.njit(fastmath=True)
def _weigh(field, first, step, start, poses, block, points):
    """Weights (K, LANES) of a block, and for each structure in ``points`` (K, 7, LANES): T_k x (3), the gradient
    of the distance there (3), and f'(d) / sum f.
    """
    maps, to_grid, spacing = field.maps, field.to_grid, field.spacing
    share, form, constant = field.share, field.form, field.constant
    structures = len(poses)
    for n in range(LANES):
        s = _float(start + n)
        x, y, z = first[0] + s * step[0], first[1] + s * step[1], first[2] + s * step[2]
        total = _float(0)
        for k in range(structures):
            pose = poses[k]
            a = pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z + pose[0, 3]
            b = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z + pose[1, 3]
            c = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3]
            distance, gi, gj, gh = _distance(
                maps,
                k,
                to_grid[0, 0] * a + to_grid[0, 1] * b + to_grid[0, 2] * c + to_grid[0, 3],
                to_grid[1, 0] * a + to_grid[1, 1] * b + to_grid[1, 2] * c + to_grid[1, 3],
                to_grid[2, 0] * a + to_grid[2, 1] * b + to_grid[2, 2] * c + to_grid[2, 3],
                spacing,
            )
            raw = raw_weight(form, share[k], distance, constant)
            block[k, n] = raw
            total += raw
            points[k, 0, n], points[k, 1, n], points[k, 2, n] = a, b, c
            points[k, 3, n] = to_grid[0, 0] * gi + to_grid[1, 0] * gj + to_grid[2, 0] * gh
            points[k, 4, n] = to_grid[0, 1] * gi + to_grid[1, 1] * gj + to_grid[2, 1] * gh
            points[k, 5, n] = to_grid[0, 2] * gi + to_grid[1, 2] * gj + to_grid[2, 2] * gh
            points[k, 6, n] = _relative_slope(form, distance, constant)
        for k in range(structures):
            block[k, n] /= total
            points[k, 6, n] *= block[k, n]


@numba.njit(fastmath=True)
def _distance(maps, k, x, y, z, spacing):
    """Distance in map k at index (x, y, z) as ``polyrigid_kernel.fill_weights`` takes it, and its derivative by it."""
    _, depth, height, width = maps.shape
    at_x = min(max(x, _float(0)), _float(width - 1))
    at_y = min(max(y, _float(0)), _float(height - 1))
    at_z = min(max(z, _float(0)), _float(depth - 1))
    i, j, h = min(int(at_x), width - 2), min(int(at_y), height - 2), min(int(at_z), depth - 2)
    fx, fy, fz = at_x - _float(i), at_y - _float(j), at_z - _float(h)
    a00, a01, a10, a11 = (
        maps[k, h, j, i],
        maps[k, h, j + 1, i],
        maps[k, h + 1, j, i],
        maps[k, h + 1, j + 1, i],
    )
    d00, d01 = maps[k, h, j, i + 1] - a00, maps[k, h, j + 1, i + 1] - a01
    d10, d11 = maps[k, h + 1, j, i + 1] - a10, maps[k, h + 1, j + 1, i + 1] - a11
    c00, c01, c10, c11 = a00 + fx * d00, a01 + fx * d01, a10 + fx * d10, a11 + fx * d11
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    e0, e1 = d00 + fy * (d01 - d00), d10 + fy * (d11 - d10)
    value = c0 + fz * (c1 - c0)
    by_x = e0 + fz * (e1 - e0)
    by_y = (c01 - c00) + fz * ((c11 - c10) - (c01 - c00))
    by_z = c1 - c0
    if value <= _float(0):
        value, by_x, by_y, by_z = _float(0), _float(0), _float(0), _float(0)
    if x != at_x or y != at_y or z != at_z:
        ox, oy, oz = (x - at_x) * spacing[0], (y - at_y) * spacing[1], (z - at_z) * spacing[2]
        beyond = math.sqrt(ox * ox + oy * oy + oz * oz)
        value += beyond
        by_x = by_x if x == at_x else ox / beyond * spacing[0]
        by_y = by_y if y == at_y else oy / beyond * spacing[1]
        by_z = by_z if z == at_z else oz / beyond * spacing[2]
    return value, by_x, by_y, by_z


@numba.njit(fastmath=True)
def _accumulate_by_pose(logs, means, points, scratch, by_pose):
    """Add the weights' part of a block's derivatives to ``by_pose`` (K, 6).

    means: (6, LANES) of the logarithms; points: see _weigh; scratch: rows 0..5 as pull_back leaves them.
    """
    for k in range(len(logs)):
        v = logs[k]
        a, b, c, d, e, f = _float(0), _float(0), _float(0), _float(0), _float(0), _float(0)
        for n in range(LANES):
            rise = (
                scratch[0, n] * (v[0] - means[0, n])
                + scratch[1, n] * (v[1] - means[1, n])
                + scratch[2, n] * (v[2] - means[2, n])
                + scratch[3, n] * (v[3] - means[3, n])
                + scratch[4, n] * (v[4] - means[4, n])
                + scratch[5, n] * (v[5] - means[5, n])
            ) * points[k, 6, n]
            x, y, z = points[k, 0, n], points[k, 1, n], points[k, 2, n]
            gx, gy, gz = rise * points[k, 3, n], rise * points[k, 4, n], rise * points[k, 5, n]
            a += y * gz - z * gy
            b += z * gx - x * gz
            c += x * gy - y * gx
            d += gx
            e += gy
            f += gz
        by_pose[k, 0] += a
        by_pose[k, 1] += b
        by_pose[k, 2] += c
        by_pose[k, 3] += d
        by_pose[k, 4] += e
        by_pose[k, 5] += f
