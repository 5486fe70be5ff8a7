"""Renderings of a whole CT at review size, fast enough to follow a slider."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.rendering.select import select_backend

VOXEL_MM = 3.0
"""The CT is averaged over blocks to voxels of about this size."""

STEP_MM = 3.0
"""Distance of the samples along a ray."""

_AT_REST = np.eye(4)


class PreviewRenderer:
    """Renders one CT through any camera; the CT is kept at the resolution that review size needs."""

    def __init__(
        self, ct: Volume, voxel_mm: float = VOXEL_MM, step_mm: float = STEP_MM, backend: Backend | None = None
    ) -> None:
        """Prepare the CT.

        Parameters
        ----------
        ct : Volume
            HU.
        voxel_mm : float
            The CT is averaged over blocks to voxels of about this size.
        step_mm : float
            Distance of the samples along a ray.
        backend : Backend, optional
            Numba's kernels where they are installed, by default.

        """
        coarse = Grid(hounsfield_to_attenuation(ct.voxels), ct.affine).coarsened(voxel_mm)
        body = coarse.without_zeros().padded()
        self._body = Body(body.voxels, body.affine, ct.bounds_center)
        self._step_mm = step_mm
        self._backend = backend or select_backend()

    def render(self, camera: Camera) -> np.ndarray:
        """Line integrals (H, W) float32 of the CT, at rest, through a camera."""
        projection = project_body(self._body, camera, _AT_REST, self._step_mm, self._backend)
        image = np.zeros((camera.height, camera.width), np.float32)
        image[projection.slices] = projection.image
        return image
