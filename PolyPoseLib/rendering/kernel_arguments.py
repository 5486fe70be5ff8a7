"""What the compiled loops take as one argument. As a "kernel" file, a change of it makes cached code stale."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class IndexRays(NamedTuple):
    """Rays of a rectangular part of an image, in voxel indices (i, j, k).

    A pixel (column c, row r) of the part looks from `source` along `corner + c per_column + r per_row` (indices per mm
    of camera depth).

    Attributes
    ----------
    source, corner, per_column, per_row : (3,) array of float64
        See above.
    inverse_intrinsics : (3, 3) array of float64
        Pixels, counted from the part's first one, to directions in the camera's frame.
    rows, columns : int
        Size of the part.
    step_mm : float
        Distance of the samples along each ray.

    """

    source: np.ndarray
    corner: np.ndarray
    per_column: np.ndarray
    per_row: np.ndarray
    inverse_intrinsics: np.ndarray
    rows: int
    columns: int
    step_mm: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the part."""
        return self.rows, self.columns


class PoseFrames(NamedTuple):
    """What turns moments of index gradients into derivatives by the perturbations of S poses.

    Attributes
    ----------
    to_index : (3, 3) array of float64
        Moving mm to voxel indices.
    start : (S, 3) array of float64
        From the centre about which poses are perturbed to the source, moving mm.
    turned : (S, 3, 3) array of float64
        Takes (column, row, 1) to moving mm per mm of depth.

    """

    to_index: np.ndarray
    start: np.ndarray
    turned: np.ndarray
