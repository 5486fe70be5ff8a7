"""Fused ray kernel for a volume seen through a displacement field (numba, CPU)."""

import math

import numba
import numpy as np

from PolyPoseLib.rendering.kernels import _clip


@numba.njit(parallel=True, fastmath=True, cache=True)
def project_warped(
    volume, field, grid_scale, grid_offset, low, high, source, corner, per_column, per_row, inverse_intrinsics,
    step_mm, image,
):  # fmt: skip
    """Line integrals of ``volume`` warped by ``field``.

    volume: (D, H, W) float32 with a border of zeros; field: (d, h, w, 3) float32 displacement in the volume's index
    units on a grid whose coordinate is ``index * grid_scale + grid_offset`` (3,) each; low, high: (3,) index box to
    which rays are clipped; the rest as in ``kernels.project``.  Beyond the grid the nearest displacement is taken.
    """
    depth, height, width = volume.shape
    gd, gh, gw, _ = field.shape
    rows, columns = image.shape
    ax, ay, az = np.float32(grid_scale[0]), np.float32(grid_scale[1]), np.float32(grid_scale[2])
    bx, by, bz = np.float32(grid_offset[0]), np.float32(grid_offset[1]), np.float32(grid_offset[2])
    zero = np.float32(0.0)
    top_x, top_y, top_z = np.float32(gw - 1.001), np.float32(gh - 1.001), np.float32(gd - 1.001)
    end_x, end_y, end_z = np.float32(width - 1.0), np.float32(height - 1.0), np.float32(depth - 1.0)
    for row in numba.prange(rows):
        for column in range(columns):
            dx = corner[0] + column * per_column[0] + row * per_row[0]
            dy = corner[1] + column * per_column[1] + row * per_row[1]
            dz = corner[2] + column * per_column[2] + row * per_row[2]
            u = inverse_intrinsics[0, 0] * column + inverse_intrinsics[0, 1] * row + inverse_intrinsics[0, 2]
            v = inverse_intrinsics[1, 1] * row + inverse_intrinsics[1, 2]
            ds = step_mm / math.sqrt(u * u + v * v + 1.0)
            near, far = _clip(source[0] - low[0], dx, 0.0, 1e9, high[0] - low[0])
            near, far = _clip(source[1] - low[1], dy, near, far, high[1] - low[1])
            near, far = _clip(source[2] - low[2], dz, near, far, high[2] - low[2])
            total = zero
            if far > near:
                first = math.ceil(near / ds - 0.5)
                count = int(math.floor(far / ds - 0.5)) - int(first) + 1
                s = (first + 0.5) * ds
                x, y, z = (
                    np.float32(source[0] + s * dx),
                    np.float32(source[1] + s * dy),
                    np.float32(source[2] + s * dz),
                )
                sx, sy, sz = np.float32(ds * dx), np.float32(ds * dy), np.float32(ds * dz)
                for n in range(count):
                    px, py, pz = x + n * sx, y + n * sy, z + n * sz
                    hx = min(max(px * ax + bx, zero), top_x)
                    hy = min(max(py * ay + by, zero), top_y)
                    hz = min(max(pz * az + bz, zero), top_z)
                    i, j, k = int(hx), int(hy), int(hz)
                    fx, fy, fz = hx - np.float32(i), hy - np.float32(j), hz - np.float32(k)
                    w00 = (1 - fy) * (1 - fz)
                    w10 = fy * (1 - fz)
                    w01 = (1 - fy) * fz
                    w11 = fy * fz
                    ux, uy, uz = zero, zero, zero
                    for a in range(2):
                        t = fx if a else 1 - fx
                        p, q, r, m = w00 * t, w10 * t, w01 * t, w11 * t
                        ux += p * field[k, j, i + a, 0] + q * field[k, j + 1, i + a, 0]
                        ux += r * field[k + 1, j, i + a, 0] + m * field[k + 1, j + 1, i + a, 0]
                        uy += p * field[k, j, i + a, 1] + q * field[k, j + 1, i + a, 1]
                        uy += r * field[k + 1, j, i + a, 1] + m * field[k + 1, j + 1, i + a, 1]
                        uz += p * field[k, j, i + a, 2] + q * field[k, j + 1, i + a, 2]
                        uz += r * field[k + 1, j, i + a, 2] + m * field[k + 1, j + 1, i + a, 2]
                    px, py, pz = px + ux, py + uy, pz + uz
                    if px <= zero or py <= zero or pz <= zero or px >= end_x or py >= end_y or pz >= end_z:
                        continue
                    i, j, k = int(px), int(py), int(pz)
                    fx, fy, fz = px - np.float32(i), py - np.float32(j), pz - np.float32(k)
                    c00 = volume[k, j, i] + fx * (volume[k, j, i + 1] - volume[k, j, i])
                    c01 = volume[k, j + 1, i] + fx * (volume[k, j + 1, i + 1] - volume[k, j + 1, i])
                    c10 = volume[k + 1, j, i] + fx * (volume[k + 1, j, i + 1] - volume[k + 1, j, i])
                    c11 = volume[k + 1, j + 1, i] + fx * (
                        volume[k + 1, j + 1, i + 1] - volume[k + 1, j + 1, i]
                    )
                    c0 = c00 + fy * (c01 - c00)
                    c1 = c10 + fy * (c11 - c10)
                    total += c0 + fz * (c1 - c0)
            image[row, column] = total * np.float32(step_mm)
