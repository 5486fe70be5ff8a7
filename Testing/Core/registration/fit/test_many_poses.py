"""One bone at many poses at once: the same costs, normal equations and minima as pose by pose."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import phantom

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import ArticulationPrior
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.lockstep import minimise_together
from PolyPoseLib.registration.fit.many_poses import at_many_poses
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.views import problem_of_one_bone
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.rigid import project_body
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.simulation.simulate import view_cameras

LEVEL = Level(4.0, 24.0, 10)


@pytest.fixture(scope="module")
def scene() -> Scene:
    ct, structures = phantom()
    return Scene(ct, structures, "pelvis")


def _pose(rng: np.random.Generator, centre: np.ndarray, degrees: float, mm: float) -> np.ndarray:
    return about(perturbation(np.r_[rng.normal(0, np.radians(degrees), 3), rng.normal(0, mm, 3)]), centre)


def _bone(scene: Scene, seed: int, kernel: str = "auto") -> RigidProblem:
    """A moved bone in front of noisy views of the others, masked and weighted at random, held by its joints."""
    rng = np.random.default_rng(seed)
    ct, _ = phantom()
    cameras = view_cameras(ct, (0.0, 60.0), 120, detector_mm=330.0)
    views = []
    for camera in cameras:
        mask = np.ones((120, 120), bool)
        mask[rng.integers(0, 90) :][:20, rng.integers(0, 90) :][:, :15] = False
        blank = Observation(np.zeros((120, 120), np.float32), mask, camera)
        views.append(view_at(LEVEL, blank, scene.anchor_centre))
    prior = ArticulationPrior(scene.articulations, scene.centres, [1, 2], 0.02)
    problem = RigidProblem(
        scene.bodies(4.0), views, [1, 2], [], scene.anchor_centre, 4.0, select_backend(kernel), prior
    )
    poses = np.stack([np.eye(4), *(_pose(rng, scene.centres[k], 5, 4) for k in range(1, len(scene.names)))])
    state = State.of_poses(poses, 2)
    for n, view in enumerate(views):
        image = problem.render(state, n)[0]
        image = image + rng.normal(0, 0.02, image.shape).astype(np.float32)
        view.contrast.noise = rng.uniform(0.01, 0.03, image.shape)
        view.target = view.contrast.normalise(image, noisy=True).values
        view.weight = (rng.uniform(0, 1, image.shape) * (view.contrast.support > 0)).astype(np.float32)
        views[n] = replace(view, static=problem.render_without(1, state, n))
    alone = problem_of_one_bone(problem, state, 1, views)
    assert alone is not None
    return alone


def _starts(scene: Scene, seed: int, count: int) -> np.ndarray:
    """Poses near and far, one of them outside of both images, and one behind the sources."""
    rng = np.random.default_rng(100 + seed)
    starts = [_pose(rng, scene.centres[1], 8, 10) for _ in range(count)]
    starts[1] = perturbation(np.r_[np.zeros(3), 600.0, 0.0, 900.0])
    starts[2] = perturbation(np.r_[np.zeros(3), 0.0, 1500.0, 0.0])
    return np.stack(starts)


@pytest.mark.parametrize("kernel", ["auto", "torch"])
@pytest.mark.parametrize("seed", range(4))
def test_costs_and_normal_equations_are_those_of_each_pose(scene: Scene, seed: int, kernel: str) -> None:
    alone = _bone(scene, seed, kernel)
    starts = _starts(scene, seed, 6)
    many = at_many_poses(alone)
    normals = many.normal_equations(starts)
    np.testing.assert_allclose(many.costs(starts), normals.costs, rtol=1e-6)
    for n, start in enumerate(starts):
        one = alone.normal_equations(State.of_poses(start[None], len(alone.views)))
        np.testing.assert_allclose(normals.costs[n], one.cost, rtol=2e-5)
        scale = np.sqrt(np.outer(np.diag(one.matrix), np.diag(one.matrix))) + 1e-12
        assert (np.abs(normals.matrices[n] - one.matrix) / scale).max() < 1e-4
        roots = np.sqrt(np.diag(one.matrix) * one.cost) + 1e-12
        assert (np.abs(normals.gradients[n] - one.gradient) / roots).max() < 1e-4


@pytest.mark.parametrize("seed", range(3))
def test_every_start_ends_where_it_ends_alone(scene: Scene, seed: int) -> None:
    alone = _bone(scene, seed)
    starts = _starts(scene, seed, 6)
    options = SolverOptions(8)
    poses, costs = minimise_together(at_many_poses(alone), starts, options)
    for n, start in enumerate(starts):
        one = minimise(alone, State.of_poses(start[None], len(alone.views)), options)
        np.testing.assert_allclose(costs[n], one.cost, rtol=1e-3)
        body = alone.bodies[0]
        apart = body.corners @ (np.linalg.inv(poses[n]) - np.linalg.inv(one.state.poses[0]))[:3, :3].T
        if n not in (1, 2):  # what no X-ray shows goes where its joints let it
            assert np.abs(apart).max() < 0.5


def test_images_are_those_of_the_body(scene: Scene) -> None:
    pytest.importorskip("numba")
    from PolyPoseLib.rendering.pose_images import project_poses

    ct, _ = phantom()
    camera = view_cameras(ct, (30.0,), 90, detector_mm=330.0)[0]
    body, backend = scene.bodies(4.0)[1], select_backend("numba")
    starts = _starts(scene, 7, 8)
    shown = project_poses(body, camera, starts, 4.0, True)
    plain = project_poses(body, camera, starts, 4.0)
    np.testing.assert_array_equal(plain.images, project_poses(body, camera, starts, 4.0).images)
    for n, start in enumerate(starts):
        one = project_body(body, camera, start, 4.0, backend, True)
        whole, jacobian = np.zeros((90, 90), np.float32), np.zeros((6, 90, 90), np.float32)
        assert tuple(shown.windows[n]) == one.window
        whole[one.slices] = one.image
        jacobian[(slice(None), *one.slices)] = one.jacobian
        np.testing.assert_allclose(shown.images[n], whole, atol=1e-5)
        np.testing.assert_allclose(plain.images[n], whole, atol=1e-5)
        assert shown.jacobians is not None
        np.testing.assert_allclose(shown.jacobians[n], jacobian, atol=1e-4 * max(np.abs(jacobian).max(), 1))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_poses_that_are_not_finite_are_refused(scene: Scene, value: float) -> None:
    pytest.importorskip("numba")
    from PolyPoseLib.rendering.pose_images import project_poses

    ct, _ = phantom()
    camera = view_cameras(ct, (30.0,), 90, detector_mm=330.0)[0]
    poses = _starts(scene, 3, 4)
    poses[1, 0, 3] = value
    with pytest.raises(ValueError, match="not finite"):
        project_poses(scene.bodies(4.0)[1], camera, poses, 4.0)
