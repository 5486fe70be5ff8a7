"""Levenberg-Marquardt: it never climbs, and strides where its model of the cost is too steep."""

import numpy as np
import pytest

from PolyPoseLib.errors import CancelledError
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import Normal, State


class Bowl:
    """cost = x' A x about ``bottom`` for one body's translation (3,); the normal equations take ``steep`` times A."""

    size = 6

    def __init__(self, rng: np.random.Generator, steep: float) -> None:
        factor = rng.normal(size=(3, 3))
        self.curvature = factor @ factor.T + 0.5 * np.eye(3)
        self.bottom = rng.uniform(-60, 60, 3)
        self.steep = steep

    def moved(self, state: State, step: np.ndarray) -> State:
        poses = state.poses.copy()
        poses[0, :3, 3] += step[3:6]
        return State(poses, state.corrections)

    def cost(self, state: State) -> float:
        off = state.poses[0, :3, 3] - self.bottom
        return float(off @ self.curvature @ off)

    def normal_equations(self, state: State) -> Normal:
        off = state.poses[0, :3, 3] - self.bottom
        matrix = np.eye(6)
        matrix[3:, 3:] = self.steep * self.curvature
        return Normal(self.cost(state), matrix, np.r_[np.zeros(3), self.curvature @ off])


def start() -> State:
    return State(np.eye(4)[None], np.eye(4)[None])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("steep", [1.0, 10.0, 100.0])
def test_reaches_the_bottom_however_steep_its_model(seed, steep):
    bowl = Bowl(np.random.default_rng(seed), steep)
    found = minimise(bowl, start(), SolverOptions(40, tolerance=1e-12))
    assert np.linalg.norm(found.state.poses[0, :3, 3] - bowl.bottom) < 0.5
    assert (np.diff(found.costs) <= 0).all()


def test_steps_stay_in_the_trust_region():
    bowl = Bowl(np.random.default_rng(0), 100.0)
    options = SolverOptions(1, largest_translation_mm=3.0)
    moved = minimise(bowl, start(), options).state.poses[0, :3, 3]
    assert np.linalg.norm(moved) <= 3.0 + 1e-9


def test_stays_at_the_bottom():
    bowl = Bowl(np.random.default_rng(1), 1.0)
    bowl.bottom = np.zeros(3)
    assert minimise(bowl, start(), SolverOptions(10)).cost == 0


def test_a_problem_without_unknowns_is_only_evaluated():
    bowl = Bowl(np.random.default_rng(0), 1.0)
    bowl.size = 0
    asked = []
    found = minimise(bowl, start(), SolverOptions(5), lambda *step: asked.append(step))
    assert found.cost == bowl.cost(start()) and found.costs == () and len(asked) == 1
    np.testing.assert_array_equal(found.state.poses, start().poses)


class Quadratic:
    """cost = 2 (x - bottom)' A (x - bottom) / 2 of two rigid motions; the state is the vector (12,) itself."""

    size = 12

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        factor = rng.normal(size=(12, 12))
        self.curvature = factor @ factor.T + 0.1 * np.eye(12)
        self.bottom = rng.normal(size=12) * 0.02

    def moved(self, state: np.ndarray, step: np.ndarray) -> np.ndarray:
        return state + step

    def cost(self, state: np.ndarray) -> float:
        return float((state - self.bottom) @ self.curvature @ (state - self.bottom))

    def normal_equations(self, state: np.ndarray) -> Normal:
        return Normal(self.cost(state), self.curvature, self.curvature @ (state - self.bottom))


@pytest.mark.parametrize("seed", range(5))
def test_any_state_will_do_and_every_iteration_is_reported(seed):
    problem, seen = Quadratic(seed), []
    options = SolverOptions(30, tolerance=1e-12)
    found = minimise(problem, np.zeros(12), options, lambda x, n, cost: seen.append((n, cost)))
    np.testing.assert_allclose(found.state, problem.bottom, atol=1e-4)
    assert [n for n, _ in seen] == list(range(len(seen)))
    costs = [cost for _, cost in seen]
    assert costs[0] == np.inf and (np.diff(costs[1:]) < 0).all()


def test_a_step_is_limited_for_every_motion_by_itself():
    problem = Quadratic(0)
    problem.curvature = np.diag(np.repeat([1e-6, 1.0], 6))
    problem.bottom = np.concatenate([np.full(6, 1e3), np.full(6, 1e-3)])
    places = []
    options = SolverOptions(5, largest_rotation_rad=0.15, largest_translation_mm=12.0)
    minimise(problem, np.zeros(12), options, lambda x, n, cost: places.append(x))
    steps = np.diff(places, axis=0).reshape(-1, 2, 2, 3)
    sizes = np.linalg.norm(steps, axis=3)
    assert (sizes <= np.array([0.15, 12.0]) * (1 + 1e-9)).all()
    assert sizes[:, 0].max() > 0.1 and sizes[:, 1].max() < 1e-2


def test_it_stops_when_its_caller_raises():
    def cancel(x, n, cost):
        if n == 1:
            raise CancelledError("enough")

    with pytest.raises(CancelledError):
        minimise(Quadratic(0), np.zeros(12), SolverOptions(30), cancel)


def test_a_cost_that_is_not_a_number_is_never_accepted():
    problem = Quadratic(1)
    inside = problem.cost
    problem.cost = lambda x: inside(x) if np.abs(x).max() < 0.01 else np.nan
    found = minimise(problem, np.zeros(12), SolverOptions(20))
    assert np.isfinite(found.cost) and found.cost <= inside(np.zeros(12))
