"""The inverse of a displacement field at many points in one pass (numba, CPU)."""

import math

import numba
import numpy as np

from PolyPoseLib.compiled import compiled


@compiled(parallel=True)
def invert(points, vectors, to_nodes, tolerance, iterations, least_step, out, residual):
    """Fill out (N, 3) with displacements v for which v + u(y + v) is least, and residual (N,) with its length.

    Parameters
    ----------
    points
        (N, 3) float64 mm, y.
    vectors
        (d, h, w, 3) float32 mm, u at its nodes.
    to_nodes
        (3, 4) float64, mm to index (i, j, k).
    tolerance, iterations, least_step
        As PolyPoseLib.warp.inverse.invert_at.
    out, residual
        Filled, float64.

    """
    for n in numba.prange(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        a, b, c = _sample(vectors, to_nodes, x, y, z)
        vx, vy, vz = -a, -b, -c
        kx, ky, kz, ex, ey, ez = vx, vy, vz, 0.0, 0.0, 0.0
        best, step = np.inf, 1.0
        for _ in range(iterations):
            a, b, c = _sample(vectors, to_nodes, x + vx, y + vy, z + vz)
            a, b, c = a + vx, b + vy, c + vz
            size = math.sqrt(a * a + b * b + c * c)
            if size < best:
                best, kx, ky, kz, ex, ey, ez = size, vx, vy, vz, a, b, c
            else:
                step *= 0.5
            if best <= tolerance or step <= least_step:
                break
            vx, vy, vz = kx - step * ex, ky - step * ey, kz - step * ez
        out[n, 0], out[n, 1], out[n, 2] = kx, ky, kz
        residual[n] = best


@numba.njit
def _sample(vectors, to_nodes, x, y, z):
    """As ``PolyPoseLib.data.displacement_field.trilinear``, clamped to the grid."""
    depth, height, width = vectors.shape[:3]
    i = to_nodes[0, 0] * x + to_nodes[0, 1] * y + to_nodes[0, 2] * z + to_nodes[0, 3]
    j = to_nodes[1, 0] * x + to_nodes[1, 1] * y + to_nodes[1, 2] * z + to_nodes[1, 3]
    k = to_nodes[2, 0] * x + to_nodes[2, 1] * y + to_nodes[2, 2] * z + to_nodes[2, 3]
    i = min(max(i, 0.0), width - 1.0)
    j = min(max(j, 0.0), height - 1.0)
    k = min(max(k, 0.0), depth - 1.0)
    i0, j0, k0 = (
        max(min(int(i), width - 2), 0),
        max(min(int(j), height - 2), 0),
        max(min(int(k), depth - 2), 0),
    )
    i1, j1, k1 = min(i0 + 1, width - 1), min(j0 + 1, height - 1), min(k0 + 1, depth - 1)
    fi, fj, fk = i - i0, j - j0, k - k0
    first, second, third = 0.0, 0.0, 0.0
    for s in range(8):
        h = k1 if s & 4 else k0
        r = j1 if s & 2 else j0
        q = i1 if s & 1 else i0
        weight = (fk if s & 4 else 1 - fk) * (fj if s & 2 else 1 - fj) * (fi if s & 1 else 1 - fi)
        first += weight * vectors[h, r, q, 0]
        second += weight * vectors[h, r, q, 1]
        third += weight * vectors[h, r, q, 2]
    return first, second, third
