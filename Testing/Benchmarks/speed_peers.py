"""Peers of the speed benchmark: the renderers of diffdrr and nanodrr, and the official iteration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from PolyPoseLib.baselines.published.objective import PolyrigidObjective, poses_of
from PolyPoseLib.baselines.published.ray_samples import sample_rays
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.similarity.ncc import gmncc
from PolyPoseLib.warp.polyrigid import PolyrigidWarp


class Missing(Exception):
    """A peer is not installed."""


def diffdrr_projector(grid: Grid, camera: Camera, step_mm: float) -> Callable[[], np.ndarray]:
    """Renders (H, W) with diffdrr's trilinear renderer; samples lie ``step_mm`` apart on the central ray."""
    render = DiffdrrRays(grid, camera, step_mm)
    volume = torch.as_tensor(grid.voxels).permute(2, 1, 0)

    def project() -> np.ndarray:
        with torch.no_grad():
            return render(volume).numpy()

    return project


class DiffdrrRays:
    """diffdrr's trilinear renderer for one camera: volume (i, j, k) -> (H, W)."""

    def __init__(self, grid: Grid, camera: Camera, step_mm: float) -> None:
        try:
            from diffdrr.renderers import Trilinear, _get_alpha_minmax
        except ImportError as error:
            raise Missing(f"diffdrr: {error}") from error
        self.renderer, self.shape = Trilinear(), (camera.height, camera.width)
        to_index = np.linalg.inv(grid.affine)
        directions = camera.pixel_directions().reshape(-1, 3)
        farthest = 2 * np.abs(camera.depth(grid.affine[:3, 3][None]))[0] + 1000
        target = camera.source + farthest * directions
        source = np.broadcast_to(camera.source, target.shape)
        self.length = torch.as_tensor(np.linalg.norm(target - source, axis=1))[None, None].float()
        self.source, self.target = (
            torch.as_tensor(p @ to_index[:3, :3].T + to_index[:3, 3])[None].float() for p in (source, target)
        )
        size = torch.tensor(grid.voxels.shape[::-1]).float()
        low, high = _get_alpha_minmax(self.source, self.target, size, 0.5, 1e-8)
        span = float(high.max() - low.min()) * float(self.length.min())
        self.points = round(span / step_mm) + 1

    def __call__(self, volume: Tensor) -> Tensor:
        image = self.renderer(volume, self.source, self.target, self.length, n_points=self.points)
        return image.reshape(self.shape)


def nanodrr_projector(grid: Grid, camera: Camera, step_mm: float) -> Callable[[], np.ndarray]:
    """Renders (H, W) with nanodrr; each ray has as many samples as PolyPose's rays have in the mean."""
    try:
        from nanodrr.data import Subject
        from nanodrr.drr import render
    except ImportError as error:
        raise Missing(f"nanodrr: {error}") from error
    voxels = torch.as_tensor(grid.voxels)[None, None]
    matrix = torch.as_tensor(grid.affine)
    subject = Subject(
        voxels,
        torch.zeros_like(voxels),
        matrix.float(),
        matrix.inverse().float(),
        Subject._make_voxel_to_grid(voxels.shape),
        torch.zeros(3),
        convert_to_mu=False,
    )
    shifted = camera.intrinsics.copy()
    shifted[:2, 2] += 0.5  # it counts pixels from the image's corner
    k_inv = torch.as_tensor(np.linalg.inv(shifted))[None].float()
    rt_inv = torch.as_tensor(np.linalg.inv(camera.extrinsic))[None].float()
    distance = torch.tensor([2 * float(np.linalg.norm(camera.source - grid.affine[:3, 3])) + 1000])
    rays = sample_rays(camera, grid, np.zeros(3), step_mm)
    samples = round(float(rays.count.mean()))

    def project() -> np.ndarray:
        with torch.no_grad():
            image = render(
                subject, k_inv, rt_inv, distance, camera.height, camera.width, samples, backend="torch"
            )
        return image[0, 0].numpy()

    return project


class OfficialIteration:
    """Value and gradient of the paper's objective by the official method.

    Every voxel's motion is the exponential of its own mean logarithm, as a 4 x 4 matrix; the warped volume is
    resampled onto the voxels, rendered by diffdrr, and everything is differentiated in reverse. The similarity is
    PolyPose's, which is faster than unfolding patches, and the mask that the official code warps as well is left out.
    """

    def __init__(
        self, grid: Grid, warp: PolyrigidWarp, objective: PolyrigidObjective, step_mm: float
    ) -> None:
        try:
            from diffdrr.pose import RigidTransform, convert
        except ImportError as error:
            raise Missing(f"diffdrr: {error}") from error
        self._convert, self._transform = convert, RigidTransform
        self.objective = objective
        self.volume = torch.as_tensor(grid.voxels)[None, None]
        self.matrix = torch.as_tensor(grid.affine).float()[None]
        size = torch.tensor(grid.voxels.shape[::-1])
        axes = [torch.arange(n).float() for n in size.tolist()]
        self.points = torch.stack(torch.meshgrid(*axes[::-1], indexing="ij")[::-1], -1).reshape(-1, 1, 3)
        self.size = size.float()
        world = self.points[:, 0].double() @ torch.as_tensor(grid.affine[:3, :3]).T + torch.as_tensor(
            grid.affine[:3, 3]
        )
        with torch.no_grad():
            self.weights = torch.cat([warp.weights(part) for part in world.split(1 << 18)], dim=1).float()
        self.rays = [DiffdrrRays(grid, view.camera, step_mm) for view in objective.views]
        self.targets = [torch.as_tensor(view.image)[None] for view in objective.views]

    def logs(self, parameters: np.ndarray) -> Tensor:
        """Logarithms (K, 6) about the world's origin, as the official code optimises them."""
        poses = torch.as_tensor(poses_of(parameters, self.objective.centres))
        return se3.log(poses).float().clone().requires_grad_()

    def images(self, logs: Tensor) -> list[Tensor]:
        """Renderings (H, W) of every view."""
        means = self.weights.T @ logs
        pose = self._convert(*means.split([3, 3], dim=1), parameterization="se3_log_map")
        affine = self._transform(self.matrix)
        pose = affine.compose(pose).compose(self._transform(self.matrix.inverse()))
        moved = (2 * pose(self.points) + 1) / self.size - 1
        moved = moved.reshape(1, *self.volume.shape[2:], 3)
        warped = grid_sample(self.volume, moved, align_corners=False)[0, 0].permute(2, 1, 0)
        return [rays(warped) for rays in self.rays]

    def __call__(self, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        """Similarity and its gradient (K, 6) by the logarithms about the world's origin."""
        logs = self.logs(parameters)
        pairs = zip(self.images(logs), self.targets, strict=True)
        value = torch.stack([gmncc(image[None], target)[0] for image, target in pairs]).mean()
        (gradient,) = torch.autograd.grad(value, logs)
        return float(value.detach()), gradient.numpy()
