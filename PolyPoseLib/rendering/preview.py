"""Renderings of a whole CT at review size, fast enough to follow a slider."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.rendering.select import select_backend

REVIEW_PIXELS = 200
"""Longer side of an image at review size."""

VOXEL_MM = 3.0
"""The CT is averaged over blocks to voxels of about this size."""

STEP_MM = 3.0

_AT_REST = np.eye(4)


class PreviewRenderer:
    """Renders one CT through any camera; the CT is kept as small as review size needs."""

    def __init__(
        self, ct: Volume, voxel_mm: float = VOXEL_MM, step_mm: float = STEP_MM, backend: Backend | None = None
    ) -> None:
        """Prepare a CT in HU. backend: numba's kernels where they are installed, by default."""
        voxels, affine = block_mean(hounsfield_to_attenuation(ct.voxels), ct.affine, voxel_mm)
        voxels, affine = without_air(voxels, affine)
        origin = np.eye(4)
        origin[:3, 3] = -1
        self._body = Body(np.pad(voxels, 1), affine @ origin, ct.bounds_center)
        self._step_mm = step_mm
        self._backend = backend or select_backend()

    def render(self, camera: Camera) -> np.ndarray:
        """Line integrals (H, W) float32 of the CT, at rest, through a camera."""
        projection = project_body(self._body, camera, _AT_REST, self._step_mm, self._backend)
        image = np.zeros((camera.height, camera.width), np.float32)
        image[projection.slices] = projection.image
        return image


def block_mean(voxels: np.ndarray, affine: np.ndarray, target_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Voxels (k, j, i) averaged over blocks that are about as large as a target, and their affine (4, 4).

    Voxels that do not fill a block at the end of an axis are averaged with zeros.
    """
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    factors = np.maximum(np.floor(target_mm / spacing + 1e-6).astype(int), 1)
    pad = [(0, -size % factor) for size, factor in zip(voxels.shape, factors[::-1], strict=True)]
    filled = np.pad(voxels, pad) if any(after for _, after in pad) else voxels
    (a, b, c), (k, j, i) = factors[::-1], filled.shape
    blocks = filled.reshape(k // a, a, j // b, b, i // c, c)
    coarser = np.eye(4)
    coarser[:3, :3] = np.diag(factors)
    coarser[:3, 3] = (factors - 1) / 2
    return blocks.mean(axis=(1, 3, 5), dtype=np.float32), affine @ coarser


def without_air(voxels: np.ndarray, affine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The smallest box of voxels (k, j, i) that holds all that is not 0, and its affine (4, 4)."""
    box = []
    for axis in range(3):
        used = np.flatnonzero(voxels.any(axis=tuple(each for each in range(3) if each != axis)))
        box.append(slice(int(used[0]), int(used[-1]) + 1) if used.size else slice(0, 1))
    first = np.eye(4)
    first[:3, 3] = [each.start for each in reversed(box)]
    return voxels[tuple(box)], affine @ first


def review_camera(camera: Camera, pixels: int = REVIEW_PIXELS) -> tuple[Camera, int]:
    """A camera binned so that its longer side has at most about `pixels`, and the binning factor.

    Raises InputError when pixels is below 1.
    """
    if pixels < 1:
        raise InputError(f"The review size is {pixels}: give a number of pixels of 1 or more.")
    factor = max(1, -(-max(camera.height, camera.width) // pixels))
    factor = min(factor, camera.height, camera.width)
    return camera.binned(factor), factor
