"""Levenberg-Marquardt with robust pixel weights, for :class:`RigidProblem`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.registration.fit.problem import RigidProblem, State


@dataclass(frozen=True)
class SolverOptions:
    """iterations: accepted steps at most; tolerance: relative fall of the cost that counts as none;
    largest_rotation_rad, largest_translation_mm: trust region of one step.
    """

    iterations: int = 20
    tolerance: float = 1e-4
    damping: float = 1e-2
    largest_rotation_rad: float = 0.15
    largest_translation_mm: float = 12.0


@dataclass(frozen=True)
class Solution:
    """state: where the solver stopped; cost: there; evaluations: of the cost; costs: after each accepted step."""

    state: State
    cost: float
    evaluations: int
    costs: tuple[float, ...]


def minimise(
    problem: RigidProblem,
    state: State,
    options: SolverOptions,
    before_step: Callable[[State, int, float], None] | None = None,
) -> Solution:
    """Minimise the problem's cost from ``state``.

    A step that lowers the cost is doubled for as long as that lowers it further: where images are off by more than
    their texture is fine, the normal equations are far too steep and propose small steps.

    before_step: called with the state, the iteration and the cost before every step; it may refresh the views
    (weights, static images) in place, and raise to cancel. A problem without unknowns is only evaluated.
    """
    if problem.size == 0:
        if before_step is not None:
            before_step(state, 0, np.inf)
        return Solution(state, problem.cost(state), 1, ())
    damping = options.damping
    evaluations = 0
    costs: list[float] = []
    cost = np.inf
    small = 0
    for iteration in range(options.iterations):
        if before_step is not None:
            before_step(state, iteration, cost)
        normal = problem.normal_equations(state)
        cost = normal.cost
        evaluations += 1
        accepted = False
        for _ in range(8):
            step = _limited(_damped_step(normal.matrix, normal.gradient, damping), options)
            trial = problem.moved(state, step)
            trial_cost = problem.cost(trial)
            evaluations += 1
            if trial_cost < cost:
                accepted = True
                break
            damping = min(damping * 4, 1e6)
        if not accepted:
            break
        while trial_cost < cost:
            longer = _limited(2 * step, options)
            further = problem.moved(state, longer)
            further_cost = problem.cost(further)
            evaluations += 1
            if further_cost >= trial_cost or (np.abs(longer - step) <= 1e-5 * np.abs(step)).all():
                break
            step, trial, trial_cost = longer, further, further_cost
        fall = (cost - trial_cost) / max(cost, 1e-12)
        state, cost = trial, trial_cost
        costs.append(cost)
        damping = max(damping / 3, 1e-6)
        small = small + 1 if fall < options.tolerance else 0
        if small >= 2:
            break
    return Solution(state, cost, evaluations, tuple(costs))


def _damped_step(matrix: np.ndarray, gradient: np.ndarray, damping: float) -> np.ndarray:
    diagonal = np.diag(matrix).copy()
    floor = max(float(diagonal.max()), 1e-12) * 1e-9
    damped = matrix + np.diag(damping * np.maximum(diagonal, floor) + floor)
    return -np.linalg.solve(damped, gradient)


def _limited(step: np.ndarray, options: SolverOptions) -> np.ndarray:
    """Shorten each body's part of the step to the trust region."""
    limited = step.copy()
    for start in range(0, len(step), 6):
        turn = np.linalg.norm(step[start : start + 3]) / options.largest_rotation_rad
        shift = np.linalg.norm(step[start + 3 : start + 6]) / options.largest_translation_mm
        limited[start : start + 6] /= max(turn, shift, 1.0)
    return limited
