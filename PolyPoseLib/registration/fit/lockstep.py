"""Levenberg-Marquardt from many starts of one body at once, each start with a damping of its own.

The same steps as :func:`PolyPoseLib.registration.fit.levenberg_marquardt.minimise` takes from one start after the
other; costs and normal equations of all starts are asked for together, which leaves little to do between renderings.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.fit.levenberg_marquardt import TRIALS, SolverOptions, damped_steps, limited


@dataclass(frozen=True)
class Normals:
    """Gauss-Newton normal equations of S starts, six unknowns each.

    Attributes
    ----------
    costs : (S,) ndarray
        Weighted means of squared residuals, or what else is minimised.
    matrices : (S, 6, 6) ndarray
        Second derivatives of half the costs, to first order in the residuals.
    gradients : (S, 6) ndarray
        Of half the costs.

    """

    costs: np.ndarray
    matrices: np.ndarray
    gradients: np.ndarray


class ManyPoses(Protocol):
    """A least-squares problem of one body's pose that is evaluated at many poses at once."""

    @property
    def centre(self) -> np.ndarray:
        """(3,) LPS mm, about which the pose is perturbed."""
        ...

    def costs(self, poses: np.ndarray, /) -> np.ndarray:
        """(S,) what is minimised, at poses (S, 4, 4)."""
        ...

    def normal_equations(self, poses: np.ndarray, /) -> Normals:
        """Gauss-Newton normal equations at poses (S, 4, 4)."""
        ...


def minimise_together(
    problem: ManyPoses, starts: np.ndarray, options: SolverOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Minimise a problem's cost from every start.

    Parameters
    ----------
    problem : ManyPoses
        Of one body.
    starts : (S, 4, 4) ndarray
        Poses, fixed to moving, mm.
    options : SolverOptions
        When each of them stops.

    Returns
    -------
    poses : (S, 4, 4) ndarray
        Where each ended.
    costs : (S,) ndarray
        There.

    """
    poses = np.array(starts, dtype=np.float64)
    count = len(poses)
    damping, costs = np.full(count, options.damping), np.full(count, np.inf)
    small = np.zeros(count, int)
    active = np.arange(count)
    for _ in range(options.iterations):
        if not len(active):
            break
        normals = problem.normal_equations(poses[active])
        costs[active] = normals.costs
        trial = _first_that_lower(problem, poses[active], normals, damping[active], options)
        _lengthen(problem, poses[active], trial, options)
        lowered = trial.costs < normals.costs
        took = active[lowered]
        fall = (costs[took] - trial.costs[lowered]) / np.maximum(costs[took], 1e-12)
        poses[took], costs[took] = trial.poses[lowered], trial.costs[lowered]
        damping[active] = trial.damping
        damping[took] = np.maximum(damping[took] / 3, 1e-6)
        small[took] = np.where(fall < options.tolerance, small[took] + 1, 0)
        active = took[small[took] < 2]
    return poses, costs


@dataclass
class _Trials:
    """Steps (S, 6), where they lead to, the costs there (infinite where none lowers it), and the dampings."""

    steps: np.ndarray
    poses: np.ndarray
    costs: np.ndarray
    damping: np.ndarray


def _first_that_lower(
    problem: ManyPoses, poses: np.ndarray, normals: Normals, damping: np.ndarray, options: SolverOptions
) -> _Trials:
    """The first of several steps, ever more damped, that lowers each cost."""
    count = len(poses)
    trial = _Trials(np.zeros((count, 6)), poses.copy(), np.full(count, np.inf), damping.copy())
    pending = np.arange(count)
    for _ in range(TRIALS):
        steps = damped_steps(normals.matrices[pending], normals.gradients[pending], trial.damping[pending])
        steps = limited(steps, options)
        moved = _moved(poses[pending], steps, problem.centre)
        costs = problem.costs(moved)
        lower = costs < normals.costs[pending]
        found = pending[lower]
        trial.steps[found], trial.poses[found], trial.costs[found] = steps[lower], moved[lower], costs[lower]
        pending = pending[~lower]
        if not len(pending):
            break
        trial.damping[pending] = np.minimum(trial.damping[pending] * 4, 1e6)
    return trial


def _lengthen(problem: ManyPoses, poses: np.ndarray, trial: _Trials, options: SolverOptions) -> None:
    """Double each step for as long as the cost falls and the trust region allows."""
    growing = np.flatnonzero(np.isfinite(trial.costs))
    while len(growing):
        before = trial.steps[growing]
        longer = limited(2 * before, options)
        differs = (np.abs(longer - before) > 1e-5 * np.abs(before)).any(axis=1)
        growing, longer = growing[differs], longer[differs]
        if not len(growing):
            return
        moved = _moved(poses[growing], longer, problem.centre)
        costs = problem.costs(moved)
        lower = costs < trial.costs[growing]
        growing = growing[lower]
        trial.steps[growing], trial.poses[growing] = longer[lower], moved[lower]
        trial.costs[growing] = costs[lower]


def _moved(poses: np.ndarray, steps: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Poses (S, 4, 4) perturbed about a centre by steps (S, 6)."""
    return np.stack(
        [about(perturbation(step), centre) @ pose for step, pose in zip(steps, poses, strict=True)]
    )
