"""The stages of the fused polyrigid kernels (numba): each treats one block of consecutive samples of a ray.

A block has LANES samples, and every stage is a loop over them without branches (but for the gather), so that the
compiler turns it into vector instructions. Numbers go from stage to stage in a scratch array (ROWS, LANES):

    rows 0..5   logarithm V = sum_k w_k v_k of the sample's motion [rotation rad, translation part mm];
                afterwards q, the derivative of the sample's value by V
    rows 6..8   voxel index (i, j, k) of the warped sample
    rows 9..11  derivative of the interpolated volume by that index

All points are in mm relative to the centre about which logarithms are taken.
"""

import numba
import numpy as np

from PolyPoseLib.geometry.exponential_kernel import cubic, polynomial, series, sinc, slope, versine

LANES = 32
"""Samples in a block."""

ROWS = 12

_float = np.float32
_ZERO = _float(0)

sinc_slope = polynomial(slope(series(1)))
versine_slope = polynomial(slope(series(2)))
cubic_slope = polynomial(slope(series(3)))


@numba.njit(fastmath=True)
def blend(weights, logs, scratch):
    """Mean logarithm of every lane: rows 0..5 = sum_k weights (K, LANES) logs (K, 6)."""
    for c in range(6):
        for n in range(LANES):
            scratch[c, n] = _ZERO
    for k in range(len(logs)):
        a, b, c, d, e, f = logs[k, 0], logs[k, 1], logs[k, 2], logs[k, 3], logs[k, 4], logs[k, 5]
        for n in range(LANES):
            w = weights[k, n]
            scratch[0, n] += w * a
            scratch[1, n] += w * b
            scratch[2, n] += w * c
            scratch[3, n] += w * d
            scratch[4, n] += w * e
            scratch[5, n] += w * f


@numba.njit(fastmath=True)
def warp(first, step, number, to_index, scratch):
    """Voxel index of every lane's warped sample: rows 6..8 = to_index (3, 4) exp(V) x.

    first, step: (3,) of the ray; number: of the block's first sample. exp(V) x = x + A w x x + u + w x (B w x x +
    C w x u) + B w x u, with A, B, C = sin t/t, (1 - cos t)/t^2, (t - sin t)/t^3 (Barfoot, eq. 7.16 and 7.37).
    """
    first_x, first_y, first_z = first[0], first[1], first[2]
    step_x, step_y, step_z = step[0], step[1], step[2]
    m00, m01, m02, m03 = to_index[0, 0], to_index[0, 1], to_index[0, 2], to_index[0, 3]
    m10, m11, m12, m13 = to_index[1, 0], to_index[1, 1], to_index[1, 2], to_index[1, 3]
    m20, m21, m22, m23 = to_index[2, 0], to_index[2, 1], to_index[2, 2], to_index[2, 3]
    for n in range(LANES):
        s = _float(number + n)
        x, y, z = first_x + s * step_x, first_y + s * step_y, first_z + s * step_z
        wx, wy, wz = scratch[0, n], scratch[1, n], scratch[2, n]
        ux, uy, uz = scratch[3, n], scratch[4, n], scratch[5, n]
        t2 = wx * wx + wy * wy + wz * wz
        a, b, c = sinc(t2), versine(t2), cubic(t2)
        px, py, pz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
        qx, qy, qz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
        tx, ty, tz = b * px + c * qx, b * py + c * qy, b * pz + c * qz
        moved_x = x + a * px + ux + b * qx + wy * tz - wz * ty
        moved_y = y + a * py + uy + b * qy + wz * tx - wx * tz
        moved_z = z + a * pz + uz + b * qz + wx * ty - wy * tx
        scratch[6, n] = m00 * moved_x + m01 * moved_y + m02 * moved_z + m03
        scratch[7, n] = m10 * moved_x + m11 * moved_y + m12 * moved_z + m13
        scratch[8, n] = m20 * moved_x + m21 * moved_y + m22 * moved_z + m23


