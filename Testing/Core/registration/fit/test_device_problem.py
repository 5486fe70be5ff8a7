"""All bodies in all views in one batch of torch: the same cost, normal equations and minimum as body by body."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import phantom
from pretended_gpu import CUDA

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import ArticulationPrior
from PolyPoseLib.registration.fit.camera_prior import CameraPrior
from PolyPoseLib.registration.fit.device_problem import DeviceProblem, as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.simulation.simulate import view_cameras

LEVEL = Level(4.0, 24.0, 10)
DEVICES = [
    "cpu",
    CUDA,
]


@pytest.fixture(scope="module")
def scene() -> Scene:
    ct, structures = phantom()
    return Scene(ct, structures, "pelvis")


def _poses(scene: Scene, rng: np.random.Generator, degrees: float, mm: float) -> np.ndarray:
    deltas = [np.r_[rng.normal(0, np.radians(degrees), 3), rng.normal(0, mm, 3)] for _ in scene.names[1:]]
    moved = [
        about(perturbation(delta), centre) for delta, centre in zip(deltas, scene.centres[1:], strict=True)
    ]
    return np.stack([np.eye(4), *moved])


def _problem(scene: Scene, seed: int, groups: list) -> RigidProblem:
    """Views of different sizes and masks, of bones that moved, with noise, priors and random weights."""
    rng = np.random.default_rng(seed)
    ct, _ = phantom()
    cameras = view_cameras(ct, (0.0, 60.0), 120, detector_mm=330.0)
    cameras = [cameras[0], cameras[1].cropped(10, 110, 4, 120)]
    views = []
    for camera in cameras:
        mask = np.ones((camera.height, camera.width), bool)
        mask[:: int(rng.integers(7, 13)), : camera.width // 2] = False
        image = Observation(np.zeros(mask.shape, np.float32), mask, camera)
        views.append(
            replace(view_at(LEVEL, image, scene.anchor_centre), expected=CameraPrior(camera, 5.0, 20.0))
        )
    prior = ArticulationPrior(scene.articulations, scene.centres, [1, 2], 0.02)
    numba = select_backend("auto")
    problem = RigidProblem(scene.bodies(4.0), views, [1, 2], groups, scene.anchor_centre, 4.0, numba, prior)
    truth = State.of_poses(_poses(scene, rng, 5, 4), 2)
    for n, view in enumerate(views):
        image = problem.render(truth, n)[0]
        view.static = rng.normal(0, 0.05, image.shape).astype(np.float32)
        view.contrast.noise = rng.uniform(0.01, 0.03, image.shape)
        view.target = view.contrast.normalise(image + view.static, noisy=True).values
        view.weight = (rng.uniform(0, 1, image.shape) * (view.contrast.support > 0)).astype(np.float32)
    return problem


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("groups", [[], [(0,), (1,)], [(0, 1)]], ids=["held", "cameras", "rig"])
@pytest.mark.parametrize("seed", range(2))
def test_cost_and_normal_equations_are_the_problems(scene, seed, groups, device):
    problem = _problem(scene, seed, groups)
    batched = DeviceProblem(problem, TorchBackend(device))
    rng = np.random.default_rng(50 + seed)
    corrections = np.stack([perturbation(rng.normal(0, [0.02] * 3 + [3.0] * 3)) for _ in range(2)])
    state = State(_poses(scene, rng, 6, 5), corrections if groups else np.stack([np.eye(4)] * 2))
    one, other = problem.normal_equations(state), batched.normal_equations(state)
    assert batched.size == problem.size
    assert other.cost == pytest.approx(one.cost, rel=2e-5)
    assert batched.cost(state) == pytest.approx(other.cost, rel=1e-6)
    roots = np.sqrt(np.diag(one.matrix))
    assert (np.abs(other.matrix - one.matrix) / np.outer(roots, roots)).max() < 1e-4
    assert (np.abs(other.gradient - one.gradient) / (roots * np.sqrt(one.cost))).max() < 1e-4


@pytest.mark.parametrize("device", DEVICES)
def test_it_ends_where_the_problem_ends(scene, device):
    problem = _problem(scene, 3, [(0,), (1,)])
    start = State.of_poses(scene.rest_poses, 2)
    one = minimise(problem, start, SolverOptions(8))
    other = minimise(DeviceProblem(problem, TorchBackend(device)), start, SolverOptions(8))
    assert other.cost == pytest.approx(one.cost, rel=1e-3)
    for a, b, centre in zip(one.state.poses, other.state.poses, scene.centres, strict=True):
        around = np.c_[centre + 40 * np.r_[np.eye(3), -np.eye(3)], np.ones(6)]
        assert np.abs(around @ (a - b).T).max() < 0.05


def test_views_that_change_are_seen(scene):
    problem = _problem(scene, 1, [])
    batched, state = DeviceProblem(problem, TorchBackend()), State.of_poses(scene.rest_poses, 2)
    before = batched.cost(state)
    problem.views[0].weight = np.zeros_like(problem.views[0].weight)
    assert batched.cost(state) == pytest.approx(problem.cost(state), rel=2e-5)
    assert batched.cost(state) != pytest.approx(before, rel=1e-3)


def test_a_cpu_solves_the_problem_as_it_is(scene):
    problem = _problem(scene, 0, [])
    assert as_solved(problem) is problem
    problem.backend = TorchBackend("cpu")
    assert as_solved(problem) is problem
