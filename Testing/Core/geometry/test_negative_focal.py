"""Negative focal lengths: the camera that comes out projects every point where the one that was given did."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.distortion import distort, with_positive_axes
from PolyPoseLib.geometry.negative_focal import has_negative_focal, positive_camera, require_signed_intrinsics

WIDTH = 300


def camera(seed, signs, toward):
    """K with these signs, an extrinsic whose patient has this sign of depth, and points (N, 3) of that patient."""
    rng = np.random.default_rng(seed)
    intrinsics = np.array([[signs[0] * 2000.0, 7.0, 140.0], [0, signs[1] * 2100.0, 90.0], [0, 0, 1]])
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    extrinsic[:3, 3] = *rng.uniform(-50, 50, 2), toward * rng.uniform(600, 900)
    return intrinsics, extrinsic, rng.uniform(-100, 100, (50, 3))


def projected(intrinsics, extrinsic, points):
    """Homogeneous pixels (N, 2), whatever the sign of the depth, and the depths."""
    seen = points @ extrinsic[:3, :3].T + extrinsic[:3, 3]
    image = seen @ intrinsics.T
    return image[:, :2] / image[:, 2:], seen[:, 2]


@pytest.mark.parametrize("toward", [1, -1])
@pytest.mark.parametrize("signs", [(-1, -1), (-1, 1), (1, -1)])
def test_every_point_keeps_its_pixel_and_lies_before_the_source(signs, toward):
    for seed in range(5):
        given, pose, points = camera(seed, signs, toward)
        intrinsics, extrinsic, mirrored = positive_camera(given, pose)
        wanted, _ = projected(given, pose, points)
        if mirrored:  # the extrinsic belongs to the image with its columns reversed
            intrinsics = intrinsics.copy()
            intrinsics[0, 2], intrinsics[0, 1] = WIDTH - 1 - intrinsics[0, 2], -intrinsics[0, 1]
            wanted = wanted * (-1, 1) + (WIDTH - 1, 0)
        found, depth = projected(intrinsics, extrinsic, points)
        np.testing.assert_allclose(found, wanted, atol=1e-9)
        assert (depth > 0).all() and intrinsics[0, 0] > 0 and intrinsics[1, 1] > 0
        assert np.linalg.det(extrinsic[:3, :3]) == pytest.approx(1)
        assert mirrored == (signs[0] * signs[1] * toward < 0)


@pytest.mark.parametrize("signs", [(-1, -1), (-1, 1), (1, -1)])
def test_distortion_follows_the_axes(signs):
    intrinsics, _, points = camera(0, signs, 1)
    given = (0.1, -0.02, 0.004, -0.003, 0.01)
    ideal = points[:, :2] / 300
    turned = with_positive_axes(given, intrinsics)
    np.testing.assert_allclose(distort(ideal * signs, turned), distort(ideal, given) * signs, atol=1e-12)


def test_without_an_extrinsic_nothing_follows_about_the_side():
    given, _, _ = camera(0, (-1, -1), 1)
    intrinsics, extrinsic, mirrored = positive_camera(given, None)
    assert (intrinsics[0, 0], intrinsics[1, 1]) == (2000, 2100) and extrinsic is None and mirrored is None


def test_other_faults_of_intrinsics_are_still_refused():
    assert not has_negative_focal("no") and not has_negative_focal([[1, 2], [3]])
    for wrong in ([[-1, 0, 0], [1, -1, 0], [0, 0, 1]], [[-1, 0, 0], [0, -1, 0], [0, 0, -1]], [[0, 0, 0]] * 3):
        with pytest.raises(InputError, match="K"):
            require_signed_intrinsics(wrong, "K")
    pose = np.eye(4)
    with pytest.raises(InputError, match="z translation is 0"):
        positive_camera(np.diag([-1000.0, -1000.0, 1.0]), pose)
