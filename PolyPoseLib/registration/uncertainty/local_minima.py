"""Whether a bone would fit the X-rays as well elsewhere.

Curvature tells how wide the valley is in which the solver stopped, not whether there is another one beside it. Every
bone is therefore pushed along the directions that the X-rays tell least about, and fitted again alone. Where it comes
to rest at another place that the X-rays do not tell from the first, its interval is widened until it holds both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from PolyPoseLib.geometry.rigid import about, perturbation, perturbation_between
from PolyPoseLib.registration.articulations import ArticulationPrior, OneBonePrior
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View, corrected
from PolyPoseLib.registration.uncertainty.covariance import PATCHES_PER_CLUSTER, PoseUncertainty, cluster_sums
from PolyPoseLib.rendering.rigid import footprint

PERTURBATION_DEVIATIONS = 4.0
"""How far a bone is pushed, in standard deviations of its pose."""

LARGEST_PERTURBATION_MM = 8.0
"""Farther pushes are shortened: what is so badly known needs no second opinion."""

DIRECTIONS = 2
"""Directions that are tried, the least known first, either way."""

LEVER_MM = 50.0
"""Lever at which a rotation counts as motion."""

ITERATIONS = 15

DISTINGUISHABLE = 3.0
"""Standard deviations of the difference in how well two places explain the X-rays, beyond which one is refuted."""


def widened_by_local_minima(
    problem: RigidProblem,
    state: State,
    doubts: dict[int, PoseUncertainty],
    step: Callable[[int, int], None],
) -> dict[int, PoseUncertainty]:
    """The covariances, those of bones that would fit as well elsewhere widened to hold that place.

    problem, state: as the joint fit left them; step: called with the number of the bone and of all before each.
    """
    widened = {}
    for n, (k, doubt) in enumerate(doubts.items()):
        step(n, len(doubts))
        away = max(_other_places(problem, state, k, doubt), key=_size_mm, default=np.zeros(6))
        widened[k] = PoseUncertainty(doubt.covariance + np.outer(away, away))
    return widened


def _other_places(problem: RigidProblem, state: State, k: int, doubt: PoseUncertainty) -> list[np.ndarray]:
    """(6,) perturbations of a bone's pose that lead to where it rests as well, so far as the X-rays tell."""
    body = problem.bodies[k]
    starts = [
        about(perturbation(push), body.centre) @ state.poses[k] for push in _perturbations(doubt.covariance)
    ]
    alone = _problem_of_one_bone(problem, state, k, starts)
    if alone is None:
        return []
    found = State(state.poses[k][None], np.stack([np.eye(4)] * len(alone.views)))
    places = []
    for start in starts:
        rest = minimise(alone, replace(found, poses=start[None]), SolverOptions(ITERATIONS)).state
        if not _is_refuted(alone, found, rest):
            places.append(perturbation_between(found.poses[0], rest.poses[0], body.centre))
    return places


def _perturbations(covariance: np.ndarray) -> list[np.ndarray]:
    """Perturbations (6,) of PUSH_DEVIATIONS along the least known directions, either way."""
    lever = np.array([LEVER_MM] * 3 + [1.0] * 3)
    variances, directions = np.linalg.eigh(covariance * np.outer(lever, lever))
    lengths = np.minimum(PERTURBATION_DEVIATIONS * np.sqrt(variances), LARGEST_PERTURBATION_MM)
    return [
        sign * lengths[-n] * directions[:, -n] / lever for n in range(1, DIRECTIONS + 1) for sign in (-1, 1)
    ]


def _problem_of_one_bone(
    problem: RigidProblem, state: State, k: int, starts: list[np.ndarray]
) -> RigidProblem | None:
    """The same objective as a function of one bone's pose, the others and the cameras standing still.

    None where no X-ray shows the bone.
    """
    views = [_view_of_one_bone(problem, state, n, k, starts) for n in range(len(problem.views))]
    views = [view.cropped_to_weight() for view in views if (view.weight > 0).any()]
    if not views:
        return None
    prior = None
    if isinstance(problem.prior, ArticulationPrior):
        whole, part = (sum(float(view.weight.sum()) for view in each) for each in (problem.views, views))
        prior = OneBonePrior(problem.prior, k, state.poses, whole / part)
    return RigidProblem(
        [problem.bodies[k]], views, [0], [], problem.camera_centre, problem.step_mm, problem.backend, prior
    )


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
        near = (slice(max(row0 - grow, 0), row1 + grow), slice(max(column0 - grow, 0), column1 + grow))
        if row1 > row0 and column1 > column0:
            weight[near] = view.weight[near]
    return replace(view, camera=camera, static=static, weight=weight)


def _is_refuted(alone: RigidProblem, found: State, rest: State) -> bool:
    """Whether the X-rays tell that ``found`` explains them better than ``rest``.

    The difference of the weighted squared residuals is summed within patches, over which the residual is correlated;
    the spread of these sums is that of their total.
    """
    total, variance = 0.0, 0.0
    for n, view in enumerate(alone.views):
        here, there = (alone.residual(state, n).astype(np.float64) ** 2 for state in (found, rest))
        worse = (view.weight * (there - here))[None]
        sums = cluster_sums(worse, PATCHES_PER_CLUSTER * view.contrast.size)
        total += float(sums.sum())
        variance += float((sums**2).sum())
    return total > DISTINGUISHABLE * np.sqrt(variance)


def _size_mm(away: np.ndarray) -> float:
    return float(np.linalg.norm(away * ([LEVER_MM] * 3 + [1.0] * 3)))
