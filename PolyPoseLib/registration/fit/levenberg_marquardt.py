"""Levenberg-Marquardt for any problem that gives its cost and its normal equations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from PolyPoseLib.registration.fit.problem import Normal

S = TypeVar("S")
"""State of a problem: the values of its unknowns."""

TRIALS = 8
"""Steps that are tried at one state, each with more damping than the one before."""


class Problem(Protocol[S]):
    """A least-squares problem whose unknowns are rigid motions, six numbers [rotation (rad), translation (mm)] each."""

    @property
    def size(self) -> int:
        """Number P of scalar unknowns."""
        ...

    def cost(self, state: S, /) -> float:
        """What is minimised."""
        ...

    def moved(self, state: S, step: np.ndarray, /) -> S:
        """The state after a step (P,)."""
        ...

    def normal_equations(self, state: S, /) -> Normal:
        """Gauss-Newton normal equations at a state."""
        ...


@dataclass(frozen=True)
class SolverOptions:
    """When the solver stops, and how far it steps.

    Parameters
    ----------
    iterations : int
        Accepted steps at most.
    tolerance : float
        Relative fall of the cost that counts as none; two of them in a row end the run.
    damping : float
        At the start, relative to the diagonal of the normal matrix.
    largest_rotation_rad, largest_translation_mm : float
        Trust region of one step, for each rigid motion by itself.

    """

    iterations: int = 20
    tolerance: float = 1e-4
    damping: float = 1e-2
    largest_rotation_rad: float = 0.15
    largest_translation_mm: float = 12.0


@dataclass(frozen=True)
class Solution(Generic[S]):
    """Where the solver stopped.

    Attributes
    ----------
    state : S
        The last accepted one.
    cost : float
        At the state.
    costs : tuple[float, ...]
        After each accepted step.

    """

    state: S
    cost: float
    costs: tuple[float, ...]


@dataclass(frozen=True)
class _Trial(Generic[S]):
    """A step (P,), and the state and cost that it leads to."""

    step: np.ndarray
    state: S
    cost: float


def minimise(
    problem: Problem[S],
    state: S,
    options: SolverOptions,
    before_step: Callable[[S, int, float], None] | None = None,
) -> Solution[S]:
    """Minimise a problem's cost.

    A step that lowers the cost is doubled for as long as that lowers it further: where images are off by more than
    their texture is fine, the normal equations are far too steep and propose small steps.

    Parameters
    ----------
    problem : Problem
        One without unknowns is only evaluated.
    state : S
        Where to start.
    options : SolverOptions
        When to stop.
    before_step : callable, optional
        Called with the state, the iteration and the cost (infinite at first) before every step; it may change the
        problem (weights, static images) in place, and raise to cancel.

    Returns
    -------
    Solution
        Where the solver stopped.

    References
    ----------
    D. Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11 (1963).

    """
    if problem.size == 0:
        if before_step is not None:
            before_step(state, 0, np.inf)
        return Solution(state, problem.cost(state), ())
    damping = options.damping
    costs: list[float] = []
    cost = np.inf
    small = 0
    for iteration in range(options.iterations):
        if before_step is not None:
            before_step(state, iteration, cost)
        normal = problem.normal_equations(state)
        cost = normal.cost
        trial, damping = _first_that_lowers(problem, state, normal, damping, options)
        if trial is None:
            break
        trial = _lengthened(problem, state, trial, options)
        fall = (cost - trial.cost) / max(cost, 1e-12)
        state, cost = trial.state, trial.cost
        costs.append(cost)
        damping = max(damping / 3, 1e-6)
        small = small + 1 if fall < options.tolerance else 0
        if small >= 2:
            break
    return Solution(state, cost, tuple(costs))


def _first_that_lowers(
    problem: Problem[S], state: S, normal: Normal, damping: float, options: SolverOptions
) -> tuple[_Trial[S] | None, float]:
    """The first of several steps, ever more damped, that lowers the cost, or None; and the damping it took."""
    for _ in range(TRIALS):
        step = damped_steps(normal.matrix[None], normal.gradient[None], np.array([damping]))[0]
        step = limited(step, options)
        moved = problem.moved(state, step)
        cost = problem.cost(moved)
        if cost < normal.cost:
            return _Trial(step, moved, cost), damping
        damping = min(damping * 4, 1e6)
    return None, damping


def _lengthened(problem: Problem[S], state: S, trial: _Trial[S], options: SolverOptions) -> _Trial[S]:
    """The step doubled for as long as the cost falls and the trust region allows."""
    while True:
        longer = limited(2 * trial.step, options)
        if (np.abs(longer - trial.step) <= 1e-5 * np.abs(trial.step)).all():
            return trial
        moved = problem.moved(state, longer)
        cost = problem.cost(moved)
        if not cost < trial.cost:
            return trial
        trial = _Trial(longer, moved, cost)


def damped_steps(matrices: np.ndarray, gradients: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Steps (S, P) of normal equations (S, P, P) and (S, P), each with a damping (S,) of its own."""
    diagonal = np.diagonal(matrices, axis1=1, axis2=2)
    floor = np.maximum(diagonal.max(axis=1, keepdims=True), 1e-12) * 1e-9
    added = damping[:, None] * np.maximum(diagonal, floor) + floor
    damped = matrices + added[:, :, None] * np.eye(matrices.shape[1])
    return -np.linalg.solve(damped, gradients[..., None])[..., 0]


def limited(steps: np.ndarray, options: SolverOptions) -> np.ndarray:
    """Steps (..., P) with each rigid motion's part shortened to the trust region."""
    parts = steps.reshape(*steps.shape[:-1], -1, 6)
    turn = np.linalg.norm(parts[..., :3], axis=-1) / options.largest_rotation_rad
    shift = np.linalg.norm(parts[..., 3:], axis=-1) / options.largest_translation_mm
    return (parts / np.maximum(np.maximum(turn, shift), 1.0)[..., None]).reshape(steps.shape)
