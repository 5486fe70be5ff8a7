"""One bone's least-squares problem at many poses at once, in torch on a CPU or a GPU.

Images, residuals and normal equations stay on the device; only costs and 6 x 6 systems come back.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.registration.fit.device_views import DeviceView, jacobians
from PolyPoseLib.registration.fit.lockstep import Normals
from PolyPoseLib.registration.fit.problem import RigidProblem
from PolyPoseLib.rendering.rigid import index_rays
from PolyPoseLib.rendering.torch_backend import TorchBackend

MOST_PIXELS = {"cpu": 1 << 19, "cuda": 1 << 22}
"""Pixels, over all poses, that are held at once on a device; about 300 bytes each."""


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
        self._views = [DeviceView.of(view, backend.device) for view in problem.views]
        self._scale = problem.scale()

    def costs(self, poses: np.ndarray) -> np.ndarray:
        """See :class:`PolyPoseLib.registration.fit.lockstep.ManyPoses`."""
        prior = self._problem.prior
        expected = prior.costs(poses[:, None]) if prior else np.zeros(len(poses))
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
        rays = index_rays(body, camera, poses, (0, camera.height, 0, camera.width), self._problem.step_mm)
        image, moments = self._backend.sums(
            body.voxels, self._backend.image_rays(rays), jacobian, body.occupied
        )
        if moments is None:
            return image, None
        placed = torch.as_tensor(poses, dtype=torch.float64, device=self._backend.device)
        return image, jacobians(body, camera, placed, image, moments)
