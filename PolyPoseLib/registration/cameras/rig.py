"""Stage A for two or more calibrated cameras of one rig: their relative poses stay as they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.coarse_search import compared_points
from PolyPoseLib.registration.cameras.hypotheses import is_plausible, score_camera
from PolyPoseLib.registration.cameras.multistart import TURN_DEG, RefinedCamera, turned_about
from PolyPoseLib.registration.cameras.refine import anchor_region
from PolyPoseLib.registration.fit.device_problem import as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import State, corrected
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import robust_weight
from PolyPoseLib.registration.run import Run


def find_rig(run: Run, observations: Sequence[Observation], levels: Sequence[Level]) -> list[Camera]:
    """Refine cameras that move together: one rigid motion of the whole CT serves all X-rays.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observations : sequence of Observation
        The X-rays with their cameras, whose relative poses are kept exactly.
    levels : sequence of Level
        Coarse to fine.

    Returns
    -------
    list of Camera
        In the order of the X-rays.

    """
    total = sum(level.iterations for level in levels)
    done = 0
    for level in levels:
        motion = _refine(run, observations, level, done, total)
        observations = [each.with_camera(corrected(each.camera, motion)) for each in observations]
        done += level.iterations
    return [each.camera for each in observations]


def find_rig_near(
    run: Run, observations: Sequence[Observation], levels: Sequence[Level]
) -> list[RefinedCamera]:
    """Refine the cameras of a rig from several starts, rotations of the whole rig about the anchor.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observations : sequence of Observation
        The X-rays with their initial cameras, whose relative poses are kept exactly.
    levels : sequence of Level
        Coarse to fine; the starts are compared at the first.

    Returns
    -------
    list of RefinedCamera
        In the order of the X-rays.

    """
    points = compared_points(run.scene)
    relative = relative_poses([each.camera.extrinsic for each in observations])
    candidates = []
    for start in turned_about(observations[0].camera, run.scene.anchor_centre, TURN_DEG):
        placed = placed_rig(observations, relative, start.extrinsic)
        cameras = find_rig(run, placed, levels[:1])
        candidates.append([each.with_camera(c) for each, c in zip(placed, cameras, strict=True)])
    best = max(candidates, key=lambda placed: _rig_score(run, placed, levels[0], points))
    cameras = find_rig(run, best, levels[1:])
    scored = [
        score_camera(run, each.with_camera(camera), levels[-1], points)
        for each, camera in zip(best, cameras, strict=True)
    ]
    return [RefinedCamera(each.camera, each.similarity, is_plausible(each)) for each in scored]


def relative_poses(extrinsics: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Motions (4, 4) from the first camera's axes to each camera's, for poses (4, 4) in one and the same world."""
    back = np.linalg.inv(extrinsics[0])
    return [np.asarray(each, dtype=np.float64) @ back for each in extrinsics]


def placed_rig(
    observations: Sequence[Observation], relative: Sequence[np.ndarray], first: np.ndarray
) -> list[Observation]:
    """The X-rays of a rig whose first camera has the extrinsic ``first`` (4, 4)."""
    return [
        each.with_camera(each.camera.with_extrinsic(motion @ first))
        for each, motion in zip(observations, relative, strict=True)
    ]


def best_for_rig(
    run: Run,
    observations: Sequence[Observation],
    relative: Sequence[np.ndarray],
    candidates: Sequence[tuple[int, np.ndarray]],
    level: Level,
) -> tuple[int, list[Camera]]:
    """The candidate that agrees best with all X-rays of a rig.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observations : sequence of Observation
        The rig's X-rays.
    relative : sequence of (4, 4) ndarray
        From the first camera's axes to each camera's.
    candidates : sequence of (int, (4, 4) ndarray)
        At least one number of an X-ray with an extrinsic for it.
    level : Level
        The resolution.

    Returns
    -------
    int
        The candidate's place in the list.
    list of Camera
        Of all X-rays, placed by the candidate.

    """
    points = compared_points(run.scene)
    rigs = [
        placed_rig(observations, relative, np.linalg.inv(relative[n]) @ extrinsic)
        for n, extrinsic in candidates
    ]
    best = int(np.argmax([_rig_score(run, placed, level, points) for placed in rigs]))
    return best, [each.camera for each in rigs[best]]


def _rig_score(run: Run, observations: Sequence[Observation], level: Level, points: np.ndarray) -> float:
    """Sum of the scores of a rig's cameras."""
    return sum(score_camera(run, each, level, points).score for each in observations)


def _refine(run: Run, observations: Sequence[Observation], level: Level, done: int, total: int) -> np.ndarray:
    """The motion (4, 4), fixed to fixed, that all cameras need at one level."""
    views = LevelViews(run, observations, level)
    rig = tuple(range(len(observations)))
    whole, bones = views.whole_ct(free_cameras=[rig]), views.structures()

    def before_step(state: State, iteration: int, cost: float) -> None:
        run.at_level(level.size_mm).step(done + iteration, total, None if iteration == 0 else 1 - cost / 2)
        posed = State(run.scene.rest_poses, state.corrections)
        for n, view in enumerate(views.views):
            region = anchor_region(run.scene, bones, posed, n)
            view.weight = robust_weight(view, whole.residual(state, n), region)

    return minimise(
        as_solved(whole), views.at_rest(1), SolverOptions(level.iterations), before_step
    ).state.corrections[0]
