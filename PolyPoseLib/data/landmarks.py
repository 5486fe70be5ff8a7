"""Landmarks of one X-ray: points in the CT with the pixels that show them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Points and the pixels that show them, in the same order.

    Attributes
    ----------
    points
        (N, 3) LPS mm.
    pixels
        (N, 2) [column, row], centres at whole numbers.

    """

    points: np.ndarray
    pixels: np.ndarray

    def mirrored(self, width: int) -> Landmarks:
        """The same for the image with its `width` columns in reverse order."""
        return Landmarks(self.points, self.pixels * [-1, 1] + [width - 1, 0])
