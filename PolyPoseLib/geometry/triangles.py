"""Triangles in the plane of an image: which pixels they cover together."""

from __future__ import annotations

import numpy as np

AT_ONCE = 2_000_000
"""Rows of pixels that triangles cross, handled together."""


def covered(corners: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The pixels whose centres lie in any of several triangles.

    Triangles that share an edge leave no gap between them.

    Parameters
    ----------
    corners : (T, 3, 2) array
        (column, row), pixels, finite; centres of pixels at whole numbers.
    shape : tuple[int, int]
        (height, width) of the image.

    Returns
    -------
    (H, W) array of bool
        Where triangles are.

    """
    height, width = shape
    counts = np.zeros(height * (width + 1), np.int64)
    ordered = np.take_along_axis(corners, np.argsort(corners[..., 1], axis=1)[..., None], axis=1)
    first = np.clip(np.ceil(ordered[:, 0, 1]), 0, height).astype(np.int64)
    last = np.clip(np.ceil(ordered[:, 2, 1]), 0, height).astype(np.int64)
    crossed = np.maximum(last - first, 0)
    part = np.cumsum(crossed) // AT_ONCE
    for start, end in zip(*_runs(part), strict=True):
        counts += _ends(ordered[start:end], first[start:end], crossed[start:end], shape)
    return np.cumsum(counts.reshape(height, width + 1), axis=1)[:, :width] > 0


def _runs(part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and ends of the runs of equal numbers."""
    changes = np.flatnonzero(np.diff(part)) + 1
    return np.r_[0, changes], np.r_[changes, len(part)]


def _ends(corners: np.ndarray, first: np.ndarray, crossed: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """In every row, +1 where a triangle begins and -1 behind its end; (H * (W + 1),).

    corners: sorted by row; first, crossed: the first row of each triangle and how many there are.
    """
    height, width = shape
    owner = np.repeat(np.arange(len(corners)), crossed)
    rows = np.arange(len(owner)) - np.repeat(np.cumsum(crossed) - crossed, crossed) + first[owner]
    top, middle, bottom = (corners[owner, n] for n in range(3))
    long = _column_at(top, bottom, rows)
    upper = rows < middle[:, 1]
    short = _column_at(np.where(upper[:, None], top, middle), np.where(upper[:, None], middle, bottom), rows)
    begin, end = (
        np.clip(np.ceil(each), 0, width).astype(np.int64)
        for each in (np.minimum(long, short), np.maximum(long, short))
    )
    place, length = rows * (width + 1), height * (width + 1)
    return np.bincount(place + begin, minlength=length) - np.bincount(place + end, minlength=length)


def _column_at(start: np.ndarray, end: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(N,) columns at which edges (N, 2) from start down to end pass rows."""
    down = end[:, 1] - start[:, 1]
    share = np.divide(rows - start[:, 1], down, out=np.zeros(len(rows)), where=down > 0)
    return start[:, 0] + np.clip(share, 0, 1) * (end[:, 0] - start[:, 0])
