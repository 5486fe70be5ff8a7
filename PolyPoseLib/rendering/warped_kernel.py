"""Fused ray kernel for a volume seen through a displacement field (numba, CPU)."""

import numba
import numpy as np

from PolyPoseLib.rendering.kernels import TILE, direction_of, place_of, samples_of_ray


@numba.njit(inline="always", fastmath=True)
def _component(field, at, next_j, next_k, x0, x1, w00, w01, w10, w11):
    """One component of a field between eight nodes; ``at``: its flat index at the first."""
    return (
        w00 * (x0 * field[at] + x1 * field[at + 3])
        + w01 * (x0 * field[at + next_j] + x1 * field[at + next_j + 3])
        + w10 * (x0 * field[at + next_k] + x1 * field[at + next_k + 3])
        + w11 * (x0 * field[at + next_k + next_j] + x1 * field[at + next_k + next_j + 3])
    )


@numba.njit(parallel=True, fastmath=True, cache=True)
def project_warped(
    volume, size, field, field_size, grid_scale, grid_offset, low, high, source, corner, per_column, per_row,
    inverse_intrinsics, step_mm, near, far, image,
):  # fmt: skip
    """Line integrals of a volume warped by a field.

    volume: flat float32 with a border of zeros, of ``size`` (D, H, W); field: flat float32 displacements in the
    volume's index units, of ``field_size`` (d, h, w) times 3, on a grid whose coordinate is ``index * grid_scale +
    grid_offset`` (3,) each; low, high: (3,) index box to which rays are clipped; the rest as in ``kernels.project``.
    Beyond the grid the nearest displacement is taken.
    """
    depth, height, width = size
    nodes_k, nodes_j, nodes_i = field_size
    rows, columns = image.shape
    ax, ay, az = np.float32(grid_scale[0]), np.float32(grid_scale[1]), np.float32(grid_scale[2])
    bx, by, bz = np.float32(grid_offset[0]), np.float32(grid_offset[1]), np.float32(grid_offset[2])
    zero, one = np.float32(0.0), np.float32(1.0)
    top_x, top_y, top_z = (
        np.float32(nodes_i - 1.001),
        np.float32(nodes_j - 1.001),
        np.float32(nodes_k - 1.001),
    )
    end_x, end_y, end_z = np.float32(width - 1.0), np.float32(height - 1.0), np.float32(depth - 1.0)
    none, last_i, last_j, last_k = np.int32(0), np.int32(width - 2), np.int32(height - 2), np.int32(depth - 2)
    next_j, next_k = np.int32(width), np.int32(width * height)
    node_j, node_k = np.int32(3 * nodes_i), np.int32(3 * nodes_i * nodes_j)
    for row in numba.prange(rows):
        for column in range(columns):
            start, end = near[row // TILE, column // TILE], far[row // TILE, column // TILE]
            if end <= start:
                continue
            along = direction_of(row, column, corner, per_column, per_row)
            pixel = place_of(row, column, inverse_intrinsics)
            count, s, ds = samples_of_ray(source, along, pixel, step_mm, start, end, low, high)
            total = zero
            x, sx = np.float32(source[0] + s * along[0]), np.float32(ds * along[0])
            y, sy = np.float32(source[1] + s * along[1]), np.float32(ds * along[1])
            z, sz = np.float32(source[2] + s * along[2]), np.float32(ds * along[2])
            for n in range(count):
                m = np.float32(n)
                px, py, pz = x + m * sx, y + m * sy, z + m * sz
                hx = min(max(px * ax + bx, zero), top_x)
                hy = min(max(py * ay + by, zero), top_y)
                hz = min(max(pz * az + bz, zero), top_z)
                i, j, k = np.int32(hx), np.int32(hy), np.int32(hz)
                fx, fy, fz = hx - np.float32(i), hy - np.float32(j), hz - np.float32(k)
                at = np.int32(np.int32(np.int32(k * node_k) + np.int32(j * node_j)) + np.int32(3 * i))
                ex, ey, ez = one - fx, one - fy, one - fz
                w00, w01, w10, w11 = ez * ey, ez * fy, fz * ey, fz * fy
                px += _component(field, at, node_j, node_k, ex, fx, w00, w01, w10, w11)
                py += _component(field, at + 1, node_j, node_k, ex, fx, w00, w01, w10, w11)
                pz += _component(field, at + 2, node_j, node_k, ex, fx, w00, w01, w10, w11)
                inside = (px > zero) & (py > zero) & (pz > zero) & (px < end_x) & (py < end_y) & (pz < end_z)
                i = min(max(np.int32(px), none), last_i)
                j = min(max(np.int32(py), none), last_j)
                k = min(max(np.int32(pz), none), last_k)
                fx, fy, fz = px - np.float32(i), py - np.float32(j), pz - np.float32(k)
                at = np.int32(np.int32(np.int32(k * next_k) + np.int32(j * next_j)) + i)
                a00, a01 = volume[at], volume[at + next_j]
                a10, a11 = volume[at + next_k], volume[at + next_k + next_j]
                c00 = a00 + fx * (volume[at + 1] - a00)
                c01 = a01 + fx * (volume[at + next_j + 1] - a01)
                c10 = a10 + fx * (volume[at + next_k + 1] - a10)
                c11 = a11 + fx * (volume[at + next_k + next_j + 1] - a11)
                c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
                total += (c0 + fz * (c1 - c0)) if inside else zero
            image[row, column] = total * np.float32(step_mm)
