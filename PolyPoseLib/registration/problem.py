"""The least-squares problem that both stages solve: rigid bodies in several views, compared by local contrast.

The unknowns are one pose per structure (fixed to moving) and one correction per camera (fixed to fixed); either may
be held.  Everything that does not move rigidly enters a view as a static image that the caller refreshes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.local_contrast import LocalContrast
from PolyPoseLib.registration.rigid_motion import about, adjoint_of_correction, perturbation
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, BodyProjection, project_body


@dataclass
class View:
    """One X-ray at one resolution.

    camera: as guessed; contrast: local normalisation with the view's mask; target: (H, W) normalised X-ray;
    static: (H, W) line integrals of what does not move rigidly; weight: (H, W) pixel weights.
    """

    camera: Camera
    contrast: LocalContrast
    target: np.ndarray
    static: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class State:
    """poses: (K, 4, 4) fixed to moving; corrections: (N, 4, 4) of the cameras, fixed to fixed."""

    poses: np.ndarray
    corrections: np.ndarray


@dataclass(frozen=True)
class Normal:
    """cost: weighted mean of squared residuals; matrix: (P, P); gradient: (P,) of half that cost, or None."""

    cost: float
    matrix: np.ndarray | None
    gradient: np.ndarray | None


@dataclass(frozen=True)
class Linearised:
    """residual: (H, W); columns: (p,) numbers of the unknowns it depends on; jacobian: (p, H, W)."""

    residual: np.ndarray
    columns: np.ndarray
    jacobian: np.ndarray


class RigidProblem:
    """Residuals and normal equations of rigid bodies seen in several views.

    bodies: K of them; free_poses: indices of those that move; free_cameras: indices of views whose camera moves,
    about ``camera_centre`` (3,) LPS mm; step_mm: distance of ray samples; backend: carries out the rays.
    """

    def __init__(
        self,
        bodies: Sequence[Body],
        views: Sequence[View],
        free_poses: Sequence[int],
        free_cameras: Sequence[int],
        camera_centre: np.ndarray,
        step_mm: float,
        backend: Backend,
    ) -> None:
        self.bodies = list(bodies)
        self.views = list(views)
        self.free_poses = list(free_poses)
        self.free_cameras = list(free_cameras)
        self.camera_centre = camera_centre
        self.step_mm = step_mm
        self.backend = backend

    @property
    def size(self) -> int:
        """Number of scalar unknowns."""
        return 6 * (len(self.free_poses) + len(self.free_cameras))

    def moved(self, state: State, step: np.ndarray) -> State:
        """State after a step (P,): structures first, then cameras, six numbers each."""
        poses, corrections = state.poses.copy(), state.corrections.copy()
        for n, k in enumerate(self.free_poses):
            poses[k] = about(perturbation(step[6 * n : 6 * n + 6]), self.bodies[k].centre) @ poses[k]
        offset = 6 * len(self.free_poses)
        for n, v in enumerate(self.free_cameras):
            delta = step[offset + 6 * n : offset + 6 * n + 6]
            corrections[v] = about(perturbation(delta), self.camera_centre) @ corrections[v]
        return State(poses, corrections)

    def render(
        self, state: State, view_index: int, jacobian: bool = False
    ) -> tuple[np.ndarray, list[BodyProjection]]:
        """Line integrals (H, W) of a view, and the projection of each body."""
        view = self.views[view_index]
        image = view.static.astype(np.float32).copy()
        projections = []
        for k, body in enumerate(self.bodies):
            wanted = jacobian and (k in self.free_poses or view_index in self.free_cameras)
            pose = state.poses[k] @ state.corrections[view_index]
            projection = project_body(body, view.camera, pose, self.step_mm, self.backend, wanted)
            row0, row1, column0, column1 = projection.window
            image[row0:row1, column0:column1] += projection.image
            projections.append(projection)
        return image, projections

    def residual(self, state: State, view_index: int) -> np.ndarray:
        """Normalised rendering less normalised X-ray, (H, W)."""
        image, _ = self.render(state, view_index)
        view = self.views[view_index]
        return view.contrast.normalise(image).values - view.target

    def cost(self, state: State) -> float:
        """Weighted mean of squared residuals over all views (0 = identical, 2 = unrelated)."""
        return self._mean([self._view_cost(self.residual(state, n), v) for n, v in enumerate(self.views)])

    def normal_equations(self, state: State) -> Normal:
        """Gauss-Newton normal equations at ``state``."""
        matrix = np.zeros((self.size, self.size))
        gradient = np.zeros(self.size)
        costs = []
        for n, view in enumerate(self.views):
            linear = self.linearise(state, n)
            costs.append(self._view_cost(linear.residual, view))
            if not len(linear.columns):
                continue
            used = view.weight > 0
            scale = 1.0 / (len(self.views) * max(float(view.weight.sum()), 1e-6))
            jacobian = linear.jacobian[:, used]
            weighted = jacobian * view.weight[used]
            matrix[np.ix_(linear.columns, linear.columns)] += scale * (weighted @ jacobian.T)
            gradient[linear.columns] += scale * (weighted @ linear.residual[used])
        return Normal(self._mean(costs), matrix, gradient)

    def linearise(self, state: State, view_index: int) -> Linearised:
        """Residual of a view and its derivative by those unknowns that the view depends on."""
        view = self.views[view_index]
        image, projections = self.render(state, view_index, jacobian=True)
        normalised = view.contrast.normalise(image)
        residual = normalised.values - view.target
        shape = residual.shape
        columns, blocks = [], []
        camera_free = view_index in self.free_cameras
        camera_change = np.zeros((6, *shape), np.float32) if camera_free else None
        for k, projection in enumerate(projections):
            if projection.jacobian is None or projection.image.size == 0:
                continue
            if k in self.free_poses:
                change, window = view.contrast.derivative(normalised, projection.jacobian, projection.window)
                block = np.zeros((6, *shape), np.float32)
                block[:, window[0] : window[1], window[2] : window[3]] = change
                blocks.append(block)
                columns.append(6 * self.free_poses.index(k))
            if camera_change is not None:
                spread = adjoint_of_correction(state.poses[k], self.bodies[k].centre, self.camera_centre)
                row0, row1, column0, column1 = projection.window
                moved = np.tensordot(spread.T.astype(np.float32), projection.jacobian, 1)
                camera_change[:, row0:row1, column0:column1] += moved
        if camera_change is not None:
            change, _ = view.contrast.derivative(normalised, camera_change, (0, shape[0], 0, shape[1]))
            blocks.append(change)
            columns.append(6 * (len(self.free_poses) + self.free_cameras.index(view_index)))
        index = [first + n for first in columns for n in range(6)]
        jacobian = np.concatenate(blocks) if blocks else np.zeros((0, *shape), np.float32)
        return Linearised(residual, np.array(index, int), jacobian)

    @staticmethod
    def _view_cost(residual: np.ndarray, view: View) -> float:
        return float(
            (view.weight * residual.astype(np.float64) ** 2).sum() / max(float(view.weight.sum()), 1e-6)
        )

    @staticmethod
    def _mean(costs: list[float]) -> float:
        return sum(costs) / len(costs)
