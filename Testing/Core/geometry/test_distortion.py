"""Brown's lens model: undone where it was done, refused where it folds the image."""

import numpy as np
import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.distortion import distort, undistorted


@pytest.mark.parametrize("distortion", [(0.12, -0.03, 0.002, -0.001), (-0.2, 0.05, 0.0, 0.001, 0.01)])
def test_undistortion_undoes_distortion(distortion):
    intrinsics = np.array([[260.0, 0, 79.5], [0, 250.0, 59.5], [0, 0, 1]])
    spots = np.array([[30.0, 20.0], [80.0, 60.0], [130.0, 95.0], [120.0, 30.0]])
    ideal = np.column_stack([spots, np.ones(len(spots))]) @ np.linalg.inv(intrinsics).T
    seen = np.column_stack([distort(ideal[:, :2], distortion), np.ones(len(spots))]) @ intrinsics.T
    row, column = np.mgrid[0:120, 0:160]
    image = sum(np.exp(-((column - c) ** 2 + (row - r) ** 2) / 8) for c, r, _ in seen)
    straight, mask = undistorted(image, np.ones(image.shape, bool), intrinsics, distortion)
    for c, r in spots:
        near = np.exp(-((column - c) ** 2 + (row - r) ** 2) / 200) * straight
        assert np.hypot((near * column).sum() / near.sum() - c, (near * row).sum() / near.sum() - r) < 0.3
    assert mask[10:-10, 10:-10].all()


def test_no_distortion_changes_nothing():
    image = np.random.default_rng(0).random((40, 50)).astype(np.float32)
    intrinsics = np.array([[260.0, 0, 24.5], [0, 250.0, 19.5], [0, 0, 1]])
    straight, mask = undistorted(image, np.ones(image.shape, bool), intrinsics, np.zeros(5))
    np.testing.assert_allclose(straight, image, atol=1e-5)
    assert mask.all()


def test_distortion_that_folds_is_refused():
    intrinsics = np.array([[60.0, 0, 24.5], [0, 60.0, 19.5], [0, 0, 1]])
    with pytest.raises(InputError, match="folds"):
        undistorted(np.zeros((40, 50)), np.ones((40, 50), bool), intrinsics, [-9.0, 0, 0, 0])
