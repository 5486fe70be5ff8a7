"""Stage A for two or more calibrated cameras of one rig: their relative poses stay as they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.coarse_search import compared_points
from PolyPoseLib.registration.cameras.hypotheses import is_plausible, score_camera
from PolyPoseLib.registration.cameras.multistart import TURN_DEG, RefinedCamera, turned_about
from PolyPoseLib.registration.cameras.refine import anchor_region
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State, corrected
from PolyPoseLib.registration.fit.weighting import robust_weight
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend


def find_rig(
    scene: Scene,
    measured: Sequence[Observation],
    levels: Sequence[Level],
    backend: Backend,
    monitor: Monitor,
    stage: str,
) -> list[Camera]:
    """Refine cameras that move together: one rigid motion of the whole CT serves all X-rays.

    Args:
        scene: the CT with its anchor.
        measured: the X-rays with their cameras, whose relative poses are kept exactly.
        levels: coarse to fine.
        backend: renders.
        monitor: progress and cancelling.
        stage: name in the progress.

    Returns:
        The cameras in the order of the X-rays.

    """
    total = sum(level.iterations for level in levels)
    done = 0
    measured = list(measured)
    for level in levels:
        motion = _refine(scene, measured, level, backend, monitor, stage, done, total)
        measured = [m.with_camera(corrected(m.camera, motion)) for m in measured]
        done += level.iterations
    return [m.camera for m in measured]


def find_rig_near(
    scene: Scene,
    measured: Sequence[Observation],
    levels: Sequence[Level],
    backend: Backend,
    monitor: Monitor,
    stage: str,
) -> list[RefinedCamera]:
    """The cameras of a rig near their guesses, as :func:`find_camera_near` finds one: from turns of the whole rig."""
    points = compared_points(scene)
    relative = relative_poses([m.camera.extrinsic for m in measured])
    candidates = []
    for start in turned_about(measured[0].camera, scene.anchor_centre, TURN_DEG):
        placed = placed_rig(measured, relative, start.extrinsic)
        candidates.append(find_rig(scene, placed, levels[:1], backend, monitor, stage))
    first = max(candidates, key=lambda cameras: _worth(scene, measured, cameras, levels[0], points, backend))
    placed = [m.with_camera(camera) for m, camera in zip(measured, first, strict=True)]
    found = find_rig(scene, placed, levels[1:], backend, monitor, stage)
    judged = [
        score_camera(scene, m.with_camera(camera), levels[-1], points, backend)
        for m, camera in zip(measured, found, strict=True)
    ]
    return [RefinedCamera(each.camera, each.similarity, is_plausible(each)) for each in judged]


def relative_poses(extrinsics: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Motions (4, 4) from the first camera's axes to each camera's, for poses (4, 4) in one and the same world."""
    back = np.linalg.inv(extrinsics[0])
    return [np.asarray(each, dtype=np.float64) @ back for each in extrinsics]


def placed_rig(
    measured: Sequence[Observation], relative: Sequence[np.ndarray], first: np.ndarray
) -> list[Observation]:
    """The X-rays of a rig whose first camera has the extrinsic ``first`` (4, 4)."""
    return [
        m.with_camera(m.camera.with_extrinsic(each @ first))
        for m, each in zip(measured, relative, strict=True)
    ]


def best_for_rig(
    scene: Scene,
    measured: Sequence[Observation],
    relative: Sequence[np.ndarray],
    candidates: Sequence[tuple[int, np.ndarray]],
    level: Level,
    backend: Backend,
) -> tuple[int, list[Camera]]:
    """The candidate that explains all X-rays of a rig best, as its place in the list and the cameras it makes.

    relative: (4, 4) from the first camera's axes to each camera's; candidates: at least one (number of an X-ray, its
    extrinsic).
    """
    points = compared_points(scene)
    rigs = []
    for n, extrinsic in candidates:
        placed = placed_rig(measured, relative, np.linalg.inv(relative[n]) @ extrinsic)
        rigs.append([m.camera for m in placed])
    worth = [_worth(scene, measured, cameras, level, points, backend) for cameras in rigs]
    best = int(np.argmax(worth))
    return best, rigs[best]


def _worth(
    scene: Scene,
    measured: Sequence[Observation],
    cameras: Sequence[Camera],
    level: Level,
    points: np.ndarray,
    backend: Backend,
) -> float:
    """How well the cameras of a rig explain its X-rays together."""
    return sum(
        score_camera(scene, m.with_camera(camera), level, points, backend).worth
        for m, camera in zip(measured, cameras, strict=True)
    )


def _refine(
    scene: Scene,
    measured: Sequence[Observation],
    level: Level,
    backend: Backend,
    monitor: Monitor,
    stage: str,
    done: int,
    total: int,
) -> np.ndarray:
    """The motion (4, 4), fixed to fixed, that all cameras need at one level."""
    centre, size = scene.anchor_centre, level.size_mm
    views = [view_at(level, m, centre) for m in measured]
    whole = RigidProblem([scene.volume("whole", size)], views, [0], [], centre, size, backend)
    bones = RigidProblem(scene.bodies(size), views, [], [], centre, size, backend)

    def before_step(state: State, iteration: int, cost: float) -> None:
        monitor.step(stage, done + iteration, total, None if iteration == 0 else 1 - cost / 2)
        posed = State(np.stack([state.poses[0]] * len(scene.names)), state.corrections)
        for n, view in enumerate(views):
            region = anchor_region(scene, bones, posed, n)
            view.weight = robust_weight(view, whole.residual(state, n), region)

    start = State(np.eye(4)[None], np.stack([np.eye(4)] * len(views)))
    return minimise(whole, start, SolverOptions(level.iterations), before_step).state.poses[0]
