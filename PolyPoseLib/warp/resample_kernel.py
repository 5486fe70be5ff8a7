"""Volumes and label maps seen through a displacement field, voxel by voxel (numba, CPU).

Arguments that all functions share: vectors (d, h, w, 3) float32, the field in mm; to_field, to_moving: (3, 4) float64,
from the index (i, j, k) of the output to the field's and to the moving volume's; turn: (3, 3) float64, from mm to the
moving volume's index. Beyond the field its nearest displacement is taken.
"""

import numba
import numpy as np

from PolyPoseLib.compiled import compiled

TIE = 1e-9
"""Shares of labels that differ by less are equal."""


@compiled(parallel=True)
def warp_linear(volume, vectors, to_field, to_moving, turn, outside, out):
    """Fill out (K, J, I) float32 from volume (D, H, W) float32, trilinear; half a voxel around it its border holds."""
    depth, height, width = volume.shape
    for k in numba.prange(out.shape[0]):
        for j in range(out.shape[1]):
            for i in range(out.shape[2]):
                x, y, z = _moving_index(vectors, to_field, to_moving, turn, i, j, k)
                if not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5 and -0.5 <= z < depth - 0.5):
                    out[k, j, i] = outside
                    continue
                a, at, fx = _cell(x, width)
                b, bt, fy = _cell(y, height)
                c, ct, fz = _cell(z, depth)
                c00 = volume[c, b, a] + fx * (volume[c, b, at] - volume[c, b, a])
                c01 = volume[c, bt, a] + fx * (volume[c, bt, at] - volume[c, bt, a])
                c10 = volume[ct, b, a] + fx * (volume[ct, b, at] - volume[ct, b, a])
                c11 = volume[ct, bt, a] + fx * (volume[ct, bt, at] - volume[ct, bt, a])
                c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
                out[k, j, i] = c0 + fz * (c1 - c0)


@compiled(parallel=True)
def warp_votes(labels, vectors, to_field, to_moving, turn, out):
    """Fill out (K, J, I) with the labels of largest trilinear weight, as ``vote.LabelVote`` finds them."""
    depth, height, width = labels.shape
    for k in numba.prange(out.shape[0]):
        found = np.empty(8, labels.dtype)
        share = np.empty(8, np.float64)
        for j in range(out.shape[1]):
            for i in range(out.shape[2]):
                x, y, z = _moving_index(vectors, to_field, to_moving, turn, i, j, k)
                if not (-0.5 < x < width - 0.5 and -0.5 < y < height - 0.5 and -0.5 < z < depth - 0.5):
                    out[k, j, i] = 0
                    continue
                a, at, fx = _cell(x, width)
                b, bt, fy = _cell(y, height)
                c, ct, fz = _cell(z, depth)
                mixed = False
                for corner in range(8):
                    found[corner] = labels[
                        ct if corner & 4 else c, bt if corner & 2 else b, at if corner & 1 else a
                    ]
                    mixed |= found[corner] != found[0]
                if not mixed:
                    out[k, j, i] = found[0]
                    continue
                for corner in range(8):
                    by_x = fx if corner & 1 else 1 - fx
                    by_y = fy if corner & 2 else 1 - fy
                    by_z = fz if corner & 4 else 1 - fz
                    share[corner] = by_x * by_y * by_z
                out[k, j, i] = _winner(found, share)


@numba.njit
def _winner(found, share):
    """The label of the largest sum of shares (8,); of equal ones the smallest."""
    best, winner = -1.0, found[0]
    for candidate in found:
        score = 0.0
        for corner in range(8):
            if found[corner] == candidate:
                score += share[corner]
        if score > best + TIE or (abs(score - best) < TIE and candidate < winner):
            best, winner = score, candidate
    return winner


@numba.njit
def _moving_index(vectors, to_field, to_moving, turn, i, j, k):
    """Index (x, y, z) of the moving volume where an output voxel looks."""
    depth, height, width, _ = vectors.shape
    a, at, fx = _cell(to_field[0, 0] * i + to_field[0, 1] * j + to_field[0, 2] * k + to_field[0, 3], width)
    b, bt, fy = _cell(to_field[1, 0] * i + to_field[1, 1] * j + to_field[1, 2] * k + to_field[1, 3], height)
    c, ct, fz = _cell(to_field[2, 0] * i + to_field[2, 1] * j + to_field[2, 2] * k + to_field[2, 3], depth)
    u = _mean(vectors, 0, a, at, fx, b, bt, fy, c, ct, fz)
    v = _mean(vectors, 1, a, at, fx, b, bt, fy, c, ct, fz)
    w = _mean(vectors, 2, a, at, fx, b, bt, fy, c, ct, fz)
    x = to_moving[0, 0] * i + to_moving[0, 1] * j + to_moving[0, 2] * k + to_moving[0, 3]
    y = to_moving[1, 0] * i + to_moving[1, 1] * j + to_moving[1, 2] * k + to_moving[1, 3]
    z = to_moving[2, 0] * i + to_moving[2, 1] * j + to_moving[2, 2] * k + to_moving[2, 3]
    x += turn[0, 0] * u + turn[0, 1] * v + turn[0, 2] * w
    y += turn[1, 0] * u + turn[1, 1] * v + turn[1, 2] * w
    z += turn[2, 0] * u + turn[2, 1] * v + turn[2, 2] * w
    return x, y, z


@numba.njit
def _mean(vectors, n, a, at, fx, b, bt, fy, c, ct, fz):
    """Trilinear mean of component n of the vectors."""
    c00 = vectors[c, b, a, n] + fx * (vectors[c, b, at, n] - vectors[c, b, a, n])
    c01 = vectors[c, bt, a, n] + fx * (vectors[c, bt, at, n] - vectors[c, bt, a, n])
    c10 = vectors[ct, b, a, n] + fx * (vectors[ct, b, at, n] - vectors[ct, b, a, n])
    c11 = vectors[ct, bt, a, n] + fx * (vectors[ct, bt, at, n] - vectors[ct, bt, a, n])
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    return c0 + fz * (c1 - c0)


@numba.njit
def _cell(place, size):
    """The two neighbours of a place along an axis, clamped to it, and its fraction of the distance to the second."""
    place = min(max(place, 0.0), size - 1.0)
    low = min(int(place), max(size - 2, 0))
    return low, min(low + 1, size - 1), place - low
