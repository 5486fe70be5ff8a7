"""How large a study is, as far as the headers of its files tell: what its memory is estimated from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class StudySizes:
    """Sizes of a study's images.

    Parameters
    ----------
    shape : (int, int, int)
        Voxels of the CT along (k, j, i).
    spacing : (float, float, float)
        Of the CT along (i, j, k), mm.
    structures : int
        How many.
    pixels : tuple of int
        Of each X-ray.

    """

    shape: tuple[int, int, int]
    spacing: tuple[float, float, float]
    structures: int
    pixels: tuple[int, ...]

    @property
    def affine(self) -> np.ndarray:
        """A grid of these voxels, (4, 4), index (i, j, k) to mm; where the CT lies makes no difference."""
        return np.diag([*self.spacing, 1.0])

    @property
    def voxels(self) -> int:
        """Of the CT."""
        return int(np.prod(self.shape, dtype=float))
