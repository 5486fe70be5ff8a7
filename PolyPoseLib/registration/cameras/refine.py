"""Stage A: the camera of one X-ray from the anchor, which stands still by definition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm, view_at
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State, corrected
from PolyPoseLib.registration.fit.weighting import dilated, projection_mask, robust_weight
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

REACH_MM, FINE_REACH_MM = 12.0, 4.0
"""The X-ray counts this far around the anchor, at coarse levels and at fine ones: soft tissue beside it has moved, and
turns a camera by a degree where the anchor shows little of its own, as a pelvis does from the side."""

COARSE_MM = 3.0
"""From this pixel size on, moving bones in front of the anchor are not masked out: too little would remain."""

BESIDE_MOVED_MM, LEAST_ANCHOR = 6.0, 0.4
"""Moving bones are masked with so much around them, for they are not where the CT has them, as long as this share of
the anchor remains."""

BEAM_STEPS_MM = (16.0, 8.0, 4.0)
"""Steps along the beam, long ones first, with which a camera's distance is looked for."""

BEAM_STEPS = 8
"""Steps of one length at most."""


def find_camera(
    scene: Scene,
    measured: Observation,
    levels: Sequence[Level],
    backend: Backend,
    monitor: Monitor,
    stage: str,
) -> Camera:
    """Refine one X-ray's camera; the whole CT moves as one body, compared only where the anchor projects."""
    camera = measured.camera
    total = sum(level.iterations for level in levels)
    done = 0
    for level in levels:
        current = measured.with_camera(camera)
        camera = _refine(scene, current, level, backend, monitor, stage, done, total)
        done += level.iterations
    return camera


def _refine(
    scene: Scene,
    measured: Observation,
    level: Level,
    backend: Backend,
    monitor: Monitor,
    stage: str,
    done: int,
    total: int,
) -> Camera:
    centre = scene.anchor_centre
    view = view_at(level, measured, centre)
    body = scene.volume("whole", level.size_mm)
    problem = RigidProblem([body], [view], [], [0], centre, level.size_mm, backend)
    bones = RigidProblem(scene.bodies(level.size_mm), [view], [], [0], centre, level.size_mm, backend)

    def weigh(state: State) -> None:
        posed = State(np.broadcast_to(np.eye(4), (len(scene.names), 4, 4)), state.corrections)
        view.weight = robust_weight(view, problem.residual(state, 0), anchor_region(scene, bones, posed, 0))

    def before_step(state: State, iteration: int, cost: float) -> None:
        similarity = None if iteration == 0 else 1 - cost / 2
        monitor.step(stage, done + iteration, total, similarity)
        weigh(state)

    start = State(np.eye(4)[None], np.eye(4)[None])
    weigh(start)
    start = _slid_along_beam(problem, start)
    solution = minimise(problem, start, SolverOptions(level.iterations), before_step)
    return corrected(measured.camera, solution.state.corrections[0])


def anchor_region(scene: Scene, bones: RigidProblem, state: State, view_index: int) -> np.ndarray:
    """(H, W) bool: where a view counts in stage A, around the anchor and, at fine levels, away from other bones.

    bones: the problem of all the scene's bodies; state: of all of them.
    """
    pixel_mm = pixel_size_mm(bones.views[view_index].camera, scene.anchor_centre)
    anchor = projection_mask(bones, state, view_index, [scene.anchor])
    if bones.step_mm >= COARSE_MM:
        return dilated(anchor, REACH_MM / pixel_mm)
    moving = [k for k in range(len(scene.names)) if k != scene.anchor]
    others = projection_mask(bones, state, view_index, moving)
    beside = dilated(others, BESIDE_MOVED_MM / pixel_mm)
    masked = beside if (anchor & ~beside).sum() >= LEAST_ANCHOR * anchor.sum() else others
    return dilated(anchor, FINE_REACH_MM / pixel_mm) & ~masked


def _slid_along_beam(problem: RigidProblem, state: State) -> State:
    """The state with the only camera at the best of several distances from the anchor.

    A distance wrong by centimetres moves edges by a millimetre or two, less than patches and pixels, and the solver's
    steps towards it are short: the cost is looked at far away instead.
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
