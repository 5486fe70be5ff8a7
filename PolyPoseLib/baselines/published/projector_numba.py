"""The polyrigid projector on numba's fused kernels."""

from __future__ import annotations

from typing import get_args

import numpy as np

from PolyPoseLib.baselines.published.kernel_arguments import RayBlocks, WeightField
from PolyPoseLib.baselines.published.projector import Motion, PolyrigidProjector, Sampling
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.warp.polyrigid import PolyrigidWarp
from PolyPoseLib.warp.weights import RIGID_DELTA_MM, WeightForm


class NumbaPolyrigidProjector(PolyrigidProjector[np.ndarray]):
    """See :class:`PolyrigidProjector`."""

    def __init__(self, volume: Grid, warp: PolyrigidWarp, camera: Camera, sampling: Sampling) -> None:
        from PolyPoseLib.baselines.published import kernel_fixed as kernel

        super().__init__(volume, warp, camera, sampling)
        maps = warp.distances
        grid = maps.affine.copy()
        grid[:3, 3] -= self.centre
        constant = warp.epsilon if warp.form == "epsilon" else RIGID_DELTA_MM**2
        self._voxels = np.ascontiguousarray(volume.voxels, np.float32)
        self._to_index = self.to_index.astype(np.float32)
        self._field = WeightField(
            maps=np.ascontiguousarray(maps.signed.cpu().numpy(), np.float32),
            to_grid=np.linalg.inv(grid)[:3].astype(np.float32),
            spacing=np.linalg.norm(maps.affine[:3, :3], axis=0).astype(np.float32),
            share=warp.share.cpu().numpy().astype(np.float32),
            form=get_args(WeightForm).index(warp.form),
            constant=np.float32(constant),
        )
        self._rays = [
            RayBlocks(
                kernel.first_blocks(chunk.count),
                chunk.first.astype(np.float32),
                chunk.step.astype(np.float32),
                chunk.count,
                chunk.step_mm,
            )
            for chunk in self.chunks
        ]

    def motion(self, logs: np.ndarray) -> Motion:
        """See :class:`PolyrigidProjector`."""
        return Motion.of(logs)

    def trace(self, motion: Motion, number: int, wanted: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """See :class:`PolyrigidProjector`."""
        rays = self._rays[number]
        count = len(rays.counts)
        image = np.empty(count, np.float32)
        jacobian = np.empty((count if wanted else 0, self.structures, 6), np.float32)
        logs = motion.logs.astype(np.float32)
        if self.warp.frame == "fixed":
            from PolyPoseLib.baselines.published.kernel_fixed import integrate

            weights = self.weights_of(number)
            integrate(self._voxels, weights, rays, logs, self._to_index, image, jacobian)
            return image, jacobian if wanted else None
        from PolyPoseLib.baselines.published.kernel_moving import integrate_moving

        by_pose = np.empty_like(jacobian)
        both = logs, np.ascontiguousarray(motion.poses[:, :3], np.float32)
        integrate_moving(self._voxels, self._field, rays, both, self._to_index, image, jacobian, by_pose)
        if not wanted:
            return image, None
        return image, jacobian + np.einsum("rkc,kcd->rkd", by_pose, motion.left.astype(np.float32))

    def weights_of(self, number: int) -> np.ndarray:
        """Weights (blocks, K, LANES) of a chunk."""
        return self.kept_weights(number, lambda: self._make_weights(number))

    def _make_weights(self, number: int) -> np.ndarray:
        from PolyPoseLib.baselines.published.kernel_fixed import fill_weights
        from PolyPoseLib.baselines.published.kernel_stages import LANES

        rays = self._rays[number]
        weights = np.empty((int(rays.blocks[-1]), self.structures, LANES), np.float32)
        fill_weights(self._field, rays, weights)
        return weights
