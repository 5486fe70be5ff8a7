"""Bones whose rendering the X-rays contradict: they are restarted, and what stays inconsistent is not trusted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.registration.bones.restarts import restart_bones
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.fit.weighting import reliability, usable_projection_mask
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene

COMPARISON_LEVEL = Level(3.0, 20.0, 0)
"""Resolution at which bones are compared: coarse enough that texture does not decide."""

SUSPECT, INCONSISTENT = 0.08, 0.2
"""Mean squared normalised residual where a bone shows, above which it is restarted, and above which its pose is not
trusted. At right poses it is 0.02 to 0.07, up to 0.15 where much soft tissue lies over the bone."""

LEAST_PIXELS = 20
"""A bone that shows in fewer pixels cannot be compared."""


def structure_residuals(run: Run, observations: Sequence[Observation], poses: np.ndarray) -> np.ndarray:
    """Mean squared residual where each structure shows in each view, in variances of the X-ray's local contrast.

    Pixels count by their reliability, so that noise does not count against a bone.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observations : sequence of Observation
        N X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving.

    Returns
    -------
    (K, N) ndarray
        NaN where a structure hardly shows.

    """
    level = LevelViews(run, observations, COMPARISON_LEVEL)
    problem, state = level.posed_structures(poses)
    residuals = np.full((len(poses), len(level.views)), np.nan)
    for n, view in enumerate(level.views):
        squared, weight = problem.residual(state, n) ** 2, reliability(view)
        for k in range(len(poses)):
            shows = usable_projection_mask(problem, state, n, [k])
            if shows.sum() >= LEAST_PIXELS:
                residuals[k, n] = np.average(squared[shows], weights=weight[shows])
    return residuals


def inconsistent_structures(
    run: Run, observations: Sequence[Observation], poses: np.ndarray, threshold: float = INCONSISTENT
) -> list[int]:
    """Indices of the structures, the anchor excepted, whose residual is above ``threshold`` in some X-ray."""
    residuals = structure_residuals(run, observations, poses)
    return [k for k in run.scene.moving if (residuals[k] > threshold).any()]


def restart_inconsistent(
    run: Run, observations: Sequence[Observation], poses: np.ndarray, levels: Sequence[Level]
) -> np.ndarray:
    """Restart suspect bones, far from where they are.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observations : sequence of Observation
        The X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving.
    levels : sequence of Level
        Coarse to fine; only at the first are bones started far away.

    Returns
    -------
    (K, 4, 4) ndarray
        The best poses found.

    """
    which = inconsistent_structures(run, observations, poses, SUSPECT)
    for n, level in enumerate(levels if which else ()):
        poses = restart_bones(run, observations, poses, level, which, far=n == 0)
    return poses


def reasons_against_most(scene: Scene, which: Sequence[int]) -> list[str]:
    """A reason for distrust where more than half of the structures that may move are inconsistent."""
    moving = len(scene.moving)
    if 2 * len(which) <= moving:
        return []
    return [
        f"The X-rays contradict the poses of {len(which)} of {moving} structures: check the cameras, and whether CT, "
        "labels and X-rays belong together."
    ]


def inconsistency_warnings(scene: Scene, which: Sequence[int]) -> list[str]:
    """Warnings about inconsistent structures."""
    return [
        f'The X-rays contradict the pose found for "{scene.names[k]}": check it in the overlay; it is given the '
        "uncertainty of a structure that no X-ray shows."
        for k in which
    ]
