"""Bones whose rendering the X-rays contradict: they are restarted, and what stays inconsistent is not trusted."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from PolyPoseLib.registration.bones.agreement import structure_residuals
from PolyPoseLib.registration.bones.limbs import restart_limbs
from PolyPoseLib.registration.bones.restarts import Search, restart_bones
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene

SUSPECT = 0.08
"""Mean squared residual where a bone shows above which it is restarted."""


def restart_inconsistent(
    run: Run,
    observations: Sequence[Observation],
    poses: np.ndarray,
    levels: Sequence[Level],
    among: Collection[int] | None = None,
) -> np.ndarray:
    """Restart suspect bones, far from where they are: first those that hang together, then each by itself.

    Each stays where it is unless the X-rays refute that, or match it better where its joints moved less.

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
    among : collection of int, optional
        Bones that may be restarted; None for all that move.

    Returns
    -------
    (K, 4, 4) ndarray
        The best poses found.

    """
    residuals = structure_residuals(run, observations, poses)
    candidates = run.scene.moving if among is None else among
    which = [k for k in candidates if (residuals[k] > SUSPECT).any()]
    if which:
        poses = restart_limbs(run, observations, poses, levels[0], which)
    for n, level in enumerate(levels if which else ()):
        poses = restart_bones(run, observations, poses, level, which, Search(far=n == 0, must_refute=True))
    return poses


def inconsistency_warnings(scene: Scene, doubts: Mapping[int, Sequence[str]]) -> list[str]:
    """Warnings about inconsistent structures; doubts: the reasons, by their indices."""
    return [
        f'The X-rays contradict the pose found for "{scene.names[k]}" ({"; ".join(why)}): check it in the overlay, and '
        "do not rely on it."
        for k, why in doubts.items()
    ]
