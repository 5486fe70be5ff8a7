"""Closed planar contours filled on a grid of pixels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

ON_CONTOUR = 1e-3
"""Pixels; a centre no farther from a contour is on it.  Programs that trace voxels draw through their centres."""


def row_crossings(polygons: Sequence[np.ndarray], height: int) -> int:
    """How many rows of pixels the edges cross together: the work of `filled`.

    Parameters
    ----------
    polygons
        Each (N, 2), pixels (x, y).
    height
        Of the picture; rows outside do not count.

    """
    total = 0
    for each in polygons:
        y = np.clip(each[:, 1], -1, height)
        total += int((np.abs(y - np.roll(y, -1)) + 1).sum())
    return total


def filled(polygons: Sequence[np.ndarray], shape: tuple[int, int]) -> np.ndarray:
    """The pixels whose centres lie inside an odd number of contours, or on one.

    A contour within another is so a hole, and one that runs in and back out on the same line (a keyhole) has it, too.

    Parameters
    ----------
    polygons
        Each (N, 2), pixels (x, y), the last point joined to the first.
    shape
        (height, width); what lies outside is cut off.

    Returns
    -------
    numpy.ndarray
        bool, (height, width).

    """
    height, width = shape
    starts = np.concatenate([*polygons, np.empty((0, 2))])
    ends = np.concatenate([*(np.roll(each, -1, axis=0) for each in polygons), np.empty((0, 2))])
    turned = starts[:, 1] > ends[:, 1]
    low = np.where(turned[:, None], ends, starts)
    high = np.where(turned[:, None], starts, ends)
    rows, columns = _crossings(low, high, height, 0.0)
    entries = np.clip(np.ceil(columns), 0, width).astype(np.int64)
    counts = np.bincount(rows * (width + 1) + entries, minlength=height * (width + 1))
    inside = (np.cumsum(counts.reshape(height, width + 1), axis=1) & 1).astype(bool)[:, :width]
    _mark_centres_on(inside, low, high)
    return inside


def _crossings(
    low: np.ndarray, high: np.ndarray, height: int, margin: float
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and x where edges (E, 2) cross rows of pixels; their upper ends count only with a margin."""
    first = np.clip(np.ceil(low[:, 1] - margin), 0, height).astype(np.int64)
    last = np.floor(high[:, 1] + margin) + 1 if margin else np.ceil(high[:, 1])
    count = np.maximum(np.clip(last, 0, height).astype(np.int64) - first, 0)
    edge = np.repeat(np.arange(len(low)), count)
    rows = first[edge] + np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    rise = high[:, 1] - low[:, 1]
    share = np.clip((rows - low[edge, 1]) / np.where(rise > 0, rise, 1)[edge], 0, 1)
    return rows, low[edge, 0] + share * (high[edge, 0] - low[edge, 0])


def _mark_centres_on(inside: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Set the pixels whose centres are on an edge, in place."""
    height, width = inside.shape
    level = high[:, 1] - low[:, 1] <= ON_CONTOUR
    rows, columns = _crossings(low[~level], high[~level], height, ON_CONTOUR)
    nearest = np.rint(columns)
    on = (np.abs(columns - nearest) <= ON_CONTOUR) & (nearest >= 0) & (nearest < width)
    inside[rows[on], nearest[on].astype(np.int64)] = True
    along, other = low[level], high[level]
    row = np.rint(along[:, 1])
    left, right = np.minimum(along[:, 0], other[:, 0]), np.maximum(along[:, 0], other[:, 0])
    on = (np.abs(along[:, 1] - row) <= ON_CONTOUR) & (row >= 0) & (row < height)
    for j, start, end in zip(row[on].astype(int), left[on], right[on], strict=True):
        start, end = np.clip([np.ceil(start - ON_CONTOUR), np.floor(end + ON_CONTOUR) + 1], 0, width)
        inside[j, int(start) : int(end)] = True
