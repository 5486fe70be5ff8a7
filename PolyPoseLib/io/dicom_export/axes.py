"""Grids with their axes as the CT's slices have them: planning systems expect the rows and columns that they know."""

from __future__ import annotations

from itertools import permutations

import numpy as np


def reordered(values: np.ndarray, affine: np.ndarray, like: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same values at the same places, with axes exchanged and reversed until they point as others do.

    Parameters
    ----------
    values : (k, j, i, ...) array
        Of the nodes.
    affine : (4, 4) array
        Index (i, j, k, 1) to LPS mm.
    like : (3, 3) or (4, 4) array
        Whose first three columns are the axes to follow.

    Returns
    -------
    (k, j, i, ...) array
        A view of the values.
    (4, 4) array
        Its affine.

    """
    axes, wanted = (each[:3, :3] / np.linalg.norm(each[:3, :3], axis=0) for each in (affine, like))
    cosines = wanted.T @ axes
    order = max(permutations(range(3)), key=lambda each: float(np.abs(cosines[range(3), each]).sum()))
    moved = np.transpose(values, (*(2 - n for n in reversed(order)), *range(3, values.ndim)))
    out = affine.copy()
    out[:3, :3] = affine[:3, list(order)]
    for axis in range(3):
        if cosines[axis, order[axis]] < 0:
            last = moved.shape[2 - axis] - 1
            out[:3, 3] += last * out[:3, axis]
            out[:3, axis] *= -1
            moved = np.flip(moved, 2 - axis)
    return moved, out
