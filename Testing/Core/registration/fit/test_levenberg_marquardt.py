"""Levenberg-Marquardt: it never climbs, and strides where its model of the cost is too steep."""

import numpy as np
import pytest

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
