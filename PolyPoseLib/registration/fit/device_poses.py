"""One bone's least-squares problem at many poses at once, in torch on a CPU or a GPU.

Images, residuals and normal equations stay on the device; only costs and 6 x 6 systems come back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.lockstep import Normals
from PolyPoseLib.registration.fit.problem import RigidProblem, View
from PolyPoseLib.rendering.rigid import Body
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.rendering.torch_rays import ImageRays

MOST_PIXELS = {"cpu": 1 << 21, "cuda": 1 << 25}
"""Pixels, over all poses, that are held at once on a device."""


class DevicePoses:
    """The problem of one body in front of static images, its cameras held.

    Parameters
    ----------
    problem : RigidProblem
        With one body, whose pose is the only unknown.
    backend : TorchBackend
        The problem's.

    """

    def __init__(self, problem: RigidProblem, backend: TorchBackend) -> None:
        self._problem, self._backend = problem, backend
        self.centre = problem.bodies[0].centre
        self._views = [_DeviceView.of(view, backend.device) for view in problem.views]
        self._scale = 1.0 / max(sum(float(view.weight.sum()) for view in problem.views), 1e-6)

    def costs(self, poses: np.ndarray) -> np.ndarray:
        """See :class:`PolyPoseLib.registration.fit.lockstep.ManyPoses`."""
        prior = self._problem.prior
        expected = [prior.cost(pose[None]) for pose in poses] if prior else np.zeros(len(poses))
        images = torch.zeros(len(poses), dtype=torch.float64, device=self._backend.device)
        for part in self._parts(len(poses)):
            for n, view in enumerate(self._views):
                image, _ = self._project(n, poses[part], False)
                images[part] += view.costs(view.normalised(image).values)
        return self._scale * images.cpu().numpy() + expected

    def normal_equations(self, poses: np.ndarray) -> Normals:
        """See :class:`PolyPoseLib.registration.fit.lockstep.ManyPoses`."""
        sums = torch.zeros((len(poses), 7, 7), dtype=torch.float64, device=self._backend.device)
        for part in self._parts(len(poses)):
            for n, view in enumerate(self._views):
                image, jacobian = self._project(n, poses[part], True)
                assert jacobian is not None
                sums[part] += view.products(image, jacobian)
        found = self._scale * sums.cpu().numpy()
        costs, matrices, gradients = found[:, 6, 6].copy(), found[:, :6, :6].copy(), found[:, :6, 6].copy()
        if self._problem.prior is not None:
            for n, pose in enumerate(poses):
                costs[n] += self._problem.prior.add_to(pose[None], matrices[n], gradients[n])
        return Normals(costs, matrices, gradients)

    def _parts(self, count: int) -> list[slice]:
        """The poses in parts whose images fit into memory."""
        pixels = max(view.weight.size for view in self._problem.views)
        size = max(1, MOST_PIXELS[self._backend.device.type] // pixels)
        return [slice(start, start + size) for start in range(0, count, size)]

    def _project(self, n: int, poses: np.ndarray, jacobian: bool) -> tuple[Tensor, Tensor | None]:
        """Images (S, H, W), and their derivatives (S, 6, H, W) by the poses' perturbations."""
        body, camera = self._problem.bodies[0], self._problem.views[n].camera
        device = self._backend.device
        placed = torch.as_tensor(poses, dtype=torch.float64, device=device)
        rays = rays_under_poses(body, camera, placed, self._problem.step_mm)
        image, moments = self._backend.sums(body.voxels, rays, jacobian, body.occupied)
        return image, None if moments is None else _jacobians(body, camera, placed, image, moments)


def rays_under_poses(body: Body, camera: Camera, poses: Tensor, step_mm: float) -> ImageRays:
    """Rays of a camera's whole image in a body's indices under poses (S, 4, 4) float64, fixed to moving mm."""
    to_index = torch.as_tensor(body.world_to_index, device=poses.device) @ poses
    source, turned = _camera_frame(camera, poses.device)
    return ImageRays(
        to_index[:, :3, :3] @ source + to_index[:, :3, 3],
        to_index[:, :3, :3] @ turned,
        torch.as_tensor(np.array(camera.inverse_intrinsics), device=poses.device),
        camera.height,
        camera.width,
        step_mm,
    )


def _camera_frame(camera: Camera, device: torch.device) -> tuple[Tensor, Tensor]:
    """The source (3,), and what takes (column, row, 1) to fixed mm per mm of depth (3, 3)."""
    rotation = camera.extrinsic[:3, :3]
    source = torch.as_tensor(-rotation.T @ camera.extrinsic[:3, 3], device=device)
    return source, torch.as_tensor(rotation.T @ camera.inverse_intrinsics, device=device)


