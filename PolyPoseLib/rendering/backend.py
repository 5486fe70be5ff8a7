"""Which program carries out the rays: numba's fused kernels on the CPU, or torch anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from PolyPoseLib.rendering.occupancy import OccupiedBlocks


@dataclass(frozen=True)
class IndexRays:
    """Rays of a rectangular part of an image, in voxel indices (i, j, k).

    A pixel (column c, row r) of the part looks from ``source`` (3,) along
    ``corner + c per_column + r per_row`` (indices per mm of camera depth).  inverse_intrinsics: (3, 3), counted
    from the part's first pixel.
    """

    source: np.ndarray
    corner: np.ndarray
    per_column: np.ndarray
    per_row: np.ndarray
    inverse_intrinsics: np.ndarray


@dataclass(frozen=True)
class IndexField:
    """A displacement field in the index units of the volume that it displaces.

    vectors: (d, h, w, 3) float32; a volume index x lies at the field's coordinate ``x * scale + offset`` (3,) each;
    low, high: (3,) box of volume indices to which rays are clipped.
    """

    vectors: np.ndarray
    scale: np.ndarray
    offset: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Backend(Protocol):
    """Carries out rays through volumes that have a border of zeros.

    ``occupied`` tells where a volume is not zero: a hint that saves samples and changes no result.
    """

    name: str

    def project(
        self,
        voxels: np.ndarray,
        rays: IndexRays,
        step_mm: float,
        shape: tuple[int, int],
        moments: bool,
        occupied: OccupiedBlocks | None = None,
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Line integrals (rows, columns), and the (rows, columns, 6) moments of a rigid Jacobian when asked.

        The moments are the integrals of the volume's gradient by index (3) and of depth times that gradient (3).
        """
        ...

    def project_warped(
        self,
        voxels: np.ndarray,
        field: IndexField,
        rays: IndexRays,
        step_mm: float,
        shape: tuple[int, int],
        occupied: OccupiedBlocks | None = None,
    ) -> np.ndarray:
        """Line integrals (rows, columns) through a volume that is displaced by a field."""
        ...
