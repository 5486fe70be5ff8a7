"""Stage B: all structures together in all views, and the cameras once more with them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.registration.bones.agreement import structure_agreement
from PolyPoseLib.registration.bones.rejection import restart_inconsistent
from PolyPoseLib.registration.bones.restarts import restart_bones
from PolyPoseLib.registration.bones.rows import rejoined
from PolyPoseLib.registration.bones.visibility import structure_visibility
from PolyPoseLib.registration.cameras.anchor_alone import refine_by_anchor_alone
from PolyPoseLib.registration.fit.device_problem import as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import CameraGroups, JointResult, State, corrected
from PolyPoseLib.registration.fit.soft_motion import fit_soft_motion
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.unexplained_objects import unexplained_objects
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.run import Run

REFRESH_EVERY = 3
"""Iterations after which weights, and the soft tissue when bones moved, are renewed."""

SOFT_TISSUE_TOLERANCE = 0.1
"""Motion, in pixels, that the rendered soft tissue may lag behind."""

MOSTLY_HIDDEN = 0.6
"""Share behind metal from which on a bone is held by its joints whether or not the X-rays contradict it: too little of
it shows for that."""

BONE_RADIUS_MM = 50.0
"""Lever at which a bone's rotation is counted as motion."""


@dataclass(frozen=True)
class JointStage:
    """One level of the joint fit.

    Parameters
    ----------
    level : Level
        The resolution.
    restart : Level, optional
        At which every bone is restarted before.
    restart_inconsistent : tuple of Level
        At which bones that the X-rays contradict are restarted before.
    without_objects : bool
        Whether metal and instruments around bones that the X-rays contradict are left out from here on.
    soft_motion : bool
        Whether the soft tissue's motion beside the bones' is fitted.
    anchor : Level, optional
        At which cameras are refined by the anchor alone before.
    holds_cameras : bool
        Whether cameras stand still while the bones are fitted.

    """

    level: Level
    restart: Level | None = None
    restart_inconsistent: tuple[Level, ...] = ()
    without_objects: bool = False
    soft_motion: bool = False
    anchor: Level | None = None
    holds_cameras: bool = False


@dataclass(frozen=True)
class StructureFit:
    """observations: the X-rays with the cameras found, and without what was left out; joint: of the last level;
    soft_tissue: with the motion that was found beside the bones'.
    """

    observations: Sequence[Observation]
    joint: JointResult
    soft_tissue: SoftTissue


def fit_structures(
    run: Run,
    observations: Sequence[Observation],
    poses: np.ndarray,
    free_cameras: CameraGroups,
    stages: Sequence[JointStage],
    placed: Collection[int] = (),
) -> StructureFit:
    """Fit all structures together, coarse to fine.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observations : sequence of Observation
        The X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving, where to start.
    free_cameras : CameraGroups
        The X-rays whose cameras may still move, those of a rig as one.
    stages : sequence of JointStage
        At least one.
    placed : collection of int
        Structures that somebody has put where they start: they are not restarted.

    Returns
    -------
    StructureFit
        As the last level left it.

    """
    total = sum(stage.level.iterations for stage in stages)
    last_soft = max((n for n, stage in enumerate(stages) if stage.soft_motion), default=None)
    unplaced = [k for k in run.scene.moving if k not in placed]
    given = observations
    done = 0
    fitted: JointResult | None = None
    for number, stage in enumerate(stages):
        if stage.without_objects:
            contradicted = structure_agreement(run, observations, poses).inconsistent(run.scene.anchor)
            observations = _without_objects(run, given, observations, poses, contradicted)
            share = structure_visibility(run.scene, observations, poses).hidden_share
            held = {*run.hidden, *contradicted} | {k for k in run.scene.moving if share[k] > MOSTLY_HIDDEN}
            run = replace(run, hidden={k: float(share[k]) for k in held})
        if stage.anchor is not None and free_cameras:
            observations = refine_by_anchor_alone(run, observations, poses, free_cameras, stage.anchor)
        if stage.restart is not None and unplaced:
            poses = restart_bones(run, observations, poses, stage.restart, unplaced)
            poses = rejoined(run, observations, poses, stage.restart, unplaced)
        if stage.restart_inconsistent and unplaced:
            poses = restart_inconsistent(run, observations, poses, stage.restart_inconsistent, unplaced)
            poses = rejoined(run, observations, poses, stage.restart_inconsistent[-1], unplaced)
        here = run.named("bones").at_level(stage.level.size_mm)
        fit = _LevelFit(here, observations, stage, () if stage.holds_cameras else free_cameras)
        fitted = fit.fit(poses, done, total)
        soft_tissue = fit.views.run.soft_tissue
        run = replace(
            run, soft_tissue=soft_tissue.of_likeliest_size() if number == last_soft else soft_tissue
        )
        poses = fitted.poses
        observations = [o.with_camera(c) for o, c in zip(observations, fitted.cameras, strict=True)]
        done += stage.level.iterations
    assert fitted is not None, "there is at least one stage"
    return StructureFit(observations, fitted, run.soft_tissue)


