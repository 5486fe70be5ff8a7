"""Closed contours around the regions of a mask: the opposite of :mod:`PolyPoseLib.geometry.contours`."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from PolyPoseLib.geometry.grid import connected_components

_MIDDLES = np.array([(0.0, -0.5), (0.5, 0.0), (0.0, 0.5), (-0.5, 0.0)])
"""From a pixel's centre to the middles of its sides (x, y): top, right, bottom, left, as one goes round."""


def outlines(mask: np.ndarray) -> list[np.ndarray]:
    """One contour for each region of a mask, halfway between the pixels inside and those outside.

    Pixels that touch at a corner alone are regions of their own. A hole is joined to the contour by a keyhole, a line
    that runs in and back out, which every reader of planar contours understands.

    Parameters
    ----------
    mask : (H, W) bool array
        The regions.

    Returns
    -------
    list of (N, 2) arrays
        Pixels (x, y), whole numbers at their centres; the last point is joined to the first.

    """
    inside = np.pad(np.asarray(mask, dtype=bool), 1)
    regions, _ = connected_components(inside)
    side, rows, columns = _sides(inside)
    following = _following(inside, side, rows, columns).tolist()
    middles = np.column_stack([columns, rows]) - 1 + _MIDDLES[side]
    loops: dict[int, list[np.ndarray]] = {}
    seen = np.zeros(len(side), bool)
    for first in range(len(side)):
        if seen[first]:
            continue
        chain, at = [], first
        while not seen[at]:
            seen[at] = True
            chain.append(at)
            at = following[at]
        loops.setdefault(int(regions[rows[first], columns[first]]), []).append(_corners(middles[chain]))
    return [_joined(each) for each in loops.values()]


def _sides(inside: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sides between a pixel inside and one outside: which side of the pixel inside, its row and its column."""
    outside = ~inside
    around = [np.roll(outside, shift, axis) for shift, axis in ((1, 0), (-1, 1), (-1, 0), (1, 1))]
    side, rows, columns = np.nonzero(np.stack(around) & inside)
    return side, rows, columns


def _following(inside: np.ndarray, side: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """The number of the side that follows each, with the inside always at the same hand."""
    numbers = np.full((4, *inside.shape), -1)
    numbers[side, rows, columns] = np.arange(len(side))
    ahead = np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])[side]  # (row, column) along the side
    out = np.array([(-1, 0), (0, 1), (1, 0), (0, -1)])[side]  # across it, to the outside
    next_rows, next_columns = rows + ahead[:, 0], columns + ahead[:, 1]
    beyond_rows, beyond_columns = next_rows + out[:, 0], next_columns + out[:, 1]
    next_inside = inside[next_rows, next_columns]
    beyond = next_inside & inside[beyond_rows, beyond_columns]
    turning = numbers[(side + 1) % 4, rows, columns]
    straight = numbers[side, next_rows, next_columns]
    back = numbers[(side - 1) % 4, beyond_rows, beyond_columns]
    return np.where(beyond, back, np.where(next_inside, straight, turning))


def _corners(points: np.ndarray) -> np.ndarray:
    """A loop without the points between its corners."""
    step = np.roll(points, -1, axis=0) - points
    return points[(step != np.roll(step, 1, axis=0)).any(axis=1)]


def _joined(loops: list[np.ndarray]) -> np.ndarray:
    """The outer loop of a region with its holes, the nearest first, so that no keyhole crosses another hole."""
    whole = max(loops, key=_area)
    holes = [each for each in loops if each is not whole]
    while holes:
        gaps = [cdist(whole, each) for each in holes]
        nearest = int(np.argmin([each.min() for each in gaps]))
        at, start = np.unravel_index(np.argmin(gaps[nearest]), gaps[nearest].shape)
        hole = np.roll(holes.pop(nearest), -int(start), axis=0)
        whole = np.concatenate([whole[: at + 1], hole, hole[:1], whole[at:]])
    return whole


def _area(loop: np.ndarray) -> float:
    """Twice the area of a loop, negative for a hole."""
    ahead = np.roll(loop, -1, axis=0)
    return float((loop[:, 0] * ahead[:, 1] - ahead[:, 0] * loop[:, 1]).sum())
