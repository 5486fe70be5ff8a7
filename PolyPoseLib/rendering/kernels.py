"""Fused ray kernels for the CPU: one pass along every ray gives the line integral and what its Jacobian needs.

Compiled with numba on first use; callers go through :class:`PolyPoseLib.rendering.backend.NumbaBackend`.
All coordinates are voxel indices (i, j, k) of a volume that is padded with one layer of zeros, so that the
interpolant falls to zero continuously at the box.
"""

import math

import numba
import numpy as np


@numba.njit(inline="always", fastmath=True)
def _clip(origin, direction, near, far, size):
    """Clip the interval [near, far] of one coordinate to 0 .. size."""
    if abs(direction) < 1e-12:
        if origin <= 0.0 or origin >= size:
            return 1.0, 0.0
        return near, far
    first = (0.0 - origin) / direction
    second = (size - origin) / direction
    if first > second:
        first, second = second, first
    return max(near, first), min(far, second)


@numba.njit(parallel=True, fastmath=True, cache=True)
def project(volume, source, corner, per_column, per_row, inverse_intrinsics, step_mm, image):
    """Line integrals of a trilinear volume by the midpoint rule.

    volume: (D, H, W) float32, zero on its border; source, corner, per_column, per_row: (3,) float64, so that a
    pixel (c, r) looks from ``source`` along ``corner + c per_column + r per_row`` (index units per mm of depth);
    image: (rows, columns) float32, overwritten.
    """
    depth, height, width = volume.shape
    rows, columns = image.shape
    for row in numba.prange(rows):
        for column in range(columns):
            dx = corner[0] + column * per_column[0] + row * per_row[0]
            dy = corner[1] + column * per_column[1] + row * per_row[1]
            dz = corner[2] + column * per_column[2] + row * per_row[2]
            u = inverse_intrinsics[0, 0] * column + inverse_intrinsics[0, 1] * row + inverse_intrinsics[0, 2]
            v = inverse_intrinsics[1, 1] * row + inverse_intrinsics[1, 2]
            stretch = math.sqrt(u * u + v * v + 1.0)
            ds = step_mm / stretch
            near, far = _clip(source[0], dx, 0.0, 1e9, width - 1.0)
            near, far = _clip(source[1], dy, near, far, height - 1.0)
            near, far = _clip(source[2], dz, near, far, depth - 1.0)
            total = np.float32(0.0)
            if far > near:
                first = math.ceil(near / ds - 0.5)
                count = int(math.floor(far / ds - 0.5)) - int(first) + 1
                s = (first + 0.5) * ds
                x = np.float32(source[0] + s * dx)
                y = np.float32(source[1] + s * dy)
                z = np.float32(source[2] + s * dz)
                sx = np.float32(ds * dx)
                sy = np.float32(ds * dy)
                sz = np.float32(ds * dz)
                for n in range(count):
                    px = x + n * sx
                    py = y + n * sy
                    pz = z + n * sz
                    i = min(max(int(px), 0), width - 2)
                    j = min(max(int(py), 0), height - 2)
                    k = min(max(int(pz), 0), depth - 2)
                    fx = px - np.float32(i)
                    fy = py - np.float32(j)
                    fz = pz - np.float32(k)
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


@numba.njit(parallel=True, fastmath=True, cache=True)
def project_with_moments(
    volume, source, corner, per_column, per_row, inverse_intrinsics, step_mm, image, moments
):
    """As :func:`project`, with the moments from which the Jacobian of a rigid motion follows.

    moments: (rows, columns, 6) float32 receives the integral of the volume's gradient in index units (3) and of
    depth times that gradient (3): a rigid motion displaces a point of the ray linearly in its depth, so these six
    numbers give all six partial derivatives.
    """
    depth, height, width = volume.shape
    rows, columns = image.shape
    for row in numba.prange(rows):
        for column in range(columns):
            dx = corner[0] + column * per_column[0] + row * per_row[0]
            dy = corner[1] + column * per_column[1] + row * per_row[1]
            dz = corner[2] + column * per_column[2] + row * per_row[2]
            u = inverse_intrinsics[0, 0] * column + inverse_intrinsics[0, 1] * row + inverse_intrinsics[0, 2]
            v = inverse_intrinsics[1, 1] * row + inverse_intrinsics[1, 2]
            stretch = math.sqrt(u * u + v * v + 1.0)
            ds = step_mm / stretch
            near, far = _clip(source[0], dx, 0.0, 1e9, width - 1.0)
            near, far = _clip(source[1], dy, near, far, height - 1.0)
            near, far = _clip(source[2], dz, near, far, depth - 1.0)
            total = np.float32(0.0)
            gx = np.float32(0.0)
            gy = np.float32(0.0)
            gz = np.float32(0.0)
            hx = np.float32(0.0)
            hy = np.float32(0.0)
            hz = np.float32(0.0)
            if far > near:
                first = math.ceil(near / ds - 0.5)
                count = int(math.floor(far / ds - 0.5)) - int(first) + 1
                s = (first + 0.5) * ds
                x = np.float32(source[0] + s * dx)
                y = np.float32(source[1] + s * dy)
                z = np.float32(source[2] + s * dz)
                sx = np.float32(ds * dx)
                sy = np.float32(ds * dy)
                sz = np.float32(ds * dz)
                for n in range(count):
                    px = x + n * sx
                    py = y + n * sy
                    pz = z + n * sz
                    i = min(max(int(px), 0), width - 2)
                    j = min(max(int(py), 0), height - 2)
                    k = min(max(int(pz), 0), depth - 2)
                    fx = px - np.float32(i)
                    fy = py - np.float32(j)
                    fz = pz - np.float32(k)
                    a00 = volume[k, j, i]
                    a01 = volume[k, j + 1, i]
                    a10 = volume[k + 1, j, i]
                    a11 = volume[k + 1, j + 1, i]
                    d00 = volume[k, j, i + 1] - a00
                    d01 = volume[k, j + 1, i + 1] - a01
                    d10 = volume[k + 1, j, i + 1] - a10
                    d11 = volume[k + 1, j + 1, i + 1] - a11
                    c00 = a00 + fx * d00
                    c01 = a01 + fx * d01
                    c10 = a10 + fx * d10
                    c11 = a11 + fx * d11
                    c0 = c00 + fy * (c01 - c00)
                    c1 = c10 + fy * (c11 - c10)
                    e0 = d00 + fy * (d01 - d00)
                    e1 = d10 + fy * (d11 - d10)
                    tx = e0 + fz * (e1 - e0)
                    ty = (c01 - c00) + fz * ((c11 - c10) - (c01 - c00))
                    tz = c1 - c0
                    total += c0 + fz * tz
                    gx += tx
                    gy += ty
                    gz += tz
                    m = np.float32(n)
                    hx += m * tx
                    hy += m * ty
                    hz += m * tz
                # depth of sample n is s + n ds: fold that in once a ray
                s32 = np.float32(s)
                ds32 = np.float32(ds)
                hx = s32 * gx + ds32 * hx
                hy = s32 * gy + ds32 * hy
                hz = s32 * gz + ds32 * hz
            weight = np.float32(step_mm)
            image[row, column] = total * weight
            moments[row, column, 0] = gx * weight
            moments[row, column, 1] = gy * weight
            moments[row, column, 2] = gz * weight
            moments[row, column, 3] = hx * weight
            moments[row, column, 4] = hy * weight
            moments[row, column, 5] = hz * weight
