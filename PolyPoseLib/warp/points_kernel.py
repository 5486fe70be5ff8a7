"""The polyrigid warp of many points in one pass: distances, weights, mean logarithm and exponential (numba, CPU)."""

import math

import numba
import numpy as np

from PolyPoseLib.compiled import compiled
from PolyPoseLib.geometry.exponential_kernel import cubic, sinc, versine
from PolyPoseLib.warp.weight_kernel import raw_weight

_float = np.float32


@compiled(parallel=True, fastmath=True)
def displace(points, maps, to_grid, spacing, share, form, constant, travel, poses, logs, shifts, reach2, out):
    """Fill out (N, 3) with the displacements in mm of points (N, 3).

    All floats are float32, all points relative to the centre about which logarithms are taken.

    Parameters
    ----------
    points
        (N, 3) fixed.
    maps
        (K, d, h, w) signed distances, two nodes or more along every axis.
    to_grid
        (3, 4), mm to the maps' index.
    spacing
        (3,) mm along (i, j, k).
    share
        (K,).
    form, constant
        See raw_weight.
    travel
        Whether distances are measured at T_k x.
    poses
        (K, 3, 4), the T_k.
    logs
        (K, 6).
    shifts
        (K, 3) of the centroids.
    reach2
        Squared distance in mm^2 at which tissue takes half of a bone's rotation.
    out
        (N, 3), filled.

    """
    structures = len(logs)
    for n in numba.prange(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        i, j, h = _to_index(to_grid, x, y, z)
        total = _float(0)
        wx, wy, wz, ux, uy, uz = _float(0), _float(0), _float(0), _float(0), _float(0), _float(0)
        for k in range(structures):
            if travel:
                pose = poses[k]
                a = pose[0, 0] * x + pose[0, 1] * y + pose[0, 2] * z + pose[0, 3]
                b = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2] * z + pose[1, 3]
                c = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2] * z + pose[2, 3]
                i, j, h = _to_index(to_grid, a, b, c)
            distance = _distance(maps[k], i, j, h, spacing)
            weight = raw_weight(form, share[k], distance, constant)
            total += weight
            rotating = weight * reach2 / (reach2 + distance * distance)
            shifted = weight - rotating
            wx += rotating * logs[k, 0]
            wy += rotating * logs[k, 1]
            wz += rotating * logs[k, 2]
            ux += rotating * logs[k, 3] + shifted * shifts[k, 0]
            uy += rotating * logs[k, 4] + shifted * shifts[k, 1]
            uz += rotating * logs[k, 5] + shifted * shifts[k, 2]
        scale = _float(1) / total
        wx, wy, wz, ux, uy, uz = wx * scale, wy * scale, wz * scale, ux * scale, uy * scale, uz * scale
        # exp(V) x - x, as in PolyPoseLib.warp.polyrigid.apply_exp.
        t2 = wx * wx + wy * wy + wz * wz
        a, b, c = sinc(t2), versine(t2), cubic(t2)
        px, py, pz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x
        qx, qy, qz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
        tx, ty, tz = b * px + c * qx, b * py + c * qy, b * pz + c * qz
        out[n, 0] = a * px + ux + b * qx + wy * tz - wz * ty
        out[n, 1] = a * py + uy + b * qy + wz * tx - wx * tz
        out[n, 2] = a * pz + uz + b * qz + wx * ty - wy * tx


@numba.njit(fastmath=True)
def _to_index(to_grid, x, y, z):
    return (
        to_grid[0, 0] * x + to_grid[0, 1] * y + to_grid[0, 2] * z + to_grid[0, 3],
        to_grid[1, 0] * x + to_grid[1, 1] * y + to_grid[1, 2] * z + to_grid[1, 3],
        to_grid[2, 0] * x + to_grid[2, 1] * y + to_grid[2, 2] * z + to_grid[2, 3],
    )


@numba.njit(fastmath=True)
def _distance(signed, x, y, z, spacing):
    """As ``weights.DistanceMaps``: trilinear at index (x, y, z), at least 0, plus the distance to the grid's box."""
    depth, height, width = signed.shape
    zero = _float(0)
    at_x = min(max(x, zero), _float(width - 1))
    at_y = min(max(y, zero), _float(height - 1))
    at_z = min(max(z, zero), _float(depth - 1))
    i, j, h = min(int(at_x), width - 2), min(int(at_y), height - 2), min(int(at_z), depth - 2)
    fx, fy, fz = at_x - _float(i), at_y - _float(j), at_z - _float(h)
    c00 = signed[h, j, i] + fx * (signed[h, j, i + 1] - signed[h, j, i])
    c01 = signed[h, j + 1, i] + fx * (signed[h, j + 1, i + 1] - signed[h, j + 1, i])
    c10 = signed[h + 1, j, i] + fx * (signed[h + 1, j, i + 1] - signed[h + 1, j, i])
    c11 = signed[h + 1, j + 1, i] + fx * (signed[h + 1, j + 1, i + 1] - signed[h + 1, j + 1, i])
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    value = max(c0 + fz * (c1 - c0), zero)
    if x != at_x or y != at_y or z != at_z:
        ox, oy, oz = (x - at_x) * spacing[0], (y - at_y) * spacing[1], (z - at_z) * spacing[2]
        value += math.sqrt(ox * ox + oy * oy + oz * oz)
    return value
