"""Cameras once more from the anchor, in front of everything else as stage B has it so far.

Stage A takes the whole CT as one rigid body. Where the patient breathes, or lies otherwise, the soft tissue over the
anchor pulls the camera along: by two degrees and two centimetres along the beam in a chest. Once the other bones and
the soft tissue look in the picture as they do in the X-ray, the anchor moves by itself in front of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.registration.cameras.refine import slid_along_beam
from PolyPoseLib.registration.fit.device_problem import as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import CameraGroups, RigidProblem, State, corrected
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import (
    dilated,
    projection_mask,
    robust_weight,
    usable_projection_mask,
)
from PolyPoseLib.registration.run import Run

REACH_MM = 8.0
"""The X-rays count this far around the anchor."""

LEAST_SHOWN = 0.25
"""Of the anchor's projection, that an X-ray must show for it to move the camera by itself."""


def refine_by_anchor_alone(
    run: Run, observations: Sequence[Observation], poses: np.ndarray, free: CameraGroups, level: Level
) -> list[Observation]:
    """Refine cameras with everything but the anchor standing still in the pictures.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observations : sequence of Observation
        The X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving, of all structures.
    free : CameraGroups
        The X-rays whose cameras may move, those of a rig as one.
    level : Level
        The resolution.

    Returns
    -------
    list of Observation
        With the refined cameras.

    """
    refined = list(observations)
    run = run.named("cameras").at_level(level.size_mm)
    for n, group in enumerate(free):
        run.step(n, len(free))
        with_cameras = _refined(run, [observations[v] for v in group], poses, level)
        for v, observation in zip(group, with_cameras, strict=True):
            refined[v] = observation
    return refined


def _refined(
    run: Run, observations: Sequence[Observation], poses: np.ndarray, level: Level
) -> list[Observation]:
    """Those of one group."""
    scene = run.scene
    views = LevelViews(run, observations, level)
    structures, state = views.posed_structures(poses)
    for n, view in enumerate(views.views):
        view.static = structures.render_without(scene.anchor, state, n)
    group = [tuple(range(len(observations)))]
    problem = views.anchor(group)
    reach = [REACH_MM / pixel_size_mm(view.camera, scene.anchor_centre) for view in views.views]

    def weigh(state: State, iteration: int = 0, cost: float = np.inf) -> None:
        for n, view in enumerate(views.views):
            region = dilated(projection_mask(problem, state, n, [0]), reach[n])
            view.weight = robust_weight(view, problem.residual(state, n), region)

    start = views.at_rest(1)
    if not all(_shows_enough(problem, start, n) for n in range(len(views.views))):
        return list(observations)
    weigh(start)
    if len(observations) == 1:
        start = slid_along_beam(problem, start)
    found = minimise(as_solved(problem), start, SolverOptions(level.iterations), weigh).state
    return [
        each.with_camera(corrected(each.camera, correction))
        for each, correction in zip(observations, found.corrections, strict=True)
    ]


def _shows_enough(problem: RigidProblem, state: State, n: int) -> bool:
    """Whether a view shows at least LEAST_SHOWN of where the anchor projects."""
    shown = usable_projection_mask(problem, state, n, [0]).sum()
    return bool(shown) and shown >= LEAST_SHOWN * projection_mask(problem, state, n, [0]).sum()
