"""Stage A for two or more calibrated cameras of one rig: their relative poses stay as they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras import COARSE_MM, REACH_MM, corrected
from PolyPoseLib.registration.hypotheses import Hypothesis, judge_camera
from PolyPoseLib.registration.levels import Level, Measured, pixel_size_mm, view_at
from PolyPoseLib.registration.levenberg import SolverOptions, minimise
from PolyPoseLib.registration.monitor import Monitor
from PolyPoseLib.registration.problem import RigidProblem, State
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.weighting import covered, robust_weight, within
from PolyPoseLib.rendering.backend import Backend


def find_rig(
    scene: Scene,
    measured: Sequence[Measured],
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


def place_rig(camera: Camera, relative: np.ndarray, other: Camera) -> Camera:
    """The other camera of a rig, given this one's pose and the motion (4, 4) from this camera's axes to the other's."""
    return other.with_extrinsic(np.asarray(relative, dtype=np.float64) @ camera.extrinsic)


def best_for_rig(
    scene: Scene,
    measured: Sequence[Measured],
    relative: Sequence[np.ndarray],
    hypotheses: Sequence[Sequence[Hypothesis]],
    level: Level,
    points: np.ndarray,
    backend: Backend,
) -> list[Camera]:
    """Of hypotheses made for each X-ray by itself, the one that explains all X-rays of the rig best.

    relative: (4, 4) from the first camera's axes to each camera's; hypotheses: one list per X-ray; points: (N, 3) LPS
    mm on the anchor.  Raises InputError when no X-ray has a hypothesis.
    """
    best, best_worth = None, -np.inf
    for n, found in enumerate(hypotheses):
        for hypothesis in found:
            first = hypothesis.camera.extrinsic
            first = np.linalg.inv(relative[n]) @ first
            cameras = [m.camera.with_extrinsic(r @ first) for m, r in zip(measured, relative, strict=True)]
            worth = sum(
                judge_camera(scene, m.with_camera(camera), level, points, backend).worth
                for m, camera in zip(measured, cameras, strict=True)
            )
            if worth > best_worth:
                best, best_worth = cameras, worth
    if best is None:
        raise InputError(
            "No X-ray of the rig shows the anchor in any view that was tried; give an extrinsic."
        )
    return best


def _refine(
    scene: Scene,
    measured: Sequence[Measured],
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
    others = [k for k in range(len(scene.names)) if k != scene.anchor]

    def before_step(state: State, iteration: int, cost: float) -> None:
        monitor.step(stage, done + iteration, total, None if iteration == 0 else 1 - cost / 2)
        posed = State(np.stack([state.poses[0]] * len(scene.names)), state.corrections)
        for n, view in enumerate(views):
            reach = REACH_MM / pixel_size_mm(view.camera, centre)
            region = within(covered(bones, posed, n, [scene.anchor]), reach)
            if size < COARSE_MM:
                region &= ~covered(bones, posed, n, others)
            view.weight = robust_weight(view, whole.residual(state, n), region)

    start = State(np.eye(4)[None], np.stack([np.eye(4)] * len(views)))
    return minimise(whole, start, SolverOptions(level.iterations), before_step).state.poses[0]
