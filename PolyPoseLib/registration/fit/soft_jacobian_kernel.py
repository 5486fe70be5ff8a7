"""The derivative of the soft tissue's line integrals in one pass along every ray (numba, CPU)."""

import math

import numba
import numpy as np

from PolyPoseLib.compiled import compiled


@compiled(parallel=True, fastmath=True)
def add_changes(rays, tissue, modes, changes):
    """Derivatives by the coefficients of M modes.

    Parameters
    ----------
    rays
        :class:`PolyPoseLib.registration.fit.soft_kernel_arguments.SegmentedRays` of P pixels.
    tissue
        :class:`PolyPoseLib.registration.fit.soft_kernel_arguments.DisplacedTissue`.
    modes
        :class:`PolyPoseLib.registration.fit.soft_kernel_arguments.CosineTables`.
    changes
        (M, 3, P) float32 of zeros, filled.

    """
    pixels, count = len(rays.near), len(modes.numbers)
    most = max(modes.numbers.max() + 1, 2)
    length = rays.step_mm * rays.per_segment
    for pixel in numba.prange(pixels):
        near, far = rays.near[pixel], rays.far[pixel]
        if far <= near:
            continue
        x, y, z = rays.directions[pixel, 0], rays.directions[pixel, 1], rays.directions[pixel, 2]
        sums = np.zeros((count, 3))
        cosines = np.empty((3, most))
        for segment in range(
            int(math.floor((near - rays.first) / length)), int(math.ceil((far - rays.first) / length))
        ):
            begin = rays.first + segment * length
            gx, gy, gz = 0.0, 0.0, 0.0
            for n in range(rays.per_segment):
                depth = begin + (n + 0.5) * rays.step_mm
                if depth < near or depth > far:
                    continue
                a, b, c, share = _gradient(
                    tissue, rays.source[0] + depth * x, rays.source[1] + depth * y, rays.source[2] + depth * z
                )
                gx += a * share
                gy += b * share
                gz += c * share
            gx, gy, gz = gx * rays.step_mm, gy * rays.step_mm, gz * rays.step_mm
            if max(abs(gx), abs(gy), abs(gz)) <= rays.negligible:
                continue
            middle = begin + length / 2
            _fill_cosines(
                modes,
                rays.source[0] + middle * x,
                rays.source[1] + middle * y,
                rays.source[2] + middle * z,
                cosines,
            )
            for m in range(count):
                value = (
                    cosines[0, modes.numbers[m, 0]]
                    * cosines[1, modes.numbers[m, 1]]
                    * cosines[2, modes.numbers[m, 2]]
                )
                sums[m, 0] += value * gx
                sums[m, 1] += value * gy
                sums[m, 2] += value * gz
        for m in range(count):
            for axis in range(3):
                changes[m, axis, pixel] = sums[m, axis]


@numba.njit(inline="always", fastmath=True)
def _place(affine, x, y, z):
    """A point under an affine map (3, 4)."""
    return (
        affine[0, 0] * x + affine[0, 1] * y + affine[0, 2] * z + affine[0, 3],
        affine[1, 0] * x + affine[1, 1] * y + affine[1, 2] * z + affine[1, 3],
        affine[2, 0] * x + affine[2, 1] * y + affine[2, 2] * z + affine[2, 3],
    )


@numba.njit(inline="always", fastmath=True)
def _nearest(position, count):
    """Index of the nearest of `count` nodes."""
    return min(max(int(np.rint(position)), 0), count - 1)


@numba.njit(fastmath=True)
def _gradient(tissue, x, y, z):
    """Gradient (3) of the attenuation that a fixed point shows, and the share of the modes there."""
    i, j, k = _place(tissue.to_node, x, y, z)
    nodes_k, nodes_j, nodes_i = tissue.freedom.shape
    i, j, k = _nearest(i, nodes_i), _nearest(j, nodes_j), _nearest(k, nodes_k)
    moved = tissue.vectors[k, j, i]
    share = tissue.freedom[k, j, i]
    a, b, c = _place(tissue.to_index, x + moved[0], y + moved[1], z + moved[2])
    depth, height, width = tissue.gradient.shape[:3]
    a, b, c = np.rint(a), np.rint(b), np.rint(c)
    if a < 0 or b < 0 or c < 0 or a >= width or b >= height or c >= depth:
        return np.float32(0.0), np.float32(0.0), np.float32(0.0), share
    slope = tissue.gradient[int(c), int(b), int(a)]
    return slope[0], slope[1], slope[2], share


@numba.njit(fastmath=True)
def _fill_cosines(modes, x, y, z, cosines):
    """Cosines (3, N) of all multiples of the angle along each axis, by their recurrence."""
    angles = _place(modes.to_angles, x, y, z)
    for axis in range(3):
        once = math.cos(angles[axis])
        cosines[axis, 0] = 1.0
        cosines[axis, 1] = once
        for n in range(2, cosines.shape[1]):
            cosines[axis, n] = 2.0 * once * cosines[axis, n - 1] - cosines[axis, n - 2]
