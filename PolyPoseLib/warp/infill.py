"""Smooth values for the unknown part of an image: the harmonic function that meets the known values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SWEEPS = 12
"""Relaxation sweeps per level; the level above starts from the coarser level's answer."""

_COARSEST = 2


@dataclass
class _Level:
    """One level: values, where they are known, where they are to be found, spacing (k, j, i) mm."""

    values: np.ndarray
    known: np.ndarray
    wanted: np.ndarray
    spacing: np.ndarray


def fill_harmonic(
    values: np.ndarray, wanted: np.ndarray, ignored: np.ndarray | None, spacing: np.ndarray
) -> np.ndarray:
    """Replace the wanted voxels by the solution of Laplace's equation with the known ones as boundary values.

    Cascadic multigrid: every axis is halved until nothing is unknown; from there each level starts from the
    interpolated coarser one and is relaxed by Gauss-Seidel sweeps in two colours.

    Parameters
    ----------
    values : (k, j, i) array
        Any unit.
    wanted : (k, j, i) array of bool
        Voxels to fill.
    ignored : (k, j, i) array of bool, optional
        Voxels that keep their value and do not influence others; None for none.
    spacing : (3,) array
        mm along (i, j, k).

    Returns
    -------
    (k, j, i) array of float32
        Values outside wanted, smooth inside. Values stay within the range of the known ones; without any known
        voxel the wanted ones become 0.

    References
    ----------
    F. Bornemann and P. Deuflhard, "The cascadic multigrid method for elliptic problems", Numerische Mathematik 75,
    1996.

    """
    filled = np.array(values, dtype=np.float32)
    if not wanted.any():
        return filled
    known = ~wanted if ignored is None else ~(wanted | ignored)
    finest = _Level(filled, known, wanted, np.asarray(spacing, dtype=np.float64)[::-1])
    levels = [finest]
    while levels[-1].wanted.any() and max(levels[-1].values.shape) > _COARSEST:
        levels.append(_coarser(levels[-1]))
    coarsest = levels[-1]
    mean = coarsest.values[coarsest.known].mean() if coarsest.known.any() else 0.0
    coarsest.values[coarsest.wanted] = mean
    for fine, coarse in zip(levels[-2::-1], levels[:0:-1], strict=True):
        _interpolate(fine, coarse)
        _relax(fine)
    return filled


def _coarser(level: _Level) -> _Level:
    """Blocks of up to 2 x 2 x 2 voxels averaged over what is known; thick axes wait for the others."""
    factor = np.where(level.spacing < 1.5 * level.spacing.min(), 2, 1)
    factor = np.where(np.array(level.values.shape) > 1, factor, 1)
    if (factor == 1).all():
        factor = np.where(np.array(level.values.shape) > 1, 2, 1)
    total = _block_sum(np.where(level.known, level.values, np.float32(0)), factor)
    count = _block_sum(level.known.astype(np.float32), factor)
    known = count > 0
    values = np.divide(total, count, out=np.zeros_like(total), where=known)
    return _Level(values, known, ~known, level.spacing * factor)


def _block_sum(array: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """Sums over blocks of factor (k, j, i) voxels; an incomplete last block counts as it is."""
    for axis, size in enumerate(factor):
        if size == 2:
            even = np.take(array, np.arange(0, array.shape[axis], 2), axis)
            odd = np.take(array, np.arange(1, array.shape[axis], 2), axis)
            part = [slice(None)] * 3
            part[axis] = slice(0, odd.shape[axis])
            even[tuple(part)] += odd
            array = even
    return array


def _interpolate(fine: _Level, coarse: _Level) -> None:
    """Start the wanted voxels of a level from the coarser one, trilinear between its blocks' centres."""
    place = np.nonzero(fine.wanted)
    factor = np.round(coarse.spacing / fine.spacing)
    result = np.zeros(len(place[0]), dtype=np.float32)
    ends = []
    for axis in range(3):
        last = coarse.values.shape[axis] - 1
        position = np.clip((place[axis] + 0.5) / factor[axis] - 0.5, 0, last)
        low = np.minimum(position.astype(np.int64), max(last - 1, 0))
        fraction = (position - low).astype(np.float32)
        ends.append(((low, 1 - fraction), (np.minimum(low + 1, last), fraction)))
    for k, weight_k in ends[0]:
        for j, weight_j in ends[1]:
            for i, weight_i in ends[2]:
                result += coarse.values[k, j, i] * (weight_k * weight_j * weight_i)
    fine.values[place] = result


def _relax(level: _Level) -> None:
    """Gauss-Seidel sweeps in two colours; the array's walls and ignored voxels let nothing through."""
    shape = level.values.shape
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    flat = level.values.reshape(-1)
    usable = (level.known | level.wanted).reshape(-1)
    place = np.nonzero(level.wanted)
    colour = (place[0] + place[1] + place[2]) & 1
    sets = []
    for wanted in (0, 1):
        chosen = colour == wanted
        index = [axis[chosen] for axis in place]
        target = index[0] * strides[0] + index[1] * strides[1] + index[2]
        weights = []
        for axis in range(3):
            for sign in (-1, 1):
                inside = (index[axis] + sign >= 0) & (index[axis] + sign < shape[axis])
                neighbour = np.where(inside, target + sign * strides[axis], target)
                open_ = inside & usable[neighbour]
                weights.append(open_.astype(np.float32) / np.float32(level.spacing[axis] ** 2))
        total = np.sum(weights, axis=0)
        reachable = total > 0
        sets.append((target[reachable], [w[reachable] / total[reachable] for w in weights]))
    offsets = [sign * stride for stride in strides for sign in (-1, 1)]
    for _ in range(SWEEPS):
        for target, weights in sets:
            mean = np.zeros(len(target), dtype=np.float32)
            for offset, weight in zip(offsets, weights, strict=True):
                # A neighbour beyond the array has weight 0; any voxel may stand in for it.
                mean += weight * flat.take(target + offset, mode="clip")
            flat[target] = mean
