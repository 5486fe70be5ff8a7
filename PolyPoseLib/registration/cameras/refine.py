"""Stage A: the camera of one X-ray from the anchor, which stands still by definition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.device_problem import as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View, corrected
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import dilated, projection_mask, robust_weight
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.rigid import footprint

REACH_MM, FINE_REACH_MM = 12.0, 4.0
"""The X-ray counts this far around the anchor, at coarse levels and at fine ones: soft tissue beside it has moved, and
rotates a camera by a degree where the anchor has little contrast of its own, as a pelvis has from the side."""

COARSE_MM = 3.0
"""From this pixel size on, moving bones in front of the anchor are not masked out: too little would remain."""

BESIDE_MOVED_MM, LEAST_ANCHOR = 6.0, 0.4
"""Moving bones are masked with this margin, for they are not where the CT has them, as long as this share of the anchor
remains."""

ROOM_MM = 40.0
"""The anchor may project this much farther off than where it does at the start of a level."""

BEAM_STEPS_MM = (16.0, 8.0, 4.0)
"""Steps along the beam, long ones first, with which a camera's distance is searched."""

BEAM_STEPS = 8
"""Steps of one length at most."""


def find_camera(run: Run, observation: Observation, levels: Sequence[Level]) -> Camera:
    """Refine one X-ray's camera; the whole CT moves as one body, compared only where the anchor projects.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor, in the stage that the progress names.
    observation : Observation
        The X-ray with its initial camera.
    levels : sequence of Level
        Coarse to fine.

    Returns
    -------
    Camera
        The refined one.

    """
    total = sum(level.iterations for level in levels)
    done = 0
    for level in levels:
        observation = observation.with_camera(_refine(run, observation, level, done, total))
        done += level.iterations
    return observation.camera


def _refine(run: Run, observation: Observation, level: Level, done: int, total: int) -> Camera:
    """One level; done, total: iterations of the levels before and of all."""
    views = LevelViews(run, [observation], level)
    views.views = [around_anchor(run.scene, views)]
    problem, bones = views.whole_ct(free_cameras=[(0,)]), views.structures()

    def weigh(state: State) -> None:
        posed = State(run.scene.rest_poses, state.corrections)
        region = anchor_region(run.scene, bones, posed, 0)
        views.views[0].weight = robust_weight(views.views[0], problem.residual(state, 0), region)

    def before_step(state: State, iteration: int, cost: float) -> None:
        run.at_level(level.size_mm).step(done + iteration, total, None if iteration == 0 else 1 - cost / 2)
        weigh(state)

    start = views.at_rest(1)
    weigh(start)
    start = slid_along_beam(problem, start)
    solution = minimise(as_solved(problem), start, SolverOptions(level.iterations), before_step)
    return corrected(observation.camera, solution.state.corrections[0])


def around_anchor(scene: Scene, views: LevelViews) -> View:
    """The part of the only view that can count while its camera is refined; the whole where the anchor is not seen."""
    view = views.views[0]
    body = scene.bodies(views.level.size_mm)[scene.anchor]
    room = round((REACH_MM + ROOM_MM) / pixel_size_mm(view.camera, scene.anchor_centre))
    row0, row1, column0, column1 = footprint(body, view.camera, np.eye(4))
    if row0 >= row1 or column0 >= column1:
        return view
    near = np.zeros(view.weight.shape, bool)
    near[max(row0 - room, 0) : row1 + room, max(column0 - room, 0) : column1 + room] = True
    return view.cropped_around(near)


def anchor_region(scene: Scene, bones: RigidProblem, state: State, view_index: int) -> np.ndarray:
    """Where a view counts in stage A: around the anchor and, at fine levels, away from other bones.

    Parameters
    ----------
    scene : Scene
        With the anchor.
    bones : RigidProblem
        Of all structures.
    state : State
        Of all structures.
    view_index : int
        Which of the problem's views.

    Returns
    -------
    (H, W) ndarray
        bool, True where a pixel counts.

    """
    pixel_mm = pixel_size_mm(bones.views[view_index].camera, scene.anchor_centre)
    anchor = projection_mask(bones, state, view_index, [scene.anchor])
    if bones.step_mm >= COARSE_MM:
        return dilated(anchor, REACH_MM / pixel_mm)
    others = projection_mask(bones, state, view_index, scene.moving)
    beside = dilated(others, BESIDE_MOVED_MM / pixel_mm)
    masked = beside if (anchor & ~beside).sum() >= LEAST_ANCHOR * anchor.sum() else others
    return dilated(anchor, FINE_REACH_MM / pixel_mm) & ~masked


def slid_along_beam(problem: RigidProblem, state: State) -> State:
    """The state with the only camera at the best of several distances from the anchor.

    A distance wrong by centimetres moves edges by a millimetre or two, less than patches and pixels, and the solver's
    steps towards it are short: the cost is therefore evaluated at distances far apart.
    """
    camera = problem.views[0].camera
    beam = problem.camera_centre - camera.source
    beam = beam / np.linalg.norm(beam)
    cost = problem.cost(state)
    for length in BEAM_STEPS_MM:
        for sign in (-1.0, 1.0):
            for _ in range(BEAM_STEPS):
                trial = problem.moved(state, np.r_[np.zeros(3), sign * length * beam])
                trial_cost = problem.cost(trial)
                if trial_cost >= cost:
                    break
                state, cost = trial, trial_cost
    return state
