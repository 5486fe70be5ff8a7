"""A second pose that fits the X-rays as well widens the interval; where there is none, nothing changes."""

import numpy as np
import pytest
from phantom_study import phantom

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import ArticulationPrior, OneBonePrior
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.covariance import (
    PoseUncertainty,
    joint_covariance,
    pose_uncertainties,
)
from PolyPoseLib.registration.uncertainty.local_minima import widened_by_local_minima
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.simulation.simulate import view_cameras

LEVEL = Level(4.0, 24.0, 10)
FEMUR = 1


@pytest.fixture(scope="module")
def scene() -> Scene:
    ct, structures = phantom()
    return Scene(ct, structures, "pelvis")


def problem_at(scene: Scene, state: State, doubles: tuple[np.ndarray, ...], seed: int) -> RigidProblem:
    """Noisy views of the bones at ``state`` in which the femur is seen at other poses as well, each as strongly."""
    rng = np.random.default_rng(seed)
    cameras = view_cameras(phantom()[0], (0.0, 60.0), 120, detector_mm=330.0)
    blank = [Observation(np.zeros((120, 120), np.float32), np.ones((120, 120), bool), c) for c in cameras]
    views = [view_at(LEVEL, each, scene.anchor_centre) for each in blank]
    problem = RigidProblem(scene.bodies(4.0), views, [1, 2], [], scene.anchor_centre, 4.0, select_backend())
    for n, view in enumerate(views):
        image = problem.render(state, n)[0]
        for pose in doubles:
            poses = state.poses.copy()
            poses[FEMUR] = pose
            image = image + problem.render(State(poses, state.corrections), n)[0]
        target = view.contrast.normalise(image / (1 + len(doubles))).values
        view.target = target + rng.normal(0, 0.1, target.shape).astype(np.float32)
        view.weight = np.ones(target.shape, np.float32)
    return problem


def moved(scene: Scene, rng: np.random.Generator) -> State:
    poses = np.stack([np.eye(4)] * len(scene.names))
    for k in range(1, len(poses)):
        poses[k] = about(perturbation(np.r_[rng.normal(0, 0.05, 3), rng.normal(0, 3, 3)]), scene.centres[k])
    return State(poses, np.stack([np.eye(4)] * 2))


def deviation(uncertainty: PoseUncertainty) -> float:
    return float(np.sqrt(np.trace(uncertainty.covariance[3:, 3:])))


@pytest.mark.parametrize("seed", range(4))
def test_a_bone_that_is_seen_at_one_place_keeps_its_interval(scene: Scene, seed: int) -> None:
    state = moved(scene, np.random.default_rng(seed))
    problem = problem_at(scene, state, (), seed)
    uncertainties = pose_uncertainties(problem, joint_covariance(problem, state))
    steps = []
    widened = widened_by_local_minima(
        problem, state, uncertainties, lambda n, total: steps.append((n, total))
    )
    assert steps == [(0, 2), (1, 2)]
    for k, uncertainty in uncertainties.items():
        assert np.linalg.eigvalsh(widened[k].covariance - uncertainty.covariance).min() >= -1e-12
        assert deviation(widened[k]) < 1.3 * deviation(uncertainty)


@pytest.mark.parametrize("seed", range(4))
def test_a_bone_that_is_seen_at_two_places_is_given_both(scene: Scene, seed: int) -> None:
    rng = np.random.default_rng(seed)
    state = moved(scene, rng)
    sideways = perturbation(np.r_[np.zeros(3), 7.0 * rng.choice((-1, 1)), 0, 0])
    double = sideways @ state.poses[FEMUR]
    problem = problem_at(scene, state, (double,), seed)
    narrow = PoseUncertainty(np.diag([1e-5] * 3 + [9.0, 0.25, 0.25]))
    widened = widened_by_local_minima(problem, state, {FEMUR: narrow}, lambda n, total: None)[FEMUR]
    assert widened.covariance[3, 3] > narrow.covariance[3, 3] + 3.0**2
    assert widened.covariance[4, 4] < narrow.covariance[4, 4] + 3.0**2


def test_a_bone_that_no_view_shows_is_left_as_it_is(scene: Scene) -> None:
    state = moved(scene, np.random.default_rng(0))
    problem = problem_at(scene, state, (), 0)
    for view in problem.views:
        view.weight = np.zeros_like(view.weight)
    uncertainty = PoseUncertainty.unseen()
    widened = widened_by_local_minima(problem, state, {FEMUR: uncertainty}, lambda n, total: None)
    np.testing.assert_array_equal(widened[FEMUR].covariance, uncertainty.covariance)


@pytest.mark.parametrize("seed", range(3))
def test_one_bones_prior_is_the_whole_ones_as_a_function_of_it(scene: Scene, seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses, other = moved(scene, rng).poses, moved(scene, rng).poses[FEMUR]
    whole = ArticulationPrior(scene.articulations, scene.centres, [1, 2], 0.02)
    part = OneBonePrior(whole, FEMUR, poses, factor=3.0)
    changed = poses.copy()
    changed[FEMUR] = other
    difference = whole.cost(changed) - whole.cost(poses)
    assert part.cost(other[None]) - part.cost(poses[FEMUR][None]) == pytest.approx(3 * difference, rel=1e-9)
