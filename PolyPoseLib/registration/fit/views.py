"""One resolution level of a run: its views, bodies, priors, soft tissue and pixel weights, for every fit and score."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.registration.articulations import ArticulationPrior, OneBonePrior
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.problem import CameraGroups, PosePrior, RigidProblem, State, View
from PolyPoseLib.registration.fit.weighting import region_around, robust_weight
from PolyPoseLib.registration.run import Run
from PolyPoseLib.rendering.rigid import Body

REACH_MM = 10.0
"""The X-rays count this far around the bones that move in them."""


class LevelViews:
    """The X-rays of a run at one resolution, and the least-squares problems that are posed about them.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observations : sequence of Observation
        The X-rays with their cameras.
    level : Level
        The resolution.
    expect_noise : bool
        As :func:`view_at` takes it.

    Attributes
    ----------
    views : list of View
        Shared by all problems, which therefore see the same static images and weights.

    """

    def __init__(
        self, run: Run, observations: Sequence[Observation], level: Level, expect_noise: bool = True
    ) -> None:
        self.run, self.level = run, level
        centre = run.scene.anchor_centre
        self.views: list[View] = [view_at(level, each, centre, expect_noise) for each in observations]

    def structures(self, free_poses: Sequence[int] = (), free_cameras: CameraGroups = ()) -> RigidProblem:
        """Every structure as a rigid body; free ones are held by their joints as far as the level says."""
        scene, weight = self.run.scene, self.level.joint_weight
        prior = None
        if len(free_poses) and weight:
            prior = ArticulationPrior(self.run.articulations, scene.centres, free_poses, weight)
        return self._problem(scene.bodies(self.level.size_mm), free_poses, free_cameras, prior)

    def anchor(self, free_cameras: CameraGroups = ()) -> RigidProblem:
        """The anchor alone."""
        scene = self.run.scene
        return self._problem([scene.bodies(self.level.size_mm)[scene.anchor]], (), free_cameras)

    def whole_ct(self, free_poses: Sequence[int] = (), free_cameras: CameraGroups = ()) -> RigidProblem:
        """The whole CT as one rigid body."""
        body = self.run.scene.volume("whole", self.level.size_mm)
        return self._problem([body], free_poses, free_cameras)

    def posed_structures(
        self, poses: np.ndarray, free_poses: Sequence[int] = ()
    ) -> tuple[RigidProblem, State]:
        """Every structure at poses (K, 4, 4), in front of the soft tissue that follows them."""
        problem = self.structures(free_poses)
        state = State.of_poses(poses, len(self.views))
        self.render_soft_tissue(state)
        return problem, state

    def at_rest(self, bodies: int) -> State:
        """So many bodies where the CT has them, and the cameras as they are."""
        return State.of_poses(self.run.scene.rest_poses[:1].repeat(bodies, axis=0), len(self.views))

    def render_soft_tissue(self, state: State) -> DisplacementField:
        """Make the views' static images the soft tissue under the poses; returns the field that it follows."""
        field = self.run.soft_tissue.coarse_field(state.poses)
        self.render_soft_field(field, state)
        return field

    def render_soft_field(self, field: DisplacementField, state: State) -> None:
        """Make the views' static images the soft tissue that a field displaces."""
        soft, backend = self.run.soft_tissue, self.run.backend
        for view, correction in zip(self.views, state.corrections, strict=True):
            view.static = soft.render(field, view.camera, correction, self.level.size_mm, backend)

    def weigh_structures(self, problem: RigidProblem, state: State) -> None:
        """Weigh the pixels around the structures that move in each view: all of them where the camera moves."""
        everything, moving = range(len(problem.bodies)), self.run.scene.moving
        for n, view in enumerate(self.views):
            which = moving if problem.camera_group(n) is None else everything
            region = region_around(problem, state, n, which, REACH_MM)
            view.weight = robust_weight(view, problem.residual(state, n), region)

    def _problem(
        self,
        bodies: Sequence[Body],
        free_poses: Sequence[int] = (),
        free_cameras: CameraGroups = (),
        prior: PosePrior | None = None,
    ) -> RigidProblem:
        centre, size = self.run.scene.anchor_centre, self.level.size_mm
        return RigidProblem(
            bodies, self.views, free_poses, free_cameras, centre, size, self.run.backend, prior
        )


def problem_of_one_bone(
    problem: RigidProblem, state: State, k: int, views: Sequence[View], balanced: bool = False
) -> RigidProblem | None:
    """The same objective as a function of one bone's pose, the others and the cameras standing still.

    Parameters
    ----------
    problem : RigidProblem
        Of all bones.
    state : State
        Of all bones.
    k : int
        Number of the bone.
    views : sequence of View
        The problem's views with all other bones in their static images, weighted where the bone may show.
    balanced : bool
        Whether each of the bone's joints counts against a pixel as it does in ``problem``; otherwise they share the
        prior's whole weight.

    Returns
    -------
    RigidProblem or None
        None where no X-ray shows the bone.

    """
    views = parts_that_count(views)
    if not views:
        return None
    prior = problem.prior
    if isinstance(prior, ArticulationPrior):
        factor = _total_weight(problem.views) / _total_weight(views) if balanced else None
        prior = OneBonePrior(prior, k, state.poses, factor)
    bodies = [problem.bodies[k]]
    return replace(problem, bodies=bodies, views=views, free_poses=[0], free_cameras=[], prior=prior)


def parts_that_count(views: Iterable[View]) -> list[View]:
    """The parts of the views around pixels that count, of views that have any."""
    return [view.cropped_to_weight() for view in views if (view.weight > 0).any()]


def _total_weight(views: Sequence[View]) -> float:
    return sum(float(view.weight.sum()) for view in views)
