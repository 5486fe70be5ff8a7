"""Views on torch's device: residuals of images, and derivatives of a body's image by its pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.problem import View
from PolyPoseLib.rendering.rigid import Body


def _camera_frame(camera: Camera, device: torch.device) -> tuple[Tensor, Tensor]:
    """A camera's source (3,) mm, and what takes (column, row, 1) to fixed mm per mm of depth (3, 3)."""
    rotation = camera.extrinsic[:3, :3]
    source = torch.as_tensor(-rotation.T @ camera.extrinsic[:3, 3], device=device)
    return source, torch.as_tensor(rotation.T @ camera.inverse_intrinsics, device=device)


def jacobians(body: Body, camera: Camera, poses: Tensor, image: Tensor, moments: Tensor) -> Tensor:
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
class NormalisedImages:
    """Normalised images (S, H, W) float64, and what their derivatives need."""

    values: Tensor
    centred: Tensor
    mean: Tensor
    deviation: Tensor


@dataclass(frozen=True)
class DeviceView:
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
    def of(cls, view: View, device: torch.device) -> DeviceView:
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
        tensors = [torch.tensor(part, dtype=torch.float64, device=device) for part in parts]
        return cls(*tensors, size=contrast.size)

    def normalised(self, images: Tensor) -> NormalisedImages:
        """Images (S, H, W) in front of the background, normalised."""
        centred = self.background + images * self.mask
        mean = self._mean(centred)
        variance = (self._mean(centred * centred) - mean * mean).clamp(min=0)
        deviation = (variance + self.least_variance).sqrt()
        return NormalisedImages((centred - mean) / deviation * self.support, centred, mean, deviation)

    def costs(self, values: Tensor) -> Tensor:
        """(S,) sums of weighted squared residuals of normalised images (S, H, W)."""
        return (self.weight * (values - self.target) ** 2).sum(dim=(1, 2))

    def products(self, images: Tensor, jacobians: Tensor) -> Tensor:
        """(S, 7, 7) weighted sums of products of the derivatives by six unknowns and the residual with each other."""
        image = self.normalised(images)
        residual = (image.values - self.target)[:, None]
        every = torch.cat([self.derivatives(image, jacobians), residual], dim=1).flatten(2)
        return (every * self.weight.reshape(-1)) @ every.transpose(1, 2)

    def derivatives(self, image: NormalisedImages, changes: Tensor) -> Tensor:
        """Changes (S, P, H, W) float64 of normalised images, by changes (S, P, H, W) of the images."""
        changes = changes.double()
        mean = self._mean(changes)
        product = self._mean(changes * image.centred[:, None])
        deviation = image.deviation[:, None]
        slope = (product - image.mean[:, None] * mean) / deviation**2
        return ((changes - mean) / deviation - image.values[:, None] * slope) * self.support

    def _mean(self, images: Tensor) -> Tensor:
        """Patch means of images (..., H, W), of the pixels that count."""
        half = self.size // 2
        flat = (images * self.mask).reshape(-1, 1, *self.mask.shape)
        flat = avg_pool2d(flat, (1, self.size), stride=1, padding=(0, half))
        flat = avg_pool2d(flat, (self.size, 1), stride=1, padding=(half, 0))
        return flat.reshape(images.shape) / self.share
