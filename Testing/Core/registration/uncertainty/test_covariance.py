"""Intervals where the images say little: views without moving bones, bones without views, opposite directions."""

import numpy as np
import pytest
from phantom_study import phantom

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import perturbation
from PolyPoseLib.registration.fit.levels import Level, Observation, view_at
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.covariance import (
    UNSEEN_TRANSLATION_MM,
    PoseUncertainty,
    joint_covariance,
    pose_uncertainties,
)
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.simulation.simulate import view_cameras

LEVEL = Level(4.0, 24.0, 10)
REST = State(np.stack([np.eye(4)] * 3), np.stack([np.eye(4)] * 2))


@pytest.fixture(scope="module")
def scene() -> Scene:
    ct, structures = phantom()
    return Scene(ct, structures, "pelvis")


def problem_of(scene: Scene, cameras: list[Camera], noise: float, bodies=None) -> RigidProblem:
    """Views of the bones at rest with noise in their normalised images, everywhere of equal weight."""
    rng = np.random.default_rng(4)
    blank = [Observation(np.zeros((120, 120), np.float32), np.ones((120, 120), bool), c) for c in cameras]
    views = [view_at(LEVEL, each, scene.anchor_centre) for each in blank]
    problem = RigidProblem(
        bodies or scene.bodies(4.0), views, [1, 2], [], scene.anchor_centre, 4.0, select_backend()
    )
    for n, view in enumerate(views):
        rendered = view.contrast.normalise(problem.render(REST, n)[0]).values
        view.target = rendered + rng.normal(0, noise, rendered.shape).astype(np.float32)
        view.weight = np.ones(rendered.shape, np.float32)
    return problem


def uncertainties_of(problem: RigidProblem) -> dict[int, PoseUncertainty]:
    return pose_uncertainties(problem, joint_covariance(problem, REST))


def two_cameras() -> list[Camera]:
    return view_cameras(phantom()[0], (0.0, 60.0), 120, detector_mm=330.0)


def test_a_view_that_shows_no_moving_bone_adds_nothing(scene: Scene) -> None:
    cameras = two_cameras()
    aside = perturbation(np.r_[np.zeros(3), 600.0, 0, 0])
    beside = [cameras[0].with_extrinsic(aside @ cameras[0].extrinsic), cameras[1]]
    both = uncertainties_of(problem_of(scene, beside, 0.1))
    for uncertainty in both.values():
        assert np.isfinite(uncertainty.covariance).all()
        assert np.linalg.eigvalsh(uncertainty.covariance).min() > 0


def test_images_without_any_noise_leave_the_systematic_part(scene: Scene) -> None:
    for uncertainty in uncertainties_of(problem_of(scene, two_cameras(), 0.0)).values():
        deviations = np.sqrt(np.diag(uncertainty.covariance))
        assert np.isfinite(deviations).all() and deviations[3:].max() < 1.0


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_bone_that_is_nowhere_gets_the_interval_of_an_unseen_one(scene: Scene, noise: float) -> None:
    bodies = list(scene.bodies(4.0))
    empty = bodies[2].__class__(np.zeros_like(bodies[2].voxels), bodies[2].affine, bodies[2].centre)
    uncertainties = uncertainties_of(problem_of(scene, two_cameras(), noise, [*bodies[:2], empty]))
    shifts = np.sqrt(np.diag(uncertainties[2].covariance))[3:]
    np.testing.assert_allclose(shifts, UNSEEN_TRANSLATION_MM, rtol=0.01)
    assert np.sqrt(np.diag(uncertainties[1].covariance))[3:].max() < 5


@pytest.mark.parametrize("seed", range(6))
def test_opposite_views_have_their_axis_in_common(seed: int) -> None:
    """10 mm along the beam and 1 mm across it, whichever side the X-ray was taken from."""
    rng = np.random.default_rng(seed)
    first, second = view_cameras(phantom()[0], (0.0, rng.uniform(165, 195)), 120, detector_mm=330.0)
    axis = first.extrinsic[2, :3]
    covariance = np.eye(6) * 1e-6
    covariance[3:, 3:] = np.eye(3) + 99 * np.outer(axis, axis)
    for cameras in ([first, second], [second, first], [first], [second]):
        stated = PoseUncertainty(covariance).to_dict(cameras, np.eye(4), np.zeros(3))
        assert stated["along_mm"] > 1.9 * 9
        assert max(stated["across_mm"]) < 1.96 * 3.5
        assert PoseUncertainty(covariance).across_mm(cameras, np.eye(4), np.zeros(3)) == max(
            stated["across_mm"]
        )
        assert np.isfinite(stated["rotation_across_deg"]).all()


@pytest.mark.parametrize("seed", range(6))
def test_how_wide_an_interval_across_the_beam_is_does_not_depend_on_the_axes(seed: int) -> None:
    """7 mm in any direction across one beam, which lies anyhow, and nothing else but 1 mm along it."""
    rng = np.random.default_rng(seed)
    (camera,) = view_cameras(phantom()[0], (0.0,), 120, detector_mm=330.0)
    axis = camera.extrinsic[2, :3]
    across = np.cross(axis, rng.normal(size=3))
    across /= np.linalg.norm(across)
    pose = perturbation(rng.normal(size=6) * np.r_[np.full(3, 0.5), np.full(3, 9.0)])
    inside = pose[:3, :3] @ np.stack([across, axis], axis=1)
    covariance = np.eye(6)
    covariance[3:, 3:] = inside @ np.diag([49.0, 1.0]) @ inside.T
    centre = (pose @ np.append(camera.source + 700.0 * axis, 1.0))[:3]
    found = PoseUncertainty(covariance).across_mm([camera], pose, centre)
    np.testing.assert_allclose(found, 1.96 * 7.0, rtol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_points_are_as_uncertain_as_drawn_poses_scatter_them(seed: int) -> None:
    """Turns count with their lever; small ones, so that the scatter is the linear one."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(6, 6)) * np.r_[np.full(3, 0.004), np.full(3, 0.3)][:, None]
    offsets = rng.normal(size=(40, 3)) * rng.uniform(5.0, 80.0, 3)
    drawn = (perturbation(each) for each in rng.normal(size=(4000, 6)) @ root.T)
    moved = np.stack([offsets @ each[:3, :3].T + each[:3, 3] - offsets for each in drawn])
    scatter = np.mean([point.T @ point / len(point) for point in moved.transpose(1, 0, 2)], axis=0)
    widest = 1.96 * np.sqrt(np.linalg.eigvalsh(scatter)[-1])
    uncertainty = PoseUncertainty(root @ root.T)
    assert uncertainty.of_points_mm(offsets) == pytest.approx(widest, rel=0.06)
    assert uncertainty.of_points_mm(np.zeros((1, 3))) == pytest.approx(uncertainty.widest_mm)
