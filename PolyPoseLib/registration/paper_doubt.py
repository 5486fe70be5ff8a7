"""The rigid least-squares problem at poses that another method found, from which their uncertainty follows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.registration.levels import Level, Measured, pixel_size_mm, view_at
from PolyPoseLib.registration.problem import RigidProblem, State
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.soft_tissue import SoftTissue
from PolyPoseLib.registration.weighting import covered, robust_weight, within
from PolyPoseLib.rendering.backend import Backend

LEVEL = Level(2.0, 14.0, 0)
REACH_MM = 10.0
"""The X-rays count this far around the moving bones."""


def rigid_problem_at(
    scene: Scene, soft: SoftTissue, measured: Sequence[Measured], state: State, backend: Backend
) -> RigidProblem:
    """All structures but the anchor as rigid bodies in front of soft tissue that follows ``state``.

    The poses need not be its optimum: residuals that they leave unexplained count as noise, and widen the intervals.
    """
    centre = scene.anchor_centre
    views = [view_at(LEVEL, m, centre) for m in measured]
    moving = [k for k in range(len(scene.names)) if k != scene.anchor]
    bodies = scene.bodies(LEVEL.size_mm)
    problem = RigidProblem(bodies, views, moving, [], centre, LEVEL.size_mm, backend)
    field = soft.coarse_field(state.poses)
    for n, view in enumerate(views):
        view.static = soft.render(field, view.camera, np.eye(4), LEVEL.size_mm, backend)
        reach = REACH_MM / pixel_size_mm(view.camera, centre)
        region = within(covered(problem, state, n, moving), reach)
        view.weight = robust_weight(view, problem.residual(state, n), region)
    return problem
