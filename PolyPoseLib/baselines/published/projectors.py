"""The projectors of the published method, and which of them serves."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.baselines.published.projector import WEIGHTS_BYTES, PolyrigidProjector
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.warp.polyrigid import PolyrigidWarp


def polyrigid_projector(
    voxels: np.ndarray,
    affine: np.ndarray,
    warp: PolyrigidWarp,
    camera: Camera,
    step_mm: float,
    backend: Backend,
    margin_mm: float = 0.0,
    weights_bytes: int = WEIGHTS_BYTES,
) -> PolyrigidProjector:
    """The projector that belongs to a backend; arguments as in :class:`PolyrigidProjector`."""
    if isinstance(backend, NumbaBackend):
        from PolyPoseLib.baselines.published.projector_numba import NumbaPolyrigidProjector

        return NumbaPolyrigidProjector(voxels, affine, warp, camera, step_mm, margin_mm, weights_bytes)
    from PolyPoseLib.baselines.published.projector_torch import TorchPolyrigidProjector

    device = getattr(backend, "device", "cpu")
    return TorchPolyrigidProjector(
        voxels, affine, warp, camera, step_mm, margin_mm, weights_bytes, device=device
    )