def _jacobians(body: Body, camera: Camera, poses: Tensor, image: Tensor, moments: Tensor) -> Tensor:
    """(S, 6, H, W) derivatives as :func:`PolyPoseLib.rendering.rigid.project_body` has them; moments: (S, H, W, 6)."""
    source, turned = _camera_frame(camera, poses.device)
    directions = (poses[:, :3, :3] @ turned).float()
    start = poses[:, :3, :3] @ source + poses[:, :3, 3] - torch.as_tensor(body.centre, device=poses.device)
    column = torch.arange(camera.width, dtype=torch.float32, device=poses.device)
    row = torch.arange(camera.height, dtype=torch.float32, device=poses.device)
    direction = (
        directions[:, None, None, :, 2]
        + column[:, None] * directions[:, None, None, :, 0]
        + row[:, None, None] * directions[:, None, None, :, 1]
    )
    to_index = torch.as_tensor(body.world_to_index[:3, :3], dtype=torch.float32, device=poses.device)
    gradient, by_depth = moments[..., :3] @ to_index, moments[..., 3:] @ to_index
    squared = (direction * direction).sum(-1)
    slope = (gradient * direction).sum(-1) / squared
    deeper = ((by_depth * direction).sum(-1) + image) / squared
    gradient = gradient - slope[..., None] * direction
    by_depth = by_depth - deeper[..., None] * direction
    start = start.float()[:, None, None].expand_as(gradient)
    by_rotation = torch.linalg.cross(start, gradient) + torch.linalg.cross(direction, by_depth)
    # Where nothing is crossed there is nothing whose component along the ray could be exact.
    jacobian = torch.cat([by_rotation, gradient], dim=-1) * (image != 0)[..., None]
    return jacobian.permute(0, 3, 1, 2)


@dataclass(frozen=True)
class _Normalised:
    """Normalised images (S, H, W) float64, and what their derivatives need."""

    values: Tensor
    centred: Tensor
    mean: Tensor
    deviation: Tensor


@dataclass(frozen=True)
class _DeviceView:
    """A view on the device, (H, W) float64 each; see View and LocalContrast."""

    background: Tensor
    mask: Tensor
    share: Tensor
    support: Tensor
    target: Tensor
    weight: Tensor
    least_variance: Tensor
    size: int

    @classmethod
    def of(cls, view: View, device: torch.device) -> _DeviceView:
        """A view whose static image is the background."""
        contrast = view.contrast
        inside = contrast.mask > 0
        middle = float(view.static[inside].mean()) if inside.any() else 0.0
        noise = np.broadcast_to(np.asarray(contrast.noise, np.float64), inside.shape)
        parts = (
            np.where(inside, view.static.astype(np.float64) - middle, 0.0),
            contrast.mask,
            contrast.share,
            contrast.support,
            view.target,
            view.weight,
            contrast.floor**2 + noise**2,
        )
        return cls(*(torch.tensor(part, dtype=torch.float64, device=device) for part in parts), contrast.size)

    def normalised(self, images: Tensor) -> _Normalised:
        """Images (S, H, W) in front of the background, normalised."""
        centred = self.background + images * self.mask
        mean = self._mean(centred)
        variance = (self._mean(centred * centred) - mean * mean).clamp(min=0)
        deviation = (variance + self.least_variance).sqrt()
        return _Normalised((centred - mean) / deviation * self.support, centred, mean, deviation)

    def costs(self, values: Tensor) -> Tensor:
        """(S,) sums of weighted squared residuals of normalised images (S, H, W)."""
        return (self.weight * (values - self.target) ** 2).sum(dim=(1, 2))

    def products(self, images: Tensor, jacobians: Tensor) -> Tensor:
        """(S, 7, 7) weighted sums of products of the derivatives by six unknowns and the residual with each other."""
        image = self.normalised(images)
        changes = jacobians.double()
        mean = self._mean(changes)
        product = self._mean(changes * image.centred[:, None])
        deviation = image.deviation[:, None]
        slope = (product - image.mean[:, None] * mean) / deviation**2
        changes = ((changes - mean) / deviation - image.values[:, None] * slope) * self.support
        every = torch.cat([changes, (image.values - self.target)[:, None]], dim=1).flatten(2)
        return (every * self.weight.reshape(-1)) @ every.transpose(1, 2)

    def _mean(self, images: Tensor) -> Tensor:
        """Patch means of images (..., H, W), of the pixels that count."""
        half = self.size // 2
        flat = (images * self.mask).reshape(-1, 1, *self.mask.shape)
        flat = avg_pool2d(flat, (1, self.size), stride=1, padding=(0, half))
        flat = avg_pool2d(flat, (self.size, 1), stride=1, padding=(half, 0))
        return flat.reshape(images.shape) / self.share
