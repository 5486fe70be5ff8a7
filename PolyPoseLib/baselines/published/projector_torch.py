"""The polyrigid projector in plain torch: where numba is absent, on CUDA, and as the kernels' oracle."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from PolyPoseLib.baselines.published.projector import Motion, PolyrigidProjector, Sampling
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, apply_exp
from PolyPoseLib.warp.weights import DistanceMaps, weights

SAMPLES_PER_CHUNK = 1 << 17
SAMPLES_PER_CUDA_CHUNK = 1 << 22


class TorchPolyrigidProjector(PolyrigidProjector[Tensor]):
    """See :class:`PolyrigidProjector`; device: "cpu" or "cuda"; dtype: float64 makes it an oracle.

    A sample's value depends on the logarithms through its own mean logarithm V and, in the moving frame, through
    the places T_k x where its distances are measured; one backward pass gives the derivatives by both for all
    samples, and a ray's Jacobian is the weighted sum over its samples.
    """

    def __init__(
        self,
        volume: Grid,
        warp: PolyrigidWarp,
        camera: Camera,
        sampling: Sampling,
        device: torch.device | str = "cpu",
        dtype: torch.dtype = torch.float32,
    ) -> None:
        self.device, self.dtype = torch.device(device), dtype
        default = SAMPLES_PER_CUDA_CHUNK if self.device.type == "cuda" else SAMPLES_PER_CHUNK
        super().__init__(volume, warp, camera, sampling, default)
        self._volume = self._tensor(volume.voxels)[None, None]
        self._maps = warp.distances.to(self.device)
        self._share = warp.share.to(self.device)
        self._offset = self._tensor(self.centre)
        self._matrix = self._tensor(self.to_index)
        self._last = self._tensor(np.array(volume.voxels.shape[::-1]) - 1)

    def motion(self, logs: np.ndarray) -> Motion:
        """See :class:`PolyrigidProjector`."""
        return Motion.of(logs)

    def trace(self, motion: Motion, number: int, wanted: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """See :class:`PolyrigidProjector`."""
        chunk = self.chunks[number]
        count = self._tensor(chunk.count)
        index = torch.arange(int(chunk.count.max()), dtype=self.dtype, device=self.device)
        inside = (index < count[:, None]).to(self.dtype)
        points = self._tensor(chunk.first)[:, None] + index[:, None] * self._tensor(chunk.step)[:, None]
        flat = points.reshape(-1, 3)
        logs = self._tensor(motion.logs)
        with torch.set_grad_enabled(wanted):
            if self.warp.frame == "fixed":
                places = None
                with torch.no_grad():
                    share_of = self.kept_weights(number, lambda: self._weigh(self._maps(flat + self._offset)))
            else:
                places = self._places(flat, motion).requires_grad_(wanted)
                share_of = self._weigh(self._distances(places))
            means = share_of.T @ logs
            if wanted and places is None:
                means.requires_grad_()
            values = self._sample(apply_exp(means, flat)) * inside.reshape(-1)
        image = values.detach().reshape(inside.shape).sum(1) * chunk.step_mm
        if not wanted:
            return self._array(image), None
        by_mean, *by_place = torch.autograd.grad(values.sum(), [means] if places is None else [means, places])
        rays, samples = inside.shape
        jacobian = torch.einsum(
            "krn,rnc->rkc",
            share_of.detach().reshape(-1, rays, samples),
            by_mean.reshape(rays, samples, 6),
        )
        if places is not None:
            by_pose = torch.cat([torch.linalg.cross(places.detach(), by_place[0]), by_place[0]], dim=2)
            by_pose = by_pose.reshape(-1, rays, samples, 6).sum(2)
            jacobian = jacobian + torch.einsum("krc,kcd->rkd", by_pose, self._tensor(motion.left))
        return self._array(image), self._array(jacobian * chunk.step_mm)

    def _places(self, points: Tensor, motion: Motion) -> Tensor:
        """T_k x (K, N, 3) relative to the centre."""
        poses = self._tensor(motion.poses)
        return points @ poses[:, :3, :3].transpose(1, 2) + poses[:, None, :3, 3]

    def _distances(self, places: Tensor) -> Tensor:
        """Distances (K, N) of every structure at its own places (K, N, 3)."""
        maps = [DistanceMaps(signed[None], self._maps.affine) for signed in self._maps.signed]
        return torch.cat([each(place + self._offset) for each, place in zip(maps, places, strict=True)])

    def _weigh(self, distances: Tensor) -> Tensor:
        return weights(distances, self._share, self.warp.form, self.warp.epsilon)

    def _sample(self, points: Tensor) -> Tensor:
        """Trilinear values (N,) at moving points (N, 3) relative to the centre; 0 beyond the border."""
        index = points @ self._matrix[:, :3].T + self._matrix[:, 3]
        place = 2 * index / self._last - 1
        return grid_sample(self._volume, place[None, None, None], align_corners=True)[0, 0, 0, 0]

    def _tensor(self, values: np.ndarray) -> Tensor:
        return torch.as_tensor(values, device=self.device).to(self.dtype)

    @staticmethod
    def _array(values: Tensor) -> np.ndarray:
        return values.detach().cpu().numpy()
