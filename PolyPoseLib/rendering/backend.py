"""What computes line integrals: numba's fused kernels on the CPU, or torch anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.occupancy import OccupiedBlocks


@dataclass(frozen=True)
class IndexField:
    """A displacement field in the index units of the volume that it displaces.

    Attributes
    ----------
    vectors : (d, h, w, 3) array of float32
        Displacements.
    scale, offset : (3,) array
        A volume index x lies at the field's coordinate x * scale + offset.
    low, high : (3,) array
        Box of volume indices to which rays are clipped.

    """

    vectors: np.ndarray
    scale: np.ndarray
    offset: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Backend(Protocol):
    """Computes line integrals through volumes (D, H, W) in 1/mm that have a border of zeros.

    `occupied` says where a volume is not zero: a hint that saves samples and changes no result.
    """

    name: str

    def project(
        self, voxels: np.ndarray, rays: IndexRays, moments: bool, occupied: OccupiedBlocks | None = None
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Line integrals (rows, columns), and the (rows, columns, 6) moments of a rigid Jacobian when asked for.

        The moments are the integrals of the volume's gradient by index (3) and of depth times that gradient (3).
        """
        ...

    def project_warped(
        self, voxels: np.ndarray, field: IndexField, rays: IndexRays, occupied: OccupiedBlocks | None = None
    ) -> np.ndarray:
        """Line integrals (rows, columns) through a volume that is displaced by a field."""
        ...
