"""Projection matrices are taken apart into the camera that they were made of."""

import numpy as np
import pytest
from random_camera import camera

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.projection_matrix import decompose_projection, rows_downward


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("scale", [1.0, -1.0, 3e-4, -250.0])
def test_a_projection_matrix_of_any_scale_and_sign_gives_its_camera(seed, scale):
    true = camera(seed)
    intrinsics, extrinsic = decompose_projection(scale * true.intrinsics @ true.extrinsic[:3])
    np.testing.assert_allclose(intrinsics, true.intrinsics, rtol=1e-8, atol=1e-6)
    np.testing.assert_allclose(extrinsic, true.extrinsic, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_rows_that_count_from_the_bottom_are_turned_round(seed):
    true = camera(seed)
    upward = np.array([[1.0, 0, 0], [0, -1, true.height - 1], [0, 0, 1]])
    matrix = rows_downward(upward @ true.intrinsics @ true.extrinsic[:3], true.height)
    np.testing.assert_allclose(matrix, true.intrinsics @ true.extrinsic[:3], rtol=1e-9, atol=1e-6)


def test_singular_matrices_are_no_cameras():
    with pytest.raises(InputError, match="singular"):
        decompose_projection(np.ones((3, 4)))
