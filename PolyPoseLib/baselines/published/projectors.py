"""The projectors of the published method, and which of them belongs to a backend."""

from __future__ import annotations

from PolyPoseLib.baselines.published.projector import PolyrigidProjector, Sampling
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.warp.polyrigid import PolyrigidWarp


def polyrigid_projector(
    volume: Grid, warp: PolyrigidWarp, camera: Camera, sampling: Sampling, backend: Backend
) -> PolyrigidProjector:
    """The projector that belongs to a backend; arguments as in :class:`PolyrigidProjector`."""
    if isinstance(backend, NumbaBackend):
        from PolyPoseLib.baselines.published.projector_numba import NumbaPolyrigidProjector

        return NumbaPolyrigidProjector(volume, warp, camera, sampling)
    from PolyPoseLib.baselines.published.projector_torch import TorchPolyrigidProjector

    return TorchPolyrigidProjector(volume, warp, camera, sampling, device=getattr(backend, "device", "cpu"))
