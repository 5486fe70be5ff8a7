"""The soft tissue on torch's device: moved, rendered and fitted as the compiled loops do it."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from chest_phantom import chest
from phantom_study import case
from pretended_gpu import CUDA, gpu_at
from quiet_run import quiet_run

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.bones.joint import JointStage, fit_structures
from PolyPoseLib.registration.fit import device_soft_jacobian, soft_motion
from PolyPoseLib.registration.fit.device_problem import DeviceProblem, as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.soft_jacobian import SoftJacobian
from PolyPoseLib.registration.fit.soft_motion import fit_soft_motion
from PolyPoseLib.registration.fit.soft_products import device_products, products
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.outputs import render_views
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.select import torch_device_of
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.simulation.simulate import arc_angles, view_cameras

pytest.importorskip("numba")
LEVEL = Level(6.0, 40.0, 10)
REACH_MM = 40.0


@pytest.fixture(
    scope="module",
    params=[
        "cpu",
        CUDA,
    ],
)
def backends(request):
    """What compiles, and torch."""
    return NumbaBackend(), TorchBackend(request.param)


@pytest.fixture(scope="module")
def scene() -> Scene:
    ct, structures, _ = chest(spacing=4.0)
    return Scene(ct, structures, "thoracic_spine")


@pytest.fixture(scope="module")
def cameras():
    return view_cameras(chest(spacing=4.0)[0], arc_angles(2, 40.0), 60, detector_mm=430.0)


def run_on(scene: Scene, backend) -> Run:
    soft = SoftTissue(scene, rotation_reach_mm=REACH_MM, device=torch_device_of(backend))
    return Run(soft, backend, Monitor(None, None), "test")


def moved_bones(scene: Scene, rng: np.random.Generator) -> np.ndarray:
    deltas = rng.normal(0, [0.05] * 3 + [3.0] * 3, (len(scene.names), 6))
    deltas[scene.anchor] = 0
    return np.stack([about(perturbation(d), c) for d, c in zip(deltas, scene.centres, strict=True)])


def own_motion(scene: Scene, rng: np.random.Generator) -> np.ndarray:
    modes = quiet_run(scene).soft_tissue.modes
    return 0.4 * rng.normal(size=(modes.count, 3)) * np.sqrt(modes.variances)[:, None]


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    assert found.shape == expected.shape and np.abs(expected).max() > 0
    return np.abs(found - expected).max() / np.abs(expected).max()


@pytest.mark.parametrize("size_mm", [6.0, 3.0])
@pytest.mark.parametrize("seed", range(3))
def test_motion_images_and_derivatives_are_those_of_the_loops(scene, cameras, backends, seed, size_mm):
    rng = np.random.default_rng(seed)
    poses, coefficients = moved_bones(scene, rng), own_motion(scene, rng)
    loops, torches = (run_on(scene, backend).soft_tissue for backend in backends)
    following, other = loops.following(poses), torches.following(poses)
    assert np.abs(other.vectors - following.vectors).max() < 1e-3
    freedom = loops.freedom(following)
    assert np.abs(torches.freedom(following) - freedom).max() < 1e-5
    field = loops.with_motion(coefficients).moved(following, freedom)
    other = torches.with_motion(coefficients).moved(following, freedom)
    assert np.abs(other.vectors - field.vectors).max() < 1e-3
    assert np.abs(field.vectors - following.vectors).max() > 3
    camera, correction = cameras[seed % 2], perturbation(rng.normal(0, [0.03] * 3 + [4.0] * 3))
    image, other = (
        soft.render(field, camera, correction, size_mm, backend)
        for soft, backend in zip((loops, torches), backends, strict=True)
    )
    assert relative(other, image) < 1e-5
    change, other = (
        SoftJacobian(soft, field, freedom, size_mm).of_view(camera, correction) for soft in (loops, torches)
    )
    assert relative(other, change) < 1e-4


def test_parts_of_the_derivative_are_those_of_the_whole(scene, cameras, backends, monkeypatch):
    soft = run_on(scene, backends[1]).soft_tissue
    following = soft.following(scene.rest_poses)
    jacobian = SoftJacobian(soft, following, soft.freedom(following), 6.0)
    whole = jacobian.of_view(cameras[0], np.eye(4))
    monkeypatch.setattr(device_soft_jacobian, "BYTES", {backends[1].device.type: 1 << 17})
    assert relative(jacobian.of_view(cameras[0], np.eye(4)), whole) < 1e-6


@pytest.mark.parametrize("seed", range(3))
def test_products_on_the_device_are_those_of_arrays(scene, cameras, backends, seed):
    rng = np.random.default_rng(seed)
    camera = cameras[seed % 2]
    mask = rng.uniform(size=(camera.height, camera.width)) > 0.1
    image = rng.normal(0, 1, mask.shape).astype(np.float32)
    view = LevelViews(run_on(scene, backends[0]), [Observation(image, mask, camera)], LEVEL).views[0]
    height, width = view.target.shape
    view.static = rng.normal(2, 0.5, (height, width)).astype(np.float32)
    bones = rng.uniform(0, 1, (height, width)).astype(np.float32)
    weight = rng.uniform(0, 1, (height, width)).astype(np.float32)
    changes = rng.normal(0, 0.1, (70, height, width)).astype(np.float32)
    expected = products(view, view.contrast.normalise(view.static + bones), weight, changes)
    on_device = torch.tensor(changes, device=backends[1].device)
    found = device_products(view, bones, weight, on_device)
    assert relative(found.matrix, expected.matrix) < 1e-5
    assert relative(found.gradient, expected.gradient) < 1e-4


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_steps_of_the_fit_end_where_those_of_the_loops_end(scene, cameras, backends, seed, monkeypatch):
    monkeypatch.setattr(soft_motion, "PRIOR", 0.02)
    rng = np.random.default_rng(seed)
    truth, coefficients = run_on(scene, backends[0]), own_motion(scene, rng)
    tissue = truth.soft_tissue.with_motion(coefficients)
    blank = [Observation(np.zeros((60, 60), np.float32), np.ones((60, 60), bool), each) for each in cameras]
    shown = LevelViews(replace(truth, soft_tissue=tissue), blank, Level(3.0, 20.0, 1))
    problem, state = shown.posed_structures(scene.rest_poses)
    observations = [
        replace(each, image=problem.render(state, n)[0], camera=view.camera, mask=view.contrast.mask > 0)
        for n, (each, view) in enumerate(zip(blank, shown.views, strict=True))
    ]
    fields = []
    for backend in backends:
        views = LevelViews(run_on(scene, backend), observations, LEVEL)
        problem, state = views.posed_structures(scene.rest_poses)
        for _ in range(3):
            soft, field = fit_soft_motion(views, problem, state)
            views.run = replace(views.run, soft_tissue=soft)
        fields.append(field.vectors)
    assert np.abs(fields[0]).max() > 2
    assert np.abs(fields[1] - fields[0]).max() < 0.01


@pytest.mark.parametrize(
    "where",
    [
        pytest.param("cpu", marks=pytest.mark.long),
        pytest.param("pretended", marks=pytest.mark.long),
        CUDA,
    ],
)
def test_a_registration_with_soft_motion_ends_where_the_loops_end(where):
    """Bones and soft tissue of a phantom together, in one batch where a GPU is or is pretended."""
    simulated = case(seed=2)
    scene = Scene(simulated.ct, simulated.structures, simulated.anchor)
    observations = [
        Observation(image, np.ones(image.shape, bool), camera)
        for image, camera in zip(simulated.images, simulated.cameras, strict=True)
    ]
    stages = [
        JointStage(Level(8.0, 48.0, 3, 0.01), soft_motion=True, holds_cameras=True),
        JointStage(Level(6.0, 40.0, 3, 0.005), soft_motion=True),
    ]
    poses, motions = [], []
    with gpu_at(where):
        for backend in (NumbaBackend(), TorchBackend("cpu" if where == "cpu" else "cuda")):
            run = run_on(scene, backend)
            fit = fit_structures(run, observations, scene.rest_poses, (), stages)
            poses.append(fit.joint.poses)
            motions.append(fit.soft_tissue.coefficients)
            fitted = replace(run, soft_tissue=fit.soft_tissue)
            assert all(image.any() for image in render_views(fitted, fit.joint.cameras, fit.joint.poses))
            assert isinstance(as_solved(fit.joint.problem), DeviceProblem) == (
                torch_device_of(backend) == torch.device("cuda")
            )
    assert np.abs(motions[0]).max() > 1
    for name, one, other, rest in zip(scene.names, *poses, scene.rest_poses, strict=True):
        points = simulated.ct.to_world(np.argwhere(simulated.structures.mask(name))[::20, ::-1])
        corners = np.c_[points, np.ones(len(points))]
        assert np.linalg.norm(corners @ (other - one).T, axis=1).max() < 0.05
        if name != simulated.anchor:
            assert np.linalg.norm(corners @ (one - rest).T, axis=1).mean() > 1
