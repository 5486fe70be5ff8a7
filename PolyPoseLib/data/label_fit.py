"""How well labels fit the bone of a CT where they are, and mirrored or shifted.

On a coarse grid, each structure's mean bone signal inside is compared with that of a shell around it.  The difference,
summed over structures, is a correlation of the CT with one kernel, so that a Fourier transform gives it for all shifts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfftn, next_fast_len, rfftn
from scipy.ndimage import binary_dilation, find_objects

from PolyPoseLib.data.volume import Volume

BONE_WINDOW_HU = (0.0, 500.0)
"""Values are cut to this range: air and fat count as soft tissue, metal as bone."""

MOST_CELLS = 600_000
"""Of the coarse grid, which bounds time and memory whatever the CT's size."""

CELLS_ACROSS = 100
"""Cells along the diagonal of all labels."""

REACH_CELLS = 12
"""Shifts that are tried in each direction: about 50 mm in a pelvis, less where bones are small."""

GAP_CELLS, SHELL_CELLS = 2, 2
"""Cells left out around a structure, since labels may be a little too small, and thickness of the shell beyond."""

FEW_CELLS = 8
"""Structures or shells with less are not looked at."""

_FLIPS = ((), (2,), (1,), (0,), (1, 2))
"""Axes (k, j, i) along which the labels are mirrored in the trials; two at once is a half turn."""


@dataclass(frozen=True)
class LabelFit:
    """Bone signal inside minus around labels, in HU of the window, at two places.

    Attributes
    ----------
    own
        Of all structures where they are, give or take a cell.
    best
        Of all structures at the best place tried, which may be their own.
    noise
        Standard deviation of both where bone and labels have nothing to do with each other.
    flipped
        Axes (k, j, i) mirrored at the best place.
    shift_mm
        (3,) in LPS, from where the (mirrored) labels are to the best place.
    cell_mm
        Size of a cell, the resolution of the shift.
    structures_own, structures_best
        (K,) of every structure at both places; NaN where it was not looked at.

    """

    own: float
    best: float
    noise: float
    flipped: tuple[int, ...]
    shift_mm: np.ndarray
    cell_mm: float
    structures_own: np.ndarray
    structures_best: np.ndarray


@dataclass(frozen=True)
class _Kernel:
    """One structure's part: cells (N, 3) and weights (N,) that are positive inside, negative around, of sum 0."""

    cells: np.ndarray
    weights: np.ndarray
    inside: float


class CoarseScene:
    """A CT's bone and its labels on a grid of half a million cells or so.

    Parameters
    ----------
    ct
        Hounsfield units.
    labels
        (k, j, i) whole numbers on the CT's grid, n for the nth structure; one at least is not 0.
    count
        Structures.

    """

    def __init__(self, ct: Volume, labels: np.ndarray, count: int) -> None:
        boxes = find_objects(labels, max_label=count)
        self._factors = _block_size(ct, boxes)
        self._axes = ct.affine[:3, :3]
        self._cell_mm = ct.spacing[::-1] * self._factors
        self._bone = _block_means(ct.voxels, self._factors)
        self._shares = [
            None if box is None else _shares(labels, number, box, self._factors)
            for number, box in enumerate(boxes, start=1)
        ]
        self._taken = np.zeros(self._bone.shape, dtype=bool)
        for corner, share in filter(None, self._shares):
            end = corner + share.shape
            self._taken[tuple(map(slice, corner, end))] |= share > 0

    def fit(self, grown_cells: int = 0) -> LabelFit | None:
        """Compare the labels' place with mirrored and shifted ones; None when no structure has inside and surroundings.

        Parameters
        ----------
        grown_cells
            By how much the labels are thickened first.  The middle of a bone is less dense than its surface, to which
            labels that are far too small are drawn; thickened ones are not.

        """
        kernels = [
            None if each is None else _kernel(*each, self._taken, grown_cells) for each in self._shares
        ]
        used = [each for each in kernels if each is not None]
        if not used:
            return None
        around = np.concatenate([self._bone[tuple(each.cells[each.weights < 0].T)] for each in used])
        bone = self._bone - around.mean()
        shares = np.sqrt([0.0 if each is None else each.inside for each in kernels])
        shares /= shares.sum()
        kernel = np.zeros_like(bone)
        for each, share in zip(kernels, shares, strict=True):
            if each is not None:
                kernel[tuple(each.cells.T)] += share * each.weights
        reach = np.round(REACH_CELLS * np.prod(self._cell_mm) ** (1 / 3) / self._cell_mm).astype(int)
        reach = np.minimum(np.maximum(2, reach), np.array(bone.shape) - 1)
        here, own, flips, shift, best = _search(bone, kernel, reach)
        return LabelFit(
            own=own,
            best=best,
            noise=float(bone.std() * np.linalg.norm(kernel)),
            flipped=flips,
            shift_mm=self._axes @ (shift * self._factors)[::-1],
            cell_mm=float(self._cell_mm.max()),
            structures_own=_each(bone, kernels, (), here),
            structures_best=_each(bone, kernels, flips, shift),
        )


