"""Whether a bone would fit the X-rays as well elsewhere.

Curvature tells how wide the local minimum is in which the solver stopped, not whether there is another one beside it.
Every bone is therefore perturbed along its least certain directions, and fitted again alone. Where it ends in another
local minimum that the X-rays do not distinguish from the first, its interval is widened until it holds both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from PolyPoseLib.geometry.grid import grown_box
from PolyPoseLib.geometry.rigid import about, perturbation, perturbation_between
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions
from PolyPoseLib.registration.fit.lockstep import minimise_together
from PolyPoseLib.registration.fit.many_poses import at_many_poses
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View, corrected
from PolyPoseLib.registration.fit.refutation import is_refuted
from PolyPoseLib.registration.fit.views import problem_of_one_bone
from PolyPoseLib.registration.uncertainty.covariance import PoseUncertainty
from PolyPoseLib.rendering.rigid import footprint

PERTURBATION_DEVIATIONS = 4.0
"""Length of a perturbation, in standard deviations of the pose."""

LARGEST_PERTURBATION_MM = 8.0
"""Longer perturbations are shortened: an interval that wide needs no widening."""

DIRECTIONS = 2
"""Directions that are tried, the least certain first, either way."""

LEVER_MM = 50.0
"""Lever at which a rotation counts as motion."""

ITERATIONS = 15


def widened_by_local_minima(
    problem: RigidProblem,
    state: State,
    uncertainties: dict[int, PoseUncertainty],
    step: Callable[[int, int], None],
) -> dict[int, PoseUncertainty]:
    """Covariances that also hold the other local minima of each bone's pose.

    Parameters
    ----------
    problem, state
        As the joint fit left them.
    uncertainties : dict of int to PoseUncertainty
        By index of the bone.
    step : callable
        Called before each bone with how many are done and how many there are.

    Returns
    -------
    dict of int to PoseUncertainty
        Widened where a bone fits the X-rays as well elsewhere.

    """
    widened = {}
    for n, (k, uncertainty) in enumerate(uncertainties.items()):
        step(n, len(uncertainties))
        away = max(_other_minima(problem, state, k, uncertainty), key=_size_mm, default=np.zeros(6))
        widened[k] = PoseUncertainty(uncertainty.covariance + np.outer(away, away), _size_mm(away))
    return widened


def _other_minima(
    problem: RigidProblem, state: State, k: int, uncertainty: PoseUncertainty
) -> list[np.ndarray]:
    """(6,) perturbations of a bone's pose that lead to local minima which the X-rays do not refute."""
    body = problem.bodies[k]
    starts = [
        about(perturbation(delta), body.centre) @ state.poses[k]
        for delta in _perturbations(uncertainty.covariance)
    ]
    views = [_view_of_one_bone(problem, state, n, k, starts) for n in range(len(problem.views))]
    alone = problem_of_one_bone(problem, state, k, views, balanced=True)
    if alone is None:
        return []
    found = State.of_poses(state.poses[k][None], len(alone.views))
    minima = []
    ends, _ = minimise_together(at_many_poses(alone), np.stack(starts), SolverOptions(ITERATIONS))
    for end in ends:
        other = found.with_pose(0, end)
        if not is_refuted(alone, found, other):
            minima.append(perturbation_between(found.poses[0], other.poses[0], body.centre))
    return minima


def _perturbations(covariance: np.ndarray) -> list[np.ndarray]:
    """Perturbations (6,) of PERTURBATION_DEVIATIONS along the least certain directions, either way."""
    lever = np.array([LEVER_MM] * 3 + [1.0] * 3)
    variances, directions = np.linalg.eigh(covariance * np.outer(lever, lever))
    lengths = np.minimum(PERTURBATION_DEVIATIONS * np.sqrt(variances), LARGEST_PERTURBATION_MM)
    return [
        sign * lengths[-n] * directions[:, -n] / lever for n in range(1, DIRECTIONS + 1) for sign in (-1, 1)
    ]


def _view_of_one_bone(problem: RigidProblem, state: State, n: int, k: int, starts: list[np.ndarray]) -> View:
    """A view with its refined camera in which all but one bone is static, weighted near that bone only."""
    view = problem.views[n]
    camera = corrected(view.camera, state.corrections[n])
    static, parts = problem.render(state, n)
    static[parts[k].slices] -= parts[k].image
    weight = np.zeros_like(view.weight)
    grow = view.contrast.size // 2
    for pose in (state.poses[k], *starts):
        row0, row1, column0, column1 = footprint(problem.bodies[k], camera, pose)
        if row1 > row0 and column1 > column0:
            near = grown_box((slice(row0, row1), slice(column0, column1)), grow, weight.shape)
            weight[near] = view.weight[near]
    return replace(view, camera=camera, static=static, weight=weight)


def _size_mm(away: np.ndarray) -> float:
    return float(np.linalg.norm(away * ([LEVER_MM] * 3 + [1.0] * 3)))
