"""The least-squares problem of all bodies in all views on torch's device, in one batch.

What a step of the solver needs, the cost and the normal equations of :class:`RigidProblem`, is computed without a copy
back but for the sums. On a CPU without numba the problem itself is faster, for it skips what lies between the bodies.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.geometry.rigid import adjoint_of_correction
from PolyPoseLib.registration.fit.device_views import DeviceView, jacobians
from PolyPoseLib.registration.fit.levenberg_marquardt import Problem
from PolyPoseLib.registration.fit.problem import Normal, RigidProblem, State
from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.rigid import index_rays
from PolyPoseLib.rendering.torch_atlas import Atlas, all_lines, all_moments
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.rendering.torch_rays import Blocks, Bundle, ImageRays, bundle, depth_ranges


def as_solved(problem: RigidProblem) -> Problem[State]:
    """The problem as the solver is best given it: in one batch where a GPU renders, as it is elsewhere."""
    backend = problem.backend
    if isinstance(backend, TorchBackend) and backend.device.type == "cuda":
        return DeviceProblem(problem, backend)
    return problem


class DeviceProblem:
    """Cost and normal equations of a problem, whose views may change between calls.

    Parameters
    ----------
    problem : RigidProblem
        K bodies in V views.
    backend : TorchBackend
        The problem's.

    """

    def __init__(self, problem: RigidProblem, backend: TorchBackend) -> None:
        self._problem, self._backend, self._device = problem, backend, backend.device
        self._atlas = Atlas.of([backend.on_device(body.voxels) for body in problem.bodies])
        count, views = len(problem.bodies), len(problem.views)
        self._owner = torch.arange(count, device=self._device).repeat_interleave(views)
        centres, halves, images = [], [], []
        for k, body in enumerate(problem.bodies):
            for n in range(views):
                centres.append(body.occupied.centres)
                halves.append(np.full_like(body.occupied.centres, body.occupied.half_edge))
                images.append(np.full(len(body.occupied.centres), k * views + n))
        self._blocks = Blocks(
            torch.as_tensor(np.concatenate(images), device=self._device),
            self._exact(np.concatenate(centres)),
            self._exact(np.concatenate(halves)),
        )

    @property
    def size(self) -> int:
        """See :attr:`RigidProblem.size`."""
        return self._problem.size

    def moved(self, state: State, step: np.ndarray) -> State:
        """See :meth:`RigidProblem.moved`."""
        return self._problem.moved(state, step)

    def cost(self, state: State) -> float:
        """See :meth:`RigidProblem.cost`."""
        found, rays = self._bundle(state)
        lines = all_lines(self._atlas, self._owner[found.image], found, rays)
        lines = lines.reshape(len(self._problem.bodies), len(self._problem.views), rays.rows, rays.columns)
        images = torch.zeros((), dtype=torch.float64, device=self._device)
        for n, view in enumerate(self._problem.views):
            shown = DeviceView.of(view, self._device)
            image = lines[:, n, : view.camera.height, : view.camera.width].sum(0)[None]
            images += shown.costs(shown.normalised(image).values)[0]
        return float(images) * self._problem.scale() + self._problem.expected_cost(state)

    def normal_equations(self, state: State) -> Normal:
        """See :meth:`RigidProblem.normal_equations`."""
        problem = self._problem
        found, rays = self._bundle(state)
        lines, moments = all_moments(self._atlas, self._owner[found.image], found, rays)
        shape = (len(problem.bodies), len(problem.views), rays.rows, rays.columns)
        lines, moments = lines.reshape(shape), moments.reshape(*shape, 6)
        sums = torch.zeros((problem.size + 1,) * 2, dtype=torch.float64, device=self._device)
        for n, view in enumerate(problem.views):
            rows, columns = slice(view.camera.height), slice(view.camera.width)
            image = lines[:, n, rows, columns]
            changes, where = self._changes(state, n, image, moments[:, n, rows, columns])
            shown = DeviceView.of(view, self._device)
            products = shown.products(image.sum(0)[None], changes[None])[0]
            where = torch.cat([where, torch.tensor([problem.size], device=self._device)])
            sums[where[:, None], where] += products
        whole = problem.scale() * sums.cpu().numpy()
        cost, matrix, gradient = float(whole[-1, -1]), whole[:-1, :-1].copy(), whole[:-1, -1].copy()
        return Normal(cost + problem.add_expected(state, matrix, gradient), matrix, gradient)

    def _changes(self, state: State, n: int, image: Tensor, moments: Tensor) -> tuple[Tensor, Tensor]:
        """Derivatives (P, H, W) of a view by the unknowns it depends on, and their numbers (P,)."""
        problem, parts, numbers = self._problem, [], []
        group = problem.camera_group(n)
        camera_change = torch.zeros((6, *image.shape[1:]), device=self._device)
        for k, body in enumerate(problem.bodies):
            free = k in problem.free_poses
            if not free and group is None:
                continue
            pose = self._exact(state.poses[k] @ state.corrections[n])[None]
            own = jacobians(body, problem.views[n].camera, pose, image[k][None], moments[k][None])[0]
            if free:
                parts.append(own)
                numbers.append(6 * problem.free_poses.index(k))
            if group is not None:
                spread = adjoint_of_correction(state.poses[k], body.centre, problem.camera_centre)
                camera_change += torch.tensordot(self._exact(spread.T).float(), own, 1)
        if group is not None:
            parts.append(camera_change)
            numbers.append(6 * (len(problem.free_poses) + group))
        if not parts:
            return image[:0], torch.zeros(0, dtype=torch.int64, device=self._device)
        where = np.concatenate([np.arange(first, first + 6) for first in numbers])
        return torch.cat(parts), torch.as_tensor(where, device=self._device)

    def _bundle(self, state: State) -> tuple[Bundle, ImageRays]:
        """The rays of all bodies in all views, body after body."""
        problem = self._problem
        rows = max(view.camera.height for view in problem.views)
        columns = max(view.camera.width for view in problem.views)
        cameras = [view.camera for view in problem.views]
        each = [
            index_rays(body, camera, pose @ correction, (0, camera.height, 0, camera.width), problem.step_mm)
            for body, pose in zip(problem.bodies, state.poses, strict=True)
            for camera, correction in zip(cameras, state.corrections, strict=True)
        ]
        stacked = IndexRays(
            np.stack([one.source for one in each]),
            np.stack([one.corner for one in each]),
            np.stack([one.per_column for one in each]),
            np.stack([one.per_row for one in each]),
            np.stack([one.inverse_intrinsics for one in each]),
            rows,
            columns,
            problem.step_mm,
        )
        rays = self._backend.image_rays(stacked)
        heights, widths = np.array([one.shape for one in each]).T
        near, far = depth_ranges(self._blocks, rays)
        beyond = (torch.arange(rows, device=self._device) >= self._exact(heights)[:, None])[:, :, None]
        beyond = (
            beyond | (torch.arange(columns, device=self._device) >= self._exact(widths)[:, None])[:, None]
        )
        far = far.masked_fill(beyond, -torch.inf)
        high = (self._atlas.size[self._owner] - 1).double()
        return bundle(rays, torch.zeros_like(high), high, near, far), rays

    def _exact(self, values: object) -> Tensor:
        return torch.as_tensor(np.asarray(values, np.float64), device=self._device)
