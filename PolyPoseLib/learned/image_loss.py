"""How well the CT rendered at a predicted camera resembles the image, with a gradient by the camera."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.similarity.ncc import patch_ncc


class ImageLoss:
    """1 - patch-wise normalised cross-correlation of the rigid CT and images.

    The renderer's analytic Jacobian serves as the gradient: on a CPU that costs a twentieth of differentiating through
    the rays.

    Parameters
    ----------
    body : Body
        The whole CT.
    camera : Camera
        A detector of the images' size.
    patch : int
        Odd width in pixels.
    size_mm : float
        Step.

    """

    def __init__(self, body: Body, camera: Camera, patch: int, size_mm: float, backend: Backend) -> None:
        self.body, self.camera, self.patch, self.size_mm, self.backend = body, camera, patch, size_mm, backend

    @classmethod
    def of(cls, scene: Scene, camera: Camera, patch: int, size_mm: float, backend: Backend) -> ImageLoss:
        """For a scene's whole CT at voxels of about ``size_mm``."""
        return cls(scene.volume("whole", size_mm), camera, patch, size_mm, backend)

    def __call__(self, predicted: Tensor, images: Tensor, masks: Tensor) -> Tensor:
        """Loss (B,) of cameras (B, 4, 4) for images and masks (B, S, S)."""
        rendered = self.render(predicted)
        return 1 - patch_ncc(rendered, images.to(rendered), self.patch, masks > 0.5)

    def render(self, extrinsics: Tensor) -> Tensor:
        """Renderings (B, S, S) at extrinsics (B, 4, 4), linear in small changes of these."""
        centre = torch.as_tensor(self.body.centre, dtype=extrinsics.dtype, device=extrinsics.device)
        about = torch.eye(4, dtype=extrinsics.dtype, device=extrinsics.device)
        about[:3, 3] = centre
        fixed = extrinsics.detach()
        # A camera E exp(v) sees what E sees of a body posed by exp(-v).
        change = se3.log(se3.inverse(about) @ se3.inverse(fixed) @ extrinsics @ about)
        images, slopes = zip(*(self._project(each.cpu().numpy()) for each in fixed), strict=True)
        image, slope = (torch.as_tensor(np.stack(each)).to(extrinsics) for each in (images, slopes))
        return image - torch.einsum("bcrs,bc->brs", slope, change)

    def _project(self, extrinsic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Image (S, S) and Jacobian (6, S, S) by the body's pose; zeros for a camera inside the body."""
        shape = (self.camera.height, self.camera.width)
        image, slope = np.zeros(shape, np.float32), np.zeros((6, *shape), np.float32)
        try:
            camera = self.camera.with_extrinsic(extrinsic.astype(np.float64))
        except InputError:
            return image, slope
        part = project_body(self.body, camera, np.eye(4), self.size_mm, self.backend, jacobian=True)
        image[part.slices] = part.image
        slope[(slice(None), *part.slices)] = part.jacobian
        return image, slope
