"""Where a volume is not zero: small blocks of voxels that keep rays from sampling emptiness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SMALLEST_EDGE = 4
"""Voxels along the edge of the finest blocks."""

MOST_BLOCKS = 4096
"""Blocks are made larger until no more than these hold anything."""


@dataclass(frozen=True)
class OccupiedBlocks:
    """Cubes in voxel indices (i, j, k) outside of which the trilinear interpolant of a volume is zero.

    Attributes
    ----------
    centres : (M, 3) array of float64
        Indices (i, j, k) of their centres.
    half_edge : float
        Half the edge of each, in voxels.

    """

    centres: np.ndarray
    half_edge: float


def occupied_blocks(voxels: np.ndarray) -> OccupiedBlocks:
    """Blocks of voxels (D, H, W) in which the interpolant is anywhere other than zero.

    Blocks share their faces: one that begins at index 4 and is 4 wide depends on the voxels from 4 to 8.
    """
    edge = SMALLEST_EDGE
    occupied = _any_in_blocks(voxels != 0, edge)
    while np.count_nonzero(occupied) > MOST_BLOCKS:
        edge *= 2
        for axis in range(3):  # a block twice as wide holds what either of its halves holds
            occupied = np.logical_or.reduceat(occupied, np.arange(0, occupied.shape[axis], 2), axis=axis)
    first = np.stack(np.nonzero(occupied)[::-1], axis=-1) * float(edge)
    return OccupiedBlocks(first + edge / 2, edge / 2)


def _any_in_blocks(filled: np.ndarray, edge: int) -> np.ndarray:
    """Whether any of the edge + 1 voxels a side that each block depends on is filled."""
    for axis in range(3):
        starts = np.arange(0, filled.shape[axis], edge)
        inside = np.logical_or.reduceat(filled, starts, axis=axis)
        next_first = np.take(filled, starts[1:], axis=axis)
        beyond = np.zeros_like(inside)
        beyond[tuple(slice(0, -1) if a == axis else slice(None) for a in range(3))] = next_first
        filled = inside | beyond
    return filled
