"""Stage B: all structures together in all views, and the cameras once more with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.registration.articulations import ArticulationPrior
from PolyPoseLib.registration.bones.rejection import restart_inconsistent
from PolyPoseLib.registration.bones.restarts import restart_bones
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm, view_at
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import JointResult, RigidProblem, State, corrected
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.weighting import dilated, projection_mask, robust_weight
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

REACH_MM = 10.0
"""The X-rays count this far around the moving bones."""

REFRESH_EVERY = 3
"""Iterations after which weights, and soft tissue when bones moved, are made anew."""

SOFT_TISSUE_TOLERANCE = 0.1
"""Motion, in pixels, that the rendered soft tissue may lag behind."""

BONE_RADIUS_MM = 50.0
"""Lever at which a bone's rotation is counted as motion."""


@dataclass(frozen=True)
class JointStage:
    """One level of the fit.

    Before it, every bone is started anew at ``restart`` (None: not), and bones that the X-rays contradict at each of
    the levels ``again``.
    """

    level: Level
    restart: Level | None = None
    again: tuple[Level, ...] = ()


def fit_structures(
    scene: Scene,
    soft: SoftTissue,
    measured: Sequence[Observation],
    poses: np.ndarray,
    free_cameras: Sequence[int],
    stages: Sequence[JointStage],
    backend: Backend,
    monitor: Monitor,
    preview: Callable[[DisplacementField], str | None] | None = None,
) -> JointResult:
    """Fit all structures from ``poses`` (K, 4, 4), coarse to fine.

    free_cameras: indices of the X-rays whose camera may still move; preview: given the coarse displacement field
    whenever it is made anew.
    """
    total = sum(stage.level.iterations for stage in stages)
    done = 0
    measured = list(measured)
    for stage in stages:
        if stage.restart is not None:
            poses = restart_bones(scene, soft, measured, poses, stage.restart, backend, monitor)
        if stage.again:
            poses = restart_inconsistent(scene, soft, measured, poses, stage.again, backend, monitor)
        fit = _LevelFit(scene, soft, measured, free_cameras, stage.level, backend)

        def before_step(
            state: State, iteration: int, cost: float, fit: _LevelFit = fit, done: int = done
        ) -> None:
            renewed = fit.refresh(state, iteration)
            show = (lambda: preview(fit.field)) if preview is not None and renewed else None
            monitor.step("bones", done + iteration, total, None if iteration == 0 else 1 - cost / 2, show)

        start = State(poses, np.stack([np.eye(4)] * len(measured)))
        solution = minimise(fit.problem, start, SolverOptions(fit.level.iterations), before_step)
        poses = solution.state.poses
        measured = [
            m.with_camera(corrected(m.camera, c))
            for m, c in zip(measured, solution.state.corrections, strict=True)
        ]
        done += stage.level.iterations
    return JointResult(poses, [m.camera for m in measured], fit.problem, solution.state)


class _LevelFit:
    """One level: its problem, and the parts of it that follow the state."""

    def __init__(
        self,
        scene: Scene,
        soft: SoftTissue,
        measured: Sequence[Observation],
        free_cameras: Sequence[int],
        level: Level,
        backend: Backend,
    ) -> None:
        self.soft, self.level, self.backend = soft, level, backend
        self.field: DisplacementField | None = None
        self._rendered: State | None = None
        self.centre = scene.anchor_centre
        views = [view_at(level, m, self.centre) for m in measured]
        moving = [k for k in range(len(scene.names)) if k != scene.anchor]
        bodies = scene.bodies(level.size_mm)
        prior = ArticulationPrior(scene.articulations, scene.centres, moving, level.joint_weight)
        self.problem = RigidProblem(
            bodies, views, moving, free_cameras, self.centre, level.size_mm, backend, prior
        )
        self.everything = list(range(len(scene.names)))
        self.moving = moving

    def refresh(self, state: State, iteration: int) -> bool:
        """Renew the weights now and then, and the soft tissue when bones moved; True when that was renewed."""
        if iteration % REFRESH_EVERY:
            return False
        moved = self._moved_since_rendered(state)
        if moved:
            self.field = self.soft.coarse_field(state.poses)
            self._rendered = state
        for n, view in enumerate(self.problem.views):
            if moved:
                correction = state.corrections[n]
                view.static = self.soft.render(
                    self.field, view.camera, correction, self.level.size_mm, self.backend
                )
            which = self.everything if n in self.problem.free_cameras else self.moving
            reach = REACH_MM / pixel_size_mm(view.camera, self.centre)
            region = dilated(projection_mask(self.problem, state, n, which), reach)
            view.weight = robust_weight(view, self.problem.residual(state, n), region)
        return moved

    def _moved_since_rendered(self, state: State) -> bool:
        """Whether a bone or a camera moved by more than a tenth of a pixel since the soft tissue was rendered."""
        if self._rendered is None:
            return True
        centres = np.array([body.centre for body in self.problem.bodies])
        change = max(
            _largest_shift(state.poses, self._rendered.poses, centres),
            _largest_shift(state.corrections, self._rendered.corrections, self.centre[None]),
        )
        return change > SOFT_TISSUE_TOLERANCE * self.level.size_mm


def _largest_shift(now: np.ndarray, then: np.ndarray, centres: np.ndarray) -> float:
    """Largest displacement (mm) of points BONE_RADIUS_MM around the centres (M, 3) between motions (M, 4, 4)."""
    difference = now - then
    turn = np.linalg.norm(difference[:, :3, :3], axis=(1, 2)) * BONE_RADIUS_MM
    shift = np.linalg.norm(
        np.einsum("mab,mb->ma", difference[:, :3, :3], np.broadcast_to(centres, (len(now), 3)))
        + difference[:, :3, 3],
        axis=1,
    )
    return float((turn + shift).max())
