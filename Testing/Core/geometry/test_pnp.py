"""Landmarks give back the camera that made them; sets that cannot are refused in a sentence."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix
from PolyPoseLib.geometry.pnp import camera_from_landmarks


def random_camera(rng):
    rotation = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = rotation
    extrinsic[:3, 3] = [*rng.uniform(-40, 40, 2), rng.uniform(550, 950)]
    return Camera(intrinsics_matrix(1020, 0.4, 1000, 1000), extrinsic, 1000, 1000)


def reprojection(true, found, points):
    error = np.linalg.norm(true.project(points) - found.project(points), axis=1)
    return (error * true.depth(points) / true.intrinsics[0, 0]).mean()


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("count", [4, 6, 12])
def test_exact_landmarks_give_the_exact_camera(seed, count):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    points = rng.uniform(-100, 100, (count, 3))
    found = camera_from_landmarks(points, camera.project(points), camera)
    assert found.rms_mm < 1e-4
    assert found.inliers.all()
    if count > 4:
        np.testing.assert_allclose(found.camera.extrinsic, camera.extrinsic, atol=1e-3)


@pytest.mark.parametrize("seed", range(8))
def test_outliers_are_named_and_do_no_harm(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    points = rng.uniform(-100, 100, (10, 3))
    pixels = camera.project(points) + rng.normal(0, 1.0, (10, 2))
    wrong = rng.choice(10, 3, replace=False)
    turn = rng.uniform(0, 2 * np.pi, 3)
    pixels[wrong] += 120 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    found = camera_from_landmarks(points, pixels, camera)
    assert not found.inliers[wrong].any()
    assert found.inliers.sum() >= 6
    assert reprojection(camera, found.camera, points) < 2


@pytest.mark.parametrize("seed", range(6))
def test_flat_sets_work(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    frame = Rotation.random(random_state=seed).as_matrix()
    points = np.column_stack([rng.uniform(-100, 100, (8, 2)), np.zeros(8)]) @ frame.T
    pixels = camera.project(points)
    if np.abs((camera.extrinsic[:3, :3] @ frame)[2, 2]) < 0.2:
        pytest.skip("the plane is seen from its edge")
    found = camera_from_landmarks(points, pixels, camera)
    assert found.rms_mm < 1e-3
    np.testing.assert_allclose(found.camera.extrinsic, camera.extrinsic, atol=1e-2)


def test_the_covariance_tells_the_spread_of_repeated_clicks():
    rng = np.random.default_rng(3)
    camera = random_camera(rng)
    points = rng.uniform(-100, 100, (8, 3))
    depth = camera.extrinsic[2, :3] @ points.mean(axis=0) + camera.extrinsic[2, 3]
    noise_px = 1.5 / depth * camera.intrinsics[0, 0]
    turns, stated = [], []
    for _ in range(25):
        found = camera_from_landmarks(
            points, camera.project(points) + rng.normal(0, noise_px, (8, 2)), camera
        )
        difference = found.camera.extrinsic[:3, :3] @ camera.extrinsic[:3, :3].T
        turns.append(Rotation.from_matrix(difference).as_rotvec())
        stated.append(np.sqrt(np.diag(found.covariance)[:3]))
    ratio = np.std(turns, axis=0) / np.mean(stated, axis=0)
    assert ((ratio > 0.5) & (ratio < 1.8)).all()


@pytest.mark.parametrize(
    ("points", "pixels", "reason"),
    [
        (np.eye(3), np.eye(3)[:, :2], "at least 4"),
        (np.zeros((5, 3)), np.random.default_rng(0).uniform(0, 99, (5, 2)), "one place"),
        (np.outer(np.arange(5), [20.0, 10, 5]), np.random.default_rng(0).uniform(0, 99, (5, 2)), "one line"),
        (np.random.default_rng(0).uniform(-90, 90, (5, 3)), np.zeros((5, 2)), "one place"),
        (np.random.default_rng(0).uniform(-90, 90, (5, 3)), np.outer(np.arange(5), [9.0, 3]), "one line"),
        (np.random.default_rng(0).uniform(-90, 90, (5, 3)), np.zeros((4, 2)), "as many"),
        (np.full((5, 3), np.nan), np.random.default_rng(0).uniform(0, 99, (5, 2)), "finite"),
        ("x", [], "numbers"),
    ],
)
def test_hopeless_sets_are_refused(points, pixels, reason):
    camera = random_camera(np.random.default_rng(0))
    with pytest.raises(InputError, match=reason):
        camera_from_landmarks(points, pixels, camera)


def test_landmarks_that_contradict_each_other_are_refused():
    rng = np.random.default_rng(1)
    camera = random_camera(rng)
    points = rng.uniform(-100, 100, (6, 3))
    with pytest.raises(InputError, match="no 4 landmarks agree"):
        camera_from_landmarks(points, rng.uniform(0, 1000, (6, 2)), camera)
