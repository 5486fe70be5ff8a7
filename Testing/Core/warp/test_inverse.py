"""The inverse of a displacement field: compiled and in numpy."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.warp import inverse

AFFINE = np.array([[3, 0, 0, -40], [0, -3, 0, 50], [0, 0, 4, -30], [0, 0, 0, 1.0]])


def smooth_field(seed, size=60.0, shape=(20, 24, 28)) -> DisplacementField:
    rng = np.random.default_rng(seed)
    vectors = np.stack([gaussian_filter(rng.normal(size=shape), 3) for _ in range(3)], axis=-1)
    return DisplacementField((vectors * size).astype(np.float32), AFFINE)


def points_in(field, rng, count=2000) -> np.ndarray:
    index = rng.uniform(-2, np.array(field.shape[::-1]) + 1, (count, 3))
    return index @ field.affine[:3, :3].T + field.affine[:3, 3]


@pytest.mark.parametrize("seed", range(3))
def test_the_round_trip_closes_and_both_ways_agree(seed):
    field, rng = smooth_field(seed), np.random.default_rng(seed)
    points = points_in(field, rng)
    slow, residual = inverse.invert_without_kernel(field, points, 1e-4, 100)
    assert residual.max() < 1e-3 and np.linalg.norm(slow, axis=1).max() > 2
    pytest.importorskip("numba")
    shift, residual = inverse.invert_at(field, points, 1e-4)
    np.testing.assert_allclose(shift, slow, atol=1e-3)
    reached = field(points + shift)
    np.testing.assert_allclose(reached, points, atol=1e-3)
    np.testing.assert_allclose(residual, np.linalg.norm(reached - points, axis=1), atol=1e-5)


def test_where_a_field_folds_the_residual_says_so():
    field = smooth_field(0, size=900.0)
    points = points_in(field, np.random.default_rng(0))
    shift, residual = inverse.invert_at(field, points)
    np.testing.assert_allclose(residual, np.linalg.norm(field(points + shift) - points, axis=1), atol=1e-3)
    assert residual.max() > 1


def test_a_grid_of_one_node_is_a_shift():
    field = DisplacementField(np.full((1, 1, 1, 3), 2.5, np.float32), AFFINE)
    shift, residual = inverse.invert_at(field, np.zeros((4, 3)))
    np.testing.assert_allclose(shift, -2.5)
    assert residual.max() < 1e-6
