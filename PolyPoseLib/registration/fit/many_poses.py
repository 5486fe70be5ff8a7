"""One bone's least-squares problem, evaluated at many poses at once."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.registration.fit.device_poses import DevicePoses
from PolyPoseLib.registration.fit.lockstep import ManyPoses, Normals
from PolyPoseLib.registration.fit.problem import RigidProblem, View
from PolyPoseLib.rendering.pose_images import PoseImages, project_poses
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.similarity.contrast_kernel_arguments import ContrastView


def at_many_poses(problem: RigidProblem) -> ManyPoses:
    """The problem of one body in front of static images, its cameras held, for many poses at once.

    Parameters
    ----------
    problem : RigidProblem
        With one body, whose pose is the only unknown.

    Returns
    -------
    ManyPoses
        On torch's device where torch renders, else by compiled loops.

    """
    if isinstance(problem.backend, TorchBackend):
        return DevicePoses(problem, problem.backend)
    return _Together(problem)


class _Together:
    """All poses in one go through compiled loops."""

    def __init__(self, problem: RigidProblem) -> None:
        self._problem = problem
        self.centre = problem.bodies[0].centre
        self._views = [contrast_view(view) for view in problem.views]
        self._scale = problem.scale()

    def costs(self, poses: np.ndarray) -> np.ndarray:
        """See :class:`ManyPoses`."""
        from PolyPoseLib.similarity import contrast_kernels

        costs = np.zeros(len(poses))
        for n, view in enumerate(self._views):
            shown = self._project(n, poses, False)
            contrast_kernels.costs_of_images(shown.images, shown.windows, view, costs)
        costs *= self._scale
        prior = self._problem.prior
        if prior is not None:
            costs += prior.costs(poses[:, None])
        return costs

    def normal_equations(self, poses: np.ndarray) -> Normals:
        """See :class:`ManyPoses`."""
        from PolyPoseLib.similarity import contrast_kernels

        count = len(poses)
        costs, matrices, gradients = np.zeros(count), np.zeros((count, 6, 6)), np.zeros((count, 6))
        for n, view in enumerate(self._views):
            shown = self._project(n, poses, True)
            contrast_kernels.normals_of_images(
                shown.images, shown.jacobians, shown.windows, view, costs, matrices, gradients
            )
        for values in (costs, matrices, gradients):
            values *= self._scale
        prior = self._problem.prior
        if prior is not None:
            for n, pose in enumerate(poses):
                costs[n] += prior.add_to(pose[None], matrices[n], gradients[n])
        return Normals(costs, matrices, gradients)

    def _project(self, n: int, poses: np.ndarray, jacobian: bool) -> PoseImages:
        body, camera = self._problem.bodies[0], self._problem.views[n].camera
        return project_poses(body, camera, poses, self._problem.step_mm, jacobian)


def contrast_view(view: View) -> ContrastView:
    """A view as the compiled loops take it; its static image is the background."""
    contrast = view.contrast
    normalised = contrast.normalise(view.static)
    residual = normalised.values - view.target
    background_cost = view.weight * residual.astype(np.float64) ** 2
    noise = np.broadcast_to(np.asarray(contrast.noise, np.float64), contrast.mask.shape)
    return ContrastView(
        normalised.centred.astype(np.float64),
        background_cost,
        float(background_cost.sum()),
        contrast.mask,
        np.ascontiguousarray(contrast.share, np.float32),
        contrast.support,
        np.ascontiguousarray(view.target, np.float32),
        np.ascontiguousarray(view.weight, np.float32),
        contrast.floor**2 + noise**2,
        contrast.size,
    )