def _without_objects(
    run: Run,
    given: Sequence[Observation],
    observations: Sequence[Observation],
    poses: np.ndarray,
    bones: Collection[int],
) -> list[Observation]:
    """The X-rays as given, with their present cameras, without objects that these bones' renderings do not have.

    What an earlier level left out counts again: its bones may have been elsewhere.
    """
    anew = [before.with_camera(now.camera) for before, now in zip(given, observations, strict=True)]
    return [each.without(unexplained_objects(run, each, poses, bones)) for each in anew]


class _LevelFit:
    """One level: its problem, and the parts of it that follow the state."""

    def __init__(
        self, run: Run, observations: Sequence[Observation], stage: JointStage, free_cameras: CameraGroups
    ) -> None:
        self.run, self.stage, self.level, self.observations = run, stage, stage.level, observations
        self.views = LevelViews(run, observations, stage.level)
        self.problem = self.views.structures(run.scene.moving, free_cameras)
        self._rendered: State | None = None

    def fit(self, poses: np.ndarray, done: int, total: int) -> JointResult:
        """Fit from poses (K, 4, 4); done, total: iterations of the levels before and of all."""

        def before_step(state: State, iteration: int, cost: float) -> None:
            field = self._refresh(state) if iteration % REFRESH_EVERY == 0 else None
            similarity = None if iteration == 0 else 1 - cost / 2
            self.run.step(done + iteration, total, similarity, None if field is None else lambda: field)

        start = State.of_poses(poses, len(self.observations))
        state = minimise(
            as_solved(self.problem), start, SolverOptions(self.level.iterations), before_step
        ).state
        pairs = zip(self.observations, state.corrections, strict=True)
        cameras = [corrected(observation.camera, correction) for observation, correction in pairs]
        return JointResult(cameras, self.problem, state)

    def _refresh(self, state: State) -> DisplacementField | None:
        """Renew the weights, and the soft tissue when bones or cameras moved; returns the field it then follows."""
        field = None
        if self._moved_since_rendered(state):
            field = self._render_soft_tissue(state)
            self._rendered = state
        self.views.weigh_structures(self.problem, state)
        return field

    def _render_soft_tissue(self, state: State) -> DisplacementField:
        """Move the soft tissue under the poses, by itself where this level does, and show it in the views."""
        if self.stage.soft_motion and not self.run.scene.bare:
            soft, field = fit_soft_motion(self.views, self.problem, state)
            self.views.run = replace(self.views.run, soft_tissue=soft)
            return field
        return self.views.render_soft_tissue(state)

    def _moved_since_rendered(self, state: State) -> bool:
        """Whether a bone or a camera moved by more than a tenth of a pixel since the soft tissue was rendered."""
        if self._rendered is None:
            return True
        centres = np.array([body.centre for body in self.problem.bodies])
        change = max(
            _largest_shift(state.poses, self._rendered.poses, centres),
            _largest_shift(state.corrections, self._rendered.corrections, self.problem.camera_centre[None]),
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