def _block_size(ct: Volume, boxes: Sequence[tuple[slice, ...] | None]) -> np.ndarray:
    """(3,) voxels along (k, j, i) that become one cell."""
    spacing = ct.spacing[::-1]
    used = [box for box in boxes if box is not None]
    low = np.min([[part.start for part in box] for box in used], axis=0)
    high = np.max([[part.stop for part in box] for box in used], axis=0)
    cell = max(
        np.linalg.norm((high - low) * spacing) / CELLS_ACROSS,
        (ct.voxels.size * np.prod(spacing) / MOST_CELLS) ** (1 / 3),
    )
    return np.maximum(1, np.floor(cell / spacing + 1e-6)).astype(int)


def _block_means(voxels: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """Means over blocks of voxels in the bone window, float32; one layer of blocks at a time to save memory."""
    layers = []
    for first in range(0, len(voxels), factors[0]):
        layer = np.clip(voxels[first : first + factors[0]], *BONE_WINDOW_HU).mean(axis=0, dtype=np.float32)
        layers.append(_mean_along(_mean_along(layer, 0, factors[1]), 1, factors[2]))
    return np.stack(layers)


def _mean_along(values: np.ndarray, axis: int, factor: int) -> np.ndarray:
    """Means of each factor values along an axis; the last may be of fewer."""
    starts = np.arange(0, values.shape[axis], factor)
    counts = np.minimum(factor, values.shape[axis] - starts).astype(np.float32)
    shape = [-1 if each == axis else 1 for each in range(values.ndim)]
    return np.add.reduceat(values, starts, axis=axis, dtype=np.float32) / counts.reshape(shape)


def _shares(
    labels: np.ndarray, number: int, box: tuple[slice, ...], factors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The first cell (3,) of a structure's box and the share of each cell that it fills."""
    corner = np.array([part.start for part in box]) // factors
    end = -(-np.array([part.stop for part in box]) // factors)
    share = (labels[tuple(map(slice, corner * factors, end * factors))] == number).astype(np.float32)
    for axis, factor in enumerate(factors):
        share = _mean_along(share, axis, factor)
    return corner, share


def _kernel(corner: np.ndarray, share: np.ndarray, taken: np.ndarray, grown_cells: int) -> _Kernel | None:
    """The kernel of a structure from the share of cells that it fills; cells of any structure are no surroundings."""
    margin = GAP_CELLS + SHELL_CELLS + grown_cells
    padded = np.pad(share, margin)
    if grown_cells:
        padded = binary_dilation(padded > 0, iterations=grown_cells).astype(np.float32)
    near = binary_dilation(padded > 0, iterations=GAP_CELLS)
    shell = np.asarray(binary_dilation(near, iterations=SHELL_CELLS)) & np.logical_not(near)
    inside, around = (
        _within(np.argwhere(each) + (corner - margin), taken.shape) for each in (padded > 0, shell)
    )
    around = around[~taken[tuple(around.T)]]
    filled = padded[tuple((inside - (corner - margin)).T)]
    total = float(filled.sum())
    if total < FEW_CELLS or len(around) < FEW_CELLS:
        return None
    weights = np.concatenate([filled / total, np.full(len(around), -1 / len(around), np.float32)])
    return _Kernel(np.concatenate([inside, around]), weights, total)


def _within(cells: np.ndarray, shape: Sequence[int]) -> np.ndarray:
    """The cells (N, 3) that are in the grid."""
    return cells[((cells >= 0) & (cells < shape)).all(axis=1)]


def _search(
    bone: np.ndarray, kernel: np.ndarray, reach: np.ndarray
) -> tuple[np.ndarray, float, tuple[int, ...], np.ndarray, float]:
    """The shift in cells and value of the best place within a cell, and flips, shift and value of the best of all."""
    size = [next_fast_len(int(n + r), real=True) for n, r in zip(bone.shape, reach, strict=True)]
    spectrum = np.asarray(rfftn(bone, size))
    ranges = np.ix_(*(np.arange(-r, r + 1) for r in reach))
    here, own, found = np.zeros(3, int), 0.0, []
    for flips in _FLIPS:
        turned = np.flip(kernel, flips) if flips else kernel
        product = spectrum * np.asarray(rfftn(turned, size)).conj()
        values = np.asarray(irfftn(product, size))[ranges]
        if not flips:
            near = values[tuple(slice(max(0, r - 1), r + 2) for r in reach)]
            here = np.array(np.unravel_index(np.argmax(near), near.shape)) - np.minimum(1, reach)
            own = float(near.max())
        peak = np.unravel_index(np.argmax(values), values.shape)
        found.append((float(values[peak]), flips, np.array(peak) - reach))
    best, flips, shift = max(found, key=lambda each: each[0])
    return here, own, flips, shift, best


def _each(
    bone: np.ndarray, kernels: Sequence[_Kernel | None], flips: tuple[int, ...], shift: np.ndarray
) -> np.ndarray:
    """(K,) every structure's value at a place."""
    shape = np.array(bone.shape)
    values = np.full(len(kernels), np.nan)
    for number, kernel in enumerate(kernels):
        if kernel is None:
            continue
        cells = kernel.cells.copy()
        for axis in flips:
            cells[:, axis] = shape[axis] - 1 - cells[:, axis]
        cells += shift
        inside = ((cells >= 0) & (cells < shape)).all(axis=1)
        values[number] = bone[tuple(cells[inside].T)] @ kernel.weights[inside]
    return values
