"""The least-squares problem that both stages solve: rigid bodies in several views, compared by local contrast.

The unknowns are one pose per structure (fixed to moving) and one correction per camera (fixed to fixed); either may
be held.  Everything that does not move rigidly enters a view as a static image that the caller refreshes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import bounding_box, grown_box
from PolyPoseLib.geometry.rigid import about, adjoint_of_correction, perturbation
from PolyPoseLib.registration.fit.camera_prior import WEIGHT, CameraPrior
from PolyPoseLib.registration.fit.linearised import Block, Linearised, overlap_product
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, BodyProjection, project_body
from PolyPoseLib.similarity.local_contrast import LocalContrast

REMEMBERED = 3
"""Projections of a body in a view that are kept: of a state, of a trial that lowers the cost, and of a longer one."""

CameraGroups = Sequence[Sequence[int]]
"""Indices of views whose cameras move: one alone, or those of a rig, which move as one."""


@dataclass
class View:
    """One X-ray at one resolution.

    Attributes
    ----------
    camera : Camera
        Before its correction.
    contrast : LocalContrast
        Local normalisation with the view's mask.
    target : np.ndarray
        (H, W) normalised X-ray.
    static : np.ndarray
        (H, W) line integrals of what does not move rigidly.
    weight : np.ndarray
        (H, W) pixel weights.
    noise_share : np.ndarray | float
        (H, W) share (0 to 1) of noise in the variance of ``target``, or 0.
    expected : CameraPrior, optional
        Of the camera, where it may move.

    """

    camera: Camera
    contrast: LocalContrast
    target: np.ndarray
    static: np.ndarray
    weight: np.ndarray
    noise_share: np.ndarray | float = 0.0
    expected: CameraPrior | None = None

    def cropped_to_weight(self) -> View:
        """The part of the view that its weights depend on, patches of the local contrast included.

        Costs and their derivatives are those of the whole. There must be a pixel that counts.
        """
        return self.cropped_around(self.weight > 0)

    def cropped_around(self, pixels: np.ndarray) -> View:
        """The part of the view that holds pixels (H, W) bool, at least one, and the patches around them."""
        used = bounding_box(pixels)
        assert used is not None
        rows, columns = grown_box(used, self.contrast.size // 2, pixels.shape)
        height, width = self.weight[rows, columns].shape
        camera = self.camera.cropped(rows.start, rows.start + height, columns.start, columns.start + width)
        return View(
            camera,
            self.contrast.cropped(rows, columns),
            self.target[rows, columns],
            self.static[rows, columns],
            self.weight[rows, columns],
            np.broadcast_to(self.noise_share, self.weight.shape)[rows, columns],
            self.expected,
        )


@dataclass(frozen=True)
class State:
    """Values of the unknowns: poses and corrections of cameras.

    Attributes
    ----------
    poses : np.ndarray
        (K, 4, 4) fixed to moving.
    corrections : np.ndarray
        (N, 4, 4) of the cameras, fixed to fixed.

    """

    poses: np.ndarray
    corrections: np.ndarray

    @classmethod
    def of_poses(cls, poses: np.ndarray, views: int) -> State:
        """Poses (K, 4, 4) with the cameras of so many views as they are."""
        return cls(poses, np.stack([np.eye(4)] * views))

    def with_pose(self, k: int, pose: np.ndarray) -> State:
        """The state with another pose (4, 4) of structure ``k``."""
        poses = self.poses.copy()
        poses[k] = pose
        return State(poses, self.corrections)


@dataclass(frozen=True)
class Normal:
    """Gauss-Newton normal equations of P unknowns.

    Attributes
    ----------
    cost : float
        Weighted mean of squared residuals, or what else is minimised.
    matrix : np.ndarray
        (P, P) second derivative of half the cost, to first order in the residuals.
    gradient : np.ndarray
        (P,) of half the cost.

    """

    cost: float
    matrix: np.ndarray
    gradient: np.ndarray


class PosePrior(Protocol):
    """What is expected of the poses whatever the images show."""

    def cost(self, poses: np.ndarray) -> float:
        """For poses (K, 4, 4) fixed to moving."""
        ...

    def costs(self, poses: np.ndarray) -> np.ndarray:
        """(S,) for poses (S, K, 4, 4)."""
        ...

    def add_to(self, poses: np.ndarray, matrix: np.ndarray, gradient: np.ndarray) -> float:
        """Add the Gauss-Newton terms of half the cost to ``matrix`` (P, P) and ``gradient`` (P,); returns the cost."""
        ...


@dataclass
class RigidProblem:
    """Residuals and normal equations of rigid bodies seen in several views.

    Parameters
    ----------
    bodies : sequence of Body
        K of them.
    views : sequence of View
        The X-rays at one resolution.
    free_poses : sequence of int
        Indices of the bodies that move.
    free_cameras : CameraGroups
        The views whose cameras move.
    camera_centre : (3,) ndarray
        LPS mm, about which cameras move.
    step_mm : float
        Distance of ray samples.
    backend : Backend
        Carries out the rays.
    prior : PosePrior, optional
        What is expected of the poses.

    """

    bodies: Sequence[Body]
    views: Sequence[View]
    free_poses: Sequence[int]
    free_cameras: CameraGroups
    camera_centre: np.ndarray
    step_mm: float
    backend: Backend
    prior: PosePrior | None = None
    _latest: dict[tuple[int, int], list[tuple[Camera, np.ndarray, BodyProjection]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

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
        for n, group in enumerate(self.free_cameras):
            delta = step[offset + 6 * n : offset + 6 * n + 6]
            for v in group:
                corrections[v] = about(perturbation(delta), self.camera_centre) @ corrections[v]
        return State(poses, corrections)

    def camera_group(self, view_index: int) -> int | None:
        """Which of the free groups of cameras a view's belongs to, None where its camera stays."""
        return next((n for n, group in enumerate(self.free_cameras) if view_index in group), None)

    def render(
        self, state: State, view_index: int, jacobian: bool = False
    ) -> tuple[np.ndarray, list[BodyProjection]]:
        """Line integrals (H, W) of a view, and the projection of each body."""
        projections = self.project(state, view_index, jacobian)
        return summed(self.views[view_index].static, projections), projections

    def project(self, state: State, view_index: int, jacobian: bool = False) -> list[BodyProjection]:
        """The projection of each body in a view."""
        moves = self.camera_group(view_index) is not None
        return [
            self.projection(k, state, view_index, jacobian and (moves or k in self.free_poses))
            for k in range(len(self.bodies))
        ]

    def projection(self, k: int, state: State, view_index: int, jacobian: bool = False) -> BodyProjection:
        """The projection of one body in a view.

        The latest ones without a Jacobian are remembered: costs, weights and comparisons ask for the same ones.
        """
        pose, camera = state.poses[k] @ state.corrections[view_index], self.views[view_index].camera
        latest = self._latest.setdefault((k, view_index), [])
        for by, at, part in latest if not jacobian else ():
            if by is camera and np.array_equal(at, pose):
                return part
        part = project_body(self.bodies[k], camera, pose, self.step_mm, self.backend, jacobian)
        if not jacobian:
            latest.insert(0, (camera, pose, part))
            del latest[REMEMBERED:]
        return part

    def render_without(self, body: int, state: State, view_index: int) -> np.ndarray:
        """Line integrals (H, W) of a view with one body left out."""
        view = self.views[view_index]
        image = view.static.astype(np.float32).copy()
        for k in range(len(self.bodies)):
            if k != body:
                projection = self.projection(k, state, view_index)
                image[projection.slices] += projection.image
        return image

    def residual(self, state: State, view_index: int) -> np.ndarray:
        """Normalised rendering less normalised X-ray, (H, W)."""
        image, _ = self.render(state, view_index)
        view = self.views[view_index]
        return view.contrast.normalise(image).values - view.target

    def cost(self, state: State) -> float:
        """Weighted mean of squared residuals over all views (0 = identical, 2 = unrelated), plus the prior."""
        images = sum(self._view_cost(self.residual(state, n), view) for n, view in enumerate(self.views))
        return images * self.scale() + self.expected_cost(state)

    def expected_cost(self, state: State) -> float:
        """What the priors of poses and cameras add to the images' cost."""
        expected = self.prior.cost(state.poses) if self.prior else 0.0
        deviations = (deviation for _, deviation, _ in self._camera_deviations(state))
        return expected + WEIGHT * sum(float(each @ each) for each in deviations)

    def add_expected(self, state: State, matrix: np.ndarray, gradient: np.ndarray) -> float:
        """Add the priors' Gauss-Newton terms to ``matrix`` (P, P) and ``gradient`` (P,); returns their cost."""
        expected = self.prior.add_to(state.poses, matrix, gradient) if self.prior else 0.0
        for first, deviation, radii in self._camera_deviations(state):
            where = np.arange(first, first + 6)
            matrix[where, where] += WEIGHT / radii**2
            gradient[where] += WEIGHT * deviation / radii
            expected += WEIGHT * float(deviation @ deviation)
        return expected

    def normal_equations(self, state: State) -> Normal:
        """Gauss-Newton normal equations at ``state``."""
        matrix = np.zeros((self.size, self.size))
        gradient = np.zeros(self.size)
        cost, scale = 0.0, self.scale()
        for n, view in enumerate(self.views):
            linear = self.linearise(state, n)
            cost += self._view_cost(linear.residual, view)
            weighted = [block.jacobian * view.weight[block.slices] for block in linear.blocks]
            for a, block in enumerate(linear.blocks):
                rows = slice(block.first, block.first + 6)
                residual = linear.residual[block.slices]
                gradient[rows] += scale * (weighted[a].reshape(6, -1) @ residual.reshape(-1))
                for b in range(a + 1):
                    product = scale * overlap_product(block, weighted[a], linear.blocks[b])
                    columns = slice(linear.blocks[b].first, linear.blocks[b].first + 6)
                    matrix[rows, columns] += product
                    if b != a:
                        matrix[columns, rows] += product.T
        return Normal(cost * scale + self.add_expected(state, matrix, gradient), matrix, gradient)

    def linearise(self, state: State, view_index: int) -> Linearised:
        """Residual of a view and its derivative by those unknowns that the view depends on."""
        view = self.views[view_index]
        image, projections = self.render(state, view_index, jacobian=True)
        normalised = view.contrast.normalise(image)
        blocks = []
        group = self.camera_group(view_index)
        camera_change = None if group is None else np.zeros((6, *image.shape), np.float32)
        for k, projection in enumerate(projections):
            if projection.jacobian is None or projection.image.size == 0:
                continue
            if k in self.free_poses:
                change, window = view.contrast.derivative(normalised, projection.jacobian, projection.window)
                blocks.append(Block(6 * self.free_poses.index(k), window, change))
            if camera_change is not None:
                spread = adjoint_of_correction(state.poses[k], self.bodies[k].centre, self.camera_centre)
                moved = np.tensordot(spread.T.astype(np.float32), projection.jacobian, 1)
                camera_change[(slice(None), *projection.slices)] += moved
        if camera_change is not None and group is not None:
            whole = (0, image.shape[0], 0, image.shape[1])
            change, window = view.contrast.derivative(normalised, camera_change, whole)
            first = 6 * (len(self.free_poses) + group)
            blocks.append(Block(first, window, change))
        return Linearised(normalised.values - view.target, blocks)

    def _camera_deviations(self, state: State) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
        """(number of the first unknown, deviation (6,), radii (6,)) of every group of cameras with a prior."""
        for n, group in enumerate(self.free_cameras):
            view, correction = self.views[group[0]], state.corrections[group[0]]
            if view.expected is not None:
                deviation = view.expected.deviation(view.camera, correction, self.camera_centre)
                yield 6 * (len(self.free_poses) + n), deviation, view.expected.radii

    def scale(self) -> float:
        """One over the sum of all views' weights."""
        return 1.0 / max(sum(float(view.weight.sum()) for view in self.views), 1e-6)

    @staticmethod
    def _view_cost(residual: np.ndarray, view: View) -> float:
        return float((view.weight * residual.astype(np.float64) ** 2).sum())


def summed(static: np.ndarray, projections: Iterable[BodyProjection]) -> np.ndarray:
    """(H, W) a static image with projections of bodies in front of it."""
    image = static.astype(np.float32).copy()
    for projection in projections:
        image[projection.slices] += projection.image
    return image


def corrected(camera: Camera, correction: np.ndarray) -> Camera:
    """The camera with a correction (4, 4), fixed to fixed, folded into its extrinsic."""
    return camera.with_extrinsic(camera.extrinsic @ np.linalg.inv(correction))


@dataclass(frozen=True)
class JointResult:
    """What the joint fit found.

    Attributes
    ----------
    cameras : list[Camera]
        Refined.
    problem : RigidProblem
        Of the last level.
    state : State
        Where its solver stopped.

    """

    cameras: list[Camera]
    problem: RigidProblem
    state: State

    @property
    def poses(self) -> np.ndarray:
        """(K, 4, 4) fixed to moving."""
        return self.state.poses

    def with_poses(self, poses: np.ndarray) -> JointResult:
        """The same with other poses (K, 4, 4)."""
        return replace(self, state=State(poses, self.state.corrections))