@numba.njit(fastmath=True)
def gather(volume, count, scratch):
    """Sum of the block's first ``count`` samples of a volume with a border of zeros; rows 9..11 get the gradient."""
    depth, height, width = volume.shape
    end_x, end_y, end_z = _float(width - 1), _float(height - 1), _float(depth - 1)
    total = _ZERO
    for n in range(LANES):
        x, y, z = scratch[6, n], scratch[7, n], scratch[8, n]
        scratch[9, n] = _ZERO
        scratch[10, n] = _ZERO
        scratch[11, n] = _ZERO
        if n >= count or x <= _ZERO or y <= _ZERO or z <= _ZERO or x >= end_x or y >= end_y or z >= end_z:
            continue
        i, j, k = int(x), int(y), int(z)
        fx, fy, fz = x - _float(i), y - _float(j), z - _float(k)
        a00, a01 = volume[k, j, i], volume[k, j + 1, i]
        a10, a11 = volume[k + 1, j, i], volume[k + 1, j + 1, i]
        d00, d01 = volume[k, j, i + 1] - a00, volume[k, j + 1, i + 1] - a01
        d10, d11 = volume[k + 1, j, i + 1] - a10, volume[k + 1, j + 1, i + 1] - a11
        c00, c01, c10, c11 = a00 + fx * d00, a01 + fx * d01, a10 + fx * d10, a11 + fx * d11
        c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
        e0, e1 = d00 + fy * (d01 - d00), d10 + fy * (d11 - d10)
        total += c0 + fz * (c1 - c0)
        scratch[9, n] = e0 + fz * (e1 - e0)
        scratch[10, n] = (c01 - c00) + fz * ((c11 - c10) - (c01 - c00))
        scratch[11, n] = c1 - c0
    return total


@numba.njit(fastmath=True)
def pull_back(first, step, number, to_index, scratch):
    """Derivative of every lane's value by its mean logarithm: rows 0..5 = (d (exp(V) x) / dV)^T gradient.

    The derivative of exp(V) x as it is written in :func:`warp`, of which the coefficients' slopes by t^2 are part.
    """
    first_x, first_y, first_z = first[0], first[1], first[2]
    step_x, step_y, step_z = step[0], step[1], step[2]
    m00, m01, m02 = to_index[0, 0], to_index[0, 1], to_index[0, 2]
    m10, m11, m12 = to_index[1, 0], to_index[1, 1], to_index[1, 2]
    m20, m21, m22 = to_index[2, 0], to_index[2, 1], to_index[2, 2]
    for n in range(LANES):
        s = _float(number + n)
        x, y, z = first_x + s * step_x, first_y + s * step_y, first_z + s * step_z
        wx, wy, wz = scratch[0, n], scratch[1, n], scratch[2, n]
        ux, uy, uz = scratch[3, n], scratch[4, n], scratch[5, n]
        gi, gj, gk = scratch[9, n], scratch[10, n], scratch[11, n]
        gx = m00 * gi + m10 * gj + m20 * gk
        gy = m01 * gi + m11 * gj + m21 * gk
        gz = m02 * gi + m12 * gj + m22 * gk
        t2 = wx * wx + wy * wy + wz * wz
        a, b, c = sinc(t2), versine(t2), cubic(t2)
        px, py, pz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
        qx, qy, qz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
        g_w, g_x, g_u = gx * wx + gy * wy + gz * wz, gx * x + gy * y + gz * z, gx * ux + gy * uy + gz * uz
        w_x, w_u = wx * x + wy * y + wz * z, wx * ux + wy * uy + wz * uz
        g_p, g_q = gx * px + gy * py + gz * pz, gx * qx + gy * qy + gz * qz
        along = (
            sinc_slope(t2) * g_p
            + versine_slope(t2) * (g_w * w_x - g_x * t2 + g_q)
            + cubic_slope(t2) * (g_w * w_u - g_u * t2)
            - b * g_x
            - c * g_u
        ) * _float(2)
        ax, ay, az = a * x + b * ux, a * y + b * uy, a * z + b * uz
        bx, by, bz = b * x + c * ux, b * y + c * uy, b * z + c * uz
        inward = b * w_x + c * w_u
        scratch[0, n] = along * wx + ay * gz - az * gy + inward * gx + g_w * bx
        scratch[1, n] = along * wy + az * gx - ax * gz + inward * gy + g_w * by
        scratch[2, n] = along * wz + ax * gy - ay * gx + inward * gz + g_w * bz
        keep, turn = _float(1) - c * t2, c * g_w
        scratch[3, n] = keep * gx + turn * wx - b * (wy * gz - wz * gy)
        scratch[4, n] = keep * gy + turn * wy - b * (wz * gx - wx * gz)
        scratch[5, n] = keep * gz + turn * wz - b * (wx * gy - wy * gx)


@numba.njit(fastmath=True)
def accumulate(weights, scratch, jacobian):
    """Add sum over lanes of weights (K, LANES) times rows 0..5 to jacobian (K, 6)."""
    for k in range(len(weights)):
        a, b, c, d, e, f = _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO
        for n in range(LANES):
            w = weights[k, n]
            a += w * scratch[0, n]
            b += w * scratch[1, n]
            c += w * scratch[2, n]
            d += w * scratch[3, n]
            e += w * scratch[4, n]
            f += w * scratch[5, n]
        jacobian[k, 0] += a
        jacobian[k, 1] += b
        jacobian[k, 2] += c
        jacobian[k, 3] += d
        jacobian[k, 4] += e
        jacobian[k, 5] += f
