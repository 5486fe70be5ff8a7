"""The least-squares problem: its derivatives, its minimum and its invariances."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import phantom

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import ArticulationPrior
from PolyPoseLib.registration.fit import problem as problem_module
from PolyPoseLib.registration.fit.camera_prior import CameraPrior
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.similarity.local_contrast import LocalContrast
from PolyPoseLib.simulation.simulate import view_cameras

LEVEL = Level(4.0, 24.0, 10)


@pytest.fixture(scope="module")
def scene() -> Scene:
    ct, structures = phantom()
    return Scene(ct, structures, "pelvis")


def _poses(scene: Scene, rng: np.random.Generator, degrees: float, mm: float) -> np.ndarray:
    poses = np.stack([np.eye(4)] * len(scene.names))
    for k in range(1, len(poses)):
        delta = np.r_[rng.normal(0, np.radians(degrees), 3), rng.normal(0, mm, 3)]
        poses[k] = about(perturbation(delta), scene.centres[k])
    return poses


def _problem(scene: Scene, poses: np.ndarray, free_cameras=(), prior=None) -> RigidProblem:
    """Noise-free views of the bones at ``poses``."""
    ct, _ = phantom()
    cameras = view_cameras(ct, (0.0, 60.0), 120, detector_mm=330.0)
    blank = [
        Observation(np.zeros((120, 120), np.float32), np.ones((120, 120), bool), camera) for camera in cameras
    ]
    views = [view_at(LEVEL, each, scene.anchor_centre) for each in blank]
    backend = select_backend()
    problem = RigidProblem(
        scene.bodies(4.0), views, [1, 2], free_cameras, scene.anchor_centre, 4.0, backend, prior
    )
    truth = State(poses, np.stack([np.eye(4)] * 2))
    for n, view in enumerate(views):
        view.target = view.contrast.normalise(problem.render(truth, n)[0]).values
    return problem


@pytest.mark.parametrize("groups", [[(0,), (1,)], [(0, 1)]], ids=["cameras", "rig"])
@pytest.mark.parametrize("seed", range(3))
def test_gradient_is_the_derivative_of_the_cost(
    scene: Scene, seed: int, groups: list, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(seed)
    prior = ArticulationPrior(scene.articulations, scene.centres, [1, 2], 0.02)
    problem = _problem(scene, _poses(scene, rng, 4, 4), groups, prior)
    monkeypatch.setattr(problem_module, "WEIGHT", 0.05)  # as it is, the images drown it
    for group in groups:
        camera = problem.views[group[0]].camera
        off = about(perturbation(np.r_[rng.normal(0, 0.05, 3), rng.normal(0, 10, 3)]), np.zeros(3))
        expected = camera.with_extrinsic(camera.extrinsic @ off)
        problem.views[group[0]].expected = CameraPrior(expected, 5.0, 20.0)
    corrections = [
        about(perturbation(np.r_[rng.normal(0, 0.02, 3), rng.normal(0, 2, 3)]), np.zeros(3)) for _ in "ab"
    ]
    state = State(_poses(scene, rng, 3, 3), np.stack(corrections))
    normal = problem.normal_equations(state)
    size = np.tile([3e-3] * 3 + [0.1] * 3, problem.size // 6)
    numeric = np.array(
        [
            (problem.cost(problem.moved(state, h * e)) - problem.cost(problem.moved(state, -h * e))) / (4 * h)
            for h, e in zip(size, np.eye(problem.size), strict=True)
        ]
    )
    # In units of what a step of the given size changes, so that radians and millimetres compare.
    assert normal.cost == pytest.approx(problem.cost(state), rel=1e-5)
    np.testing.assert_allclose(
        normal.gradient * size, numeric * size, atol=0.06 * np.abs(numeric * size).max()
    )


@pytest.mark.parametrize("seed", range(3))
def test_finds_the_poses_that_made_the_images(scene: Scene, seed: int) -> None:
    rng = np.random.default_rng(10 + seed)
    poses = _poses(scene, rng, 3, 3)
    problem = _problem(scene, poses)
    start = State(np.stack([np.eye(4)] * 3), np.stack([np.eye(4)] * 2))
    solution = minimise(problem, start, SolverOptions(40, tolerance=1e-9))
    assert solution.cost < 1e-3 * problem.cost(start)
    for k in (1, 2):
        difference = (solution.state.poses[k] - poses[k]) @ np.r_[scene.centres[k], 1.0]
        assert np.linalg.norm(difference[:3]) < 0.3


def test_costs_fall_at_every_accepted_step(scene: Scene) -> None:
    problem = _problem(scene, _poses(scene, np.random.default_rng(3), 4, 4))
    start = State(np.stack([np.eye(4)] * 3), np.stack([np.eye(4)] * 2))
    costs = minimise(problem, start, SolverOptions(12)).costs
    assert len(costs) > 3
    assert (np.diff(costs) < 0).all()


def test_moving_everything_is_moving_the_camera(scene: Scene) -> None:
    problem = _problem(scene, np.stack([np.eye(4)] * 3))
    motion = about(perturbation(np.array([0.03, -0.02, 0.04, 3.0, -2.0, 1.0])), scene.anchor_centre)
    rest, still = np.stack([np.eye(4)] * 3), np.stack([np.eye(4)] * 2)
    by_poses, _ = problem.render(State(np.stack([motion] * 3), still), 0)
    by_camera, _ = problem.render(State(rest, np.stack([motion] * 2)), 0)
    np.testing.assert_allclose(by_poses, by_camera, atol=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_local_contrast_ignores_gain_offset_and_masked_pixels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.normal(size=(40, 50)).cumsum(0).cumsum(1)
    mask = rng.random((40, 50)) > 0.2
    contrast = LocalContrast(mask, 9, 1e-6)
    changed = np.where(mask, 2.5 * image - 7, 1e6)
    np.testing.assert_allclose(
        contrast.normalise(changed).values, contrast.normalise(image).values, atol=2e-3
    )


@pytest.mark.parametrize("seed", range(3))
def test_local_contrast_derivative(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = rng.normal(size=(30, 36)).cumsum(1)
    contrast = LocalContrast(rng.random((30, 36)) > 0.1, 7, 0.3)
    change = rng.normal(size=(1, 8, 9)).astype(np.float32)
    derivative, window = contrast.derivative(contrast.normalise(image), change, (20, 28, 5, 14))
    full = np.zeros((30, 36))
    full[20:28, 5:14] = change[0]
    step = 1e-3
    numeric = (
        contrast.normalise(image + step * full).values - contrast.normalise(image - step * full).values
    ) / (2 * step)
    found = np.zeros((30, 36))
    found[window[0] : window[1], window[2] : window[3]] = derivative[0]
    np.testing.assert_allclose(found, numeric, atol=2e-3)


@pytest.mark.parametrize("seed", range(4))
def test_cropping_views_to_their_weights_changes_no_cost(scene: Scene, seed: int) -> None:
    rng = np.random.default_rng(20 + seed)
    problem = _problem(scene, _poses(scene, rng, 3, 3))
    state = State(_poses(scene, rng, 3, 3), np.stack([np.eye(4)] * 2))
    for view in problem.views:
        view.static = rng.normal(2, 0.05, view.static.shape).astype(np.float32)
        height, width = view.weight.shape
        row, column = rng.integers(0, height // 2), rng.integers(0, width // 2)
        view.weight = np.zeros_like(view.weight)
        view.weight[row : row + height // 4, column : column + width // 3] = rng.uniform(0.1, 1)
        view.noise_share = np.zeros(())
    whole = problem.normal_equations(state)
    shapes = [view.weight.shape for view in problem.views]
    problem.views = [view.cropped_to_weight() for view in problem.views]
    assert all(view.weight.size < np.prod(shape) for view, shape in zip(problem.views, shapes, strict=True))
    part = problem.normal_equations(state)
    assert part.cost == pytest.approx(whole.cost, rel=1e-4)
    np.testing.assert_allclose(part.gradient, whole.gradient, atol=2e-3 * np.abs(whole.gradient).max())
    np.testing.assert_allclose(part.matrix, whole.matrix, atol=2e-3 * np.abs(whole.matrix).max())


def test_projections_are_remembered_only_for_their_pose_and_camera(scene: Scene) -> None:
    rng = np.random.default_rng(5)
    problem = _problem(scene, _poses(scene, rng, 3, 3))
    still = np.stack([np.eye(4)] * 2)
    states = [State(_poses(scene, rng, 3, 3), still) for _ in range(5)]
    states += [State(states[0].poses, np.stack([perturbation(rng.normal(0, 0.02, 6)) for _ in "ab"]))]
    for state in [*states, *states[::-1]]:
        fresh = replace(problem)
        for n in range(2):
            np.testing.assert_array_equal(problem.render(state, n)[0], fresh.render(state, n)[0])
            np.testing.assert_array_equal(
                problem.render_without(1, state, n), fresh.render_without(1, state, n)
            )
            assert problem.render(state, n, jacobian=True)[1][1].jacobian is not None
    before = problem.render(states[0], 0)[0]
    problem.views[0].camera = problem.views[1].camera
    assert np.abs(problem.render(states[0], 0)[0] - before).max() > 0.1
