"""SE(3) as a group with its exponential, over random motions; scipy is the oracle."""

import numpy as np
import torch
from hypothesis import given
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from strategies import logarithms, motions

from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.rigid import perturbation, require_rigid, rigid_inverse, rotation_vectors

IDENTITY = np.eye(4)


def exp(v: np.ndarray) -> np.ndarray:
    return se3.exp(torch.from_numpy(v)).numpy()


def log(motion: np.ndarray) -> np.ndarray:
    return se3.log(torch.from_numpy(motion)).numpy()


@given(motions(), motions(), motions())
def test_motions_are_a_group(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> None:
    inverse = se3.inverse(torch.from_numpy(a)).numpy()
    np.testing.assert_allclose(a @ inverse, IDENTITY, atol=1e-9)
    np.testing.assert_allclose(inverse @ a, IDENTITY, atol=1e-9)
    np.testing.assert_allclose((a @ b) @ c, a @ (b @ c), atol=1e-9)
    np.testing.assert_allclose(rigid_inverse(a @ b), rigid_inverse(b) @ rigid_inverse(a), atol=1e-9)
    require_rigid(a @ b)


@given(logarithms())
def test_the_exponential_agrees_with_the_matrix_exponential(v: np.ndarray) -> None:
    generator = np.zeros((4, 4))
    generator[:3, :3] = se3.hat(torch.from_numpy(v[:3])).numpy()
    generator[:3, 3] = v[3:]
    np.testing.assert_allclose(exp(v), expm(generator), atol=1e-9)


@given(logarithms(np.pi - 1e-6))
def test_the_logarithm_undoes_the_exponential(v: np.ndarray) -> None:
    np.testing.assert_allclose(log(exp(v)), v, atol=1e-6)


@given(motions())
def test_the_exponential_undoes_the_logarithm(motion: np.ndarray) -> None:
    v = log(motion)
    assert np.linalg.norm(v[:3]) <= np.pi + 1e-12
    np.testing.assert_allclose(exp(v), motion, atol=1e-8)


@given(motions())
def test_the_angle_of_the_logarithm_agrees_with_scipy(motion: np.ndarray) -> None:
    expected = Rotation.from_matrix(motion[:3, :3]).magnitude()
    np.testing.assert_allclose(np.linalg.norm(log(motion)[:3]), expected, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(rotation_vectors(motion[:3, :3])), expected, atol=1e-7)


@given(logarithms())
def test_gradients_are_finite(v: np.ndarray) -> None:
    given_v = torch.from_numpy(v).requires_grad_()
    motion = se3.exp(given_v)
    motion.sum().backward()
    assert given_v.grad is not None and torch.isfinite(given_v.grad).all()
    leaf = motion.detach().requires_grad_()
    se3.log(leaf).sum().backward()
    assert leaf.grad is not None and torch.isfinite(leaf.grad).all()


@given(motions(), logarithms(2.0))
def test_the_adjoint_carries_logarithms_to_another_frame(motion: np.ndarray, v: np.ndarray) -> None:
    moved = se3.adjoint(torch.from_numpy(motion)).numpy() @ v
    np.testing.assert_allclose(exp(moved), motion @ exp(v) @ rigid_inverse(motion), atol=1e-6)


@given(logarithms())
def test_a_perturbation_rotates_and_then_shifts(delta: np.ndarray) -> None:
    motion = perturbation(delta)
    np.testing.assert_allclose(motion[:3, :3], Rotation.from_rotvec(delta[:3]).as_matrix(), atol=1e-12)
    np.testing.assert_array_equal(motion[:3, 3], delta[3:])
