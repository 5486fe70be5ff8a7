"""Small rotations in numpy agree with scipy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.rigid import (
    about,
    perturbation,
    perturbation_between,
    rotation_matrix,
    rotation_vectors,
)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-8, 1e-4, 0.1, 1.0, 1.5, 2.5, np.pi - 1e-6, np.pi])
def test_rotations_agree_with_scipy(size):
    rng = np.random.default_rng(0)
    vectors = rng.normal(size=(20, 3))
    vectors *= size / np.linalg.norm(vectors, axis=1, keepdims=True)
    expected = Rotation.from_rotvec(vectors)
    found = np.stack([rotation_matrix(vector) for vector in vectors])
    np.testing.assert_allclose(found, expected.as_matrix(), atol=1e-14)
    back = Rotation.from_rotvec(rotation_vectors(found)).inv() * expected
    assert back.magnitude().max() < 1e-9
    if size < 3:
        np.testing.assert_allclose(rotation_vectors(found), vectors, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("size", [0.5, 1.5])
def test_any_leading_shape(size):
    rotations = Rotation.from_rotvec(np.random.default_rng(1).normal(0, size, (6, 3))).as_matrix()
    found = rotation_vectors(rotations.reshape(2, 3, 3, 3))
    np.testing.assert_allclose(found.reshape(6, 3), Rotation.from_matrix(rotations).as_rotvec(), atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_the_perturbation_between_two_poses_leads_from_one_to_the_other(seed):
    rng = np.random.default_rng(seed)
    centre = rng.normal(0, 100, 3)
    delta = np.r_[rng.normal(0, 0.6, 3), rng.normal(0, 20, 3)]
    first = about(perturbation(np.r_[rng.normal(0, 1, 3), rng.normal(0, 50, 3)]), rng.normal(0, 100, 3))
    second = about(perturbation(delta), centre) @ first
    np.testing.assert_allclose(perturbation_between(first, second, centre), delta, atol=1e-9)
