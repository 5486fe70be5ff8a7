"""Which program carries out the rays: numba's fused kernels on the CPU, or torch anywhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from PolyPoseLib.errors import InputError


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
    """Carries out rays through volumes that have a border of zeros."""

    name: str

    def project(
        self, voxels: np.ndarray, rays: IndexRays, step_mm: float, shape: tuple[int, int], moments: bool
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Line integrals (rows, columns), and the (rows, columns, 6) moments of a rigid Jacobian when asked.

        The moments are the integrals of the volume's gradient by index (3) and of depth times that gradient (3).
        """
        ...

    def project_warped(
        self, voxels: np.ndarray, field: IndexField, rays: IndexRays, step_mm: float, shape: tuple[int, int]
    ) -> np.ndarray:
        """Line integrals (rows, columns) through a volume that is displaced by a field."""
        ...


class NumbaBackend:
    """Compiled on first use; multi-threaded."""

    name = "numba"

    def project(
        self, voxels: np.ndarray, rays: IndexRays, step_mm: float, shape: tuple[int, int], moments: bool
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """See :class:`Backend`."""
        from PolyPoseLib.rendering import kernels

        image = np.zeros(shape, np.float32)
        arguments = (voxels, rays.source, rays.corner, rays.per_column, rays.per_row, rays.inverse_intrinsics)
        if not moments:
            kernels.project(*arguments, step_mm, image)
            return image, None
        sums = np.zeros((*shape, 6), np.float32)
        kernels.project_with_moments(*arguments, step_mm, image, sums)
        return image, sums

    def project_warped(
        self, voxels: np.ndarray, field: IndexField, rays: IndexRays, step_mm: float, shape: tuple[int, int]
    ) -> np.ndarray:
        """See :class:`Backend`."""
        from PolyPoseLib.rendering import warped_kernel

        image = np.zeros(shape, np.float32)
        warped_kernel.project_warped(
            voxels, field.vectors, field.scale, field.offset, field.low, field.high,
            rays.source, rays.corner, rays.per_column, rays.per_row, rays.inverse_intrinsics, step_mm, image,
        )  # fmt: skip
        return image


def select_backend(kernel: str = "auto", device: str = "cpu", threads: int | None = None) -> Backend:
    """The backend for options ``kernel`` ("auto", "numba", "torch") and a resolved ``device``.

    threads: CPU threads, None for all.  Raises InputError when numba is asked for but not installed.
    """
    try:
        import numba
    except ImportError:
        numba = None
    if kernel == "numba" and numba is None:
        raise InputError(
            'Option "kernel" is "numba", which is not installed: pip install numba, or give "auto".'
        )
    if kernel == "numba" or (kernel == "auto" and numba is not None and device == "cpu"):
        if threads is not None:
            numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
        return NumbaBackend()
    from PolyPoseLib.rendering.torch_backend import TorchBackend

    return TorchBackend(device)
