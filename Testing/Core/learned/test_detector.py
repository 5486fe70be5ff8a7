"""The virtual detector sees what a real one of its field would, however fine its pixels and whichever way it turns."""

import learned_phantom
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.network_input import LARGEST, network_input
from PolyPoseLib.learned.posed_scene import PosedScene, random_posture
from PolyPoseLib.learned.randomise import randomised
from PolyPoseLib.learned.view_range import ViewRange
from PolyPoseLib.rendering.select import select_backend

RANGE = ViewRange(("AP",), 735.0)
BACKEND = select_backend(threads=1)


@pytest.fixture(scope="module")
def posed():
    return PosedScene.of(learned_phantom.scene(), 6.0)


def still(posed, camera):
    poses = np.stack([np.eye(4)] * 2)
    return posed.render(camera, poses, np.ones(3), np.eye(4), BACKEND)


@pytest.mark.parametrize(
    ("rows", "columns", "width_mm"), [(60, 60, 300.0), (240, 200, 250.0), (333, 401, 300.0)]
)
def test_xrays_of_any_pixels_look_the_same(posed, rows, columns, width_mm):
    _, extrinsic = RANGE.draw(np.random.default_rng(rows), posed.centre)
    intrinsics = intrinsics_matrix(1000.0, width_mm / columns, rows, columns)
    image = still(posed, Camera(intrinsics, extrinsic, rows, columns))
    detector = VirtualDetector(40, 0.15)
    seen, known = detector.resampled(image, np.ones(image.shape, bool), intrinsics)
    expected = still(posed, detector.camera(extrinsic))
    assert known.mean() > 0.6
    apart = np.abs(seen - expected)[known]
    assert apart.mean() < 0.03 * np.ptp(expected)


def test_it_is_as_large_as_the_largest_field():
    xray = learned_phantom.xray()
    assert VirtualDetector.around([xray], 64).half_tangent == pytest.approx(0.15)
    with pytest.raises(InputError):
        VirtualDetector(8, 0.2)


def test_turning_the_image_is_turning_the_camera(posed):
    detector = VirtualDetector(96, 0.25)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        _, extrinsic = RANGE.draw(rng, posed.centre)
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(rng.uniform(-1, 1, 3) * (0.06, 0.06, 0.15)).as_matrix()
        turned, known = detector.rotated(still(posed, detector.camera(extrinsic)), turn[:3, :3])
        expected = still(posed, detector.camera(turn @ extrinsic))
        assert known.mean() > 0.5
        assert np.abs(turned - expected)[known].mean() < 0.02 * np.ptp(expected)


def test_the_input_does_not_depend_on_gain_and_offset(posed):
    detector = VirtualDetector(64, 0.2)
    image = still(posed, detector.camera(RANGE.draw(np.random.default_rng(5), posed.centre)[1]))
    mask = np.zeros(image.shape, bool)
    mask[5:60, 8:50] = True
    first = network_input(image, mask, detector, 735.0)
    second = network_input(3.0 * image + 7.0, mask, detector, 735.0)
    np.testing.assert_allclose(first, second, atol=1e-3)
    assert not first[:, ~mask].any() and np.abs(first).max() <= LARGEST
    assert not network_input(image, np.zeros_like(mask), detector, 735.0).any()


def test_randomised_images_are_finite_differ_and_keep_to_the_mask(posed):
    detector = VirtualDetector(64, 0.2)
    image = still(posed, detector.camera(RANGE.draw(np.random.default_rng(6), posed.centre)[1]))
    mask = np.ones(image.shape, bool)
    mask[:, :10] = False
    rng = np.random.default_rng(0)
    drawn = [randomised(image, mask, rng) for _ in range(30)]
    assert all(np.isfinite(each).all() and not known[:, :10].any() for each, known in drawn)
    assert all(known.any() for _, known in drawn)
    shares = [known.mean() for _, known in drawn]
    assert min(shares) < 0.6 < 0.8 < max(shares)
    apart = [np.abs(drawn[0][0] - each).mean() for each, _ in drawn[1:]]
    assert min(apart) > 0


def test_the_anchor_rests_and_carried_bones_follow():
    chain = ((1, 0, np.zeros(3)), (2, 1, np.array([0, 0, 50.0])))
    rng = np.random.default_rng(0)
    for _ in range(20):
        poses = random_posture(chain, 3, rng)
        np.testing.assert_array_equal(poses[0], np.eye(4))
        forward = np.linalg.inv(poses)
        joint = np.array([0, 0, 50.0, 1])
        apart = np.linalg.norm((forward[1] - forward[2]) @ joint)
        assert apart < 15 < np.linalg.norm((forward[2] - np.eye(4)) @ np.array([0, 0, 400.0, 1])) + 15
        assert not np.allclose(forward[1], forward[2])
