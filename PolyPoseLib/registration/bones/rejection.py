"""Bones whose rendering the X-rays contradict: another look at them, and no faith in what remains contradicted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.registration.bones.restarts import restart_bones
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.weighting import projection_mask, reliability
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

LOOKED_AT = Level(3.0, 20.0, 0)
"""Resolution at which bones are compared: coarse enough that texture does not decide."""

SUSPECT, INCONSISTENT = 0.08, 0.2
"""Mean squared normalised residual where a bone shows, above which its pose is looked for again, and above which it is
not believed. At right poses it is 0.02 to 0.07, up to 0.15 where much soft tissue lies over the bone."""

LEAST_PIXELS = 20
"""A bone that shows in fewer pixels says nothing about itself."""


def structure_residuals(
    scene: Scene, soft: SoftTissue, measured: Sequence[Observation], poses: np.ndarray, backend: Backend
) -> np.ndarray:
    """Mean squared residual (K, N) where each structure shows in each view, in variances of the X-ray's local contrast.

    Pixels count by their reliability, so that noise does not speak against a bone. NaN where it hardly shows.
    poses: (K, 4, 4) fixed to moving.
    """
    views = [view_at(LOOKED_AT, m, scene.anchor_centre) for m in measured]
    size = LOOKED_AT.size_mm
    problem = RigidProblem(scene.bodies(size), views, [], [], scene.anchor_centre, size, backend)
    state = State(poses, np.stack([np.eye(4)] * len(views)))
    field = soft.coarse_field(poses)
    share = np.full((len(poses), len(views)), np.nan)
    for n, view in enumerate(views):
        view.static = soft.render(field, view.camera, np.eye(4), size, backend)
        squared, weight = problem.residual(state, n) ** 2, reliability(view)
        for k in range(len(poses)):
            shows = projection_mask(problem, state, n, [k]) & (view.contrast.support > 0)
            if shows.sum() >= LEAST_PIXELS:
                share[k, n] = np.average(squared[shows], weights=weight[shows])
    return share


def inconsistent_structures(
    scene: Scene,
    soft: SoftTissue,
    measured: Sequence[Observation],
    poses: np.ndarray,
    backend: Backend,
    more_than: float = INCONSISTENT,
) -> list[int]:
    """Indices of the structures, the anchor excepted, of whom some X-ray leaves ``more_than`` that unexplained."""
    share = structure_residuals(scene, soft, measured, poses, backend)
    return [k for k in range(len(poses)) if k != scene.anchor and (share[k] > more_than).any()]


def restart_inconsistent(
    scene: Scene,
    soft: SoftTissue,
    measured: Sequence[Observation],
    poses: np.ndarray,
    levels: Sequence[Level],
    backend: Backend,
    monitor: Monitor,
) -> np.ndarray:
    """Poses (K, 4, 4) after doubted bones were started anew, far from where they are, at each of the levels."""
    which = inconsistent_structures(scene, soft, measured, poses, backend, SUSPECT)
    for n, level in enumerate(levels if which else ()):
        poses = restart_bones(scene, soft, measured, poses, level, backend, monitor, which, far=n == 0)
    return poses


def inconsistency_warnings(scene: Scene, which: Sequence[int]) -> list[str]:
    """Warnings about contradicted structures."""
    return [
        f'The X-rays contradict the pose found for "{scene.names[k]}": look at it in the overlay; it is given the '
        "uncertainty of a structure that no X-ray shows."
        for k in which
    ]
