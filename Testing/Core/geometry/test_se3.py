"""SE(3) stated as a group: axioms, round trips and derivatives, with scipy as the oracle."""

import math

import numpy as np
import pytest
import torch
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation
from scipy.special import bernoulli

from PolyPoseLib.geometry import se3

ANGLES = [0.0, 1e-300, 1e-12, 1e-8, 1e-5, 1e-3, 0.05, 0.1, 0.2, 0.499999, 0.500001, 1.0, 2.0, 3.0]
GAPS_TO_PI = [1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-12]
ALL_ANGLES = ANGLES + [np.pi - gap for gap in GAPS_TO_PI]


def vectors(angle, count=16, seed=0):
    """Logarithms of one rotation angle about random axes; every axis direction, coordinate axes included."""
    rng = np.random.default_rng(seed)
    axes = np.concatenate([np.eye(3), -np.eye(3), rng.normal(size=(count, 3))])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return torch.from_numpy(np.concatenate([angle * axes, rng.normal(size=axes.shape) * 40], axis=1))


def motions(seed=0, count=32):
    rng = np.random.default_rng(seed)
    motion = np.tile(np.eye(4), (count, 1, 1))
    motion[:, :3, :3] = Rotation.random(count, random_state=seed).as_matrix()
    motion[:, :3, 3] = rng.normal(size=(count, 3)) * 100
    return torch.from_numpy(motion)


def hat4(v):
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = [[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]
    matrix[:3, 3] = v[3:]
    return matrix


@pytest.mark.parametrize("angle", ALL_ANGLES)
def test_exp_agrees_with_the_matrix_exponential(angle):
    v = vectors(angle)
    expected = np.stack([expm(hat4(row)) for row in v.numpy()])
    np.testing.assert_allclose(se3.exp(v).numpy(), expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("angle", ALL_ANGLES)
def test_rotation_of_log_agrees_with_scipy(angle):
    motion = se3.exp(vectors(angle))
    expected = Rotation.from_matrix(motion[:, :3, :3].numpy()).as_rotvec()
    found = se3.log(motion)[:, :3].numpy()
    if angle > 3:  # beside pi the two signs are almost the same rotation, and scipy may choose the other
        expected *= np.sign((found * expected).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(found, expected, atol=1e-10)


def test_log_agrees_with_the_matrix_logarithm():
    motion = motions()
    for one, v in zip(motion.numpy(), se3.log(motion).numpy(), strict=True):
        np.testing.assert_allclose(hat4(v), np.real(logm(one)), atol=1e-8)


@pytest.mark.parametrize("angle", ALL_ANGLES)
def test_log_undoes_exp(angle):
    v = vectors(angle)
    np.testing.assert_allclose(se3.log(se3.exp(v)).numpy(), v.numpy(), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("gap", [0.0, *GAPS_TO_PI])
def test_exp_undoes_log_on_both_sides_of_pi(gap):
    for angle in (np.pi - gap, np.pi + gap):
        motion = se3.exp(vectors(angle))
        v = se3.log(motion)
        assert v[:, :3].norm(dim=1).max() <= np.pi + 1e-12
        np.testing.assert_allclose(se3.exp(v).numpy(), motion.numpy(), atol=1e-10)


@pytest.mark.parametrize("angle", [0.0, 1e-4, 1e-2, 0.3, 1.0, 3.0, np.pi - 1e-3])
def test_float32_round_trip(angle):
    v = vectors(angle).float()
    found = se3.exp(se3.log(se3.exp(v)))
    np.testing.assert_allclose(found.numpy(), se3.exp(v.double()).numpy(), atol=2e-4)
    assert found.dtype == torch.float32


@pytest.mark.parametrize("seed", range(3))
def test_group_axioms(seed):
    a, b, c = motions(seed), motions(seed + 10), motions(seed + 20)
    identity = torch.eye(4, dtype=torch.float64)
    for product in (se3.inverse(a) @ a, a @ se3.inverse(a)):
        np.testing.assert_allclose(product.numpy(), identity.expand_as(a).numpy(), atol=1e-12)
    np.testing.assert_allclose(
        se3.inverse(a @ b).numpy(), (se3.inverse(b) @ se3.inverse(a)).numpy(), atol=1e-10
    )
    np.testing.assert_allclose(((a @ b) @ c).numpy(), (a @ (b @ c)).numpy(), atol=1e-10)
    rotation = (a @ b)[:, :3, :3]
    np.testing.assert_allclose(
        (rotation @ rotation.mT).numpy(), identity[:3, :3].expand(32, 3, 3), atol=1e-12
    )
    assert torch.linalg.det(rotation).min() > 0.999999


def test_exp_of_zero_is_the_identity_exactly():
    zero = torch.zeros(2, 3, 6, dtype=torch.float64)
    assert torch.equal(se3.exp(zero), torch.eye(4, dtype=torch.float64).expand(2, 3, 4, 4))
    assert torch.equal(se3.log(se3.exp(zero)), zero)


@pytest.mark.parametrize("angle", [0.01, 0.7, 3.0])
def test_negative_vector_is_the_inverse_and_multiples_commute(angle):
    v = vectors(angle)
    np.testing.assert_allclose(se3.exp(-v).numpy(), se3.inverse(se3.exp(v)).numpy(), atol=1e-10)
    np.testing.assert_allclose(
        (se3.exp(0.25 * v) @ se3.exp(0.75 * v)).numpy(), se3.exp(v).numpy(), atol=1e-10
    )


@pytest.mark.parametrize("seed", range(3))
def test_adjoint_moves_a_logarithm(seed):
    motion = motions(seed)
    v = vectors(1.3, count=26, seed=seed)
    moved = (se3.adjoint(motion) @ v[..., None])[..., 0]
    expected = motion @ se3.exp(v) @ se3.inverse(motion)
    np.testing.assert_allclose(se3.exp(moved).numpy(), expected.numpy(), atol=1e-9)


@pytest.mark.parametrize("angle", [*ANGLES, np.pi - 1e-7, np.pi, 4.0, 6.0])
def test_left_jacobian_by_finite_differences(angle):
    v = vectors(angle, count=4) * torch.tensor([1, 1, 1, 0.02, 0.02, 0.02], dtype=torch.float64)
    step = 1e-5
    columns = []
    for axis in torch.eye(6, dtype=torch.float64) * step:
        forward = se3.log(se3.exp(v + axis) @ se3.inverse(se3.exp(v)))
        backward = se3.log(se3.exp(v - axis) @ se3.inverse(se3.exp(v)))
        columns.append((forward - backward) / (2 * step))
    np.testing.assert_allclose(se3.left_jacobian(v).numpy(), torch.stack(columns, -1).numpy(), atol=1e-8)


def test_left_jacobian_is_continuous_where_the_series_ends():
    below, above = vectors(0.5 - 1e-13), vectors(0.5 + 1e-13)
    np.testing.assert_allclose(se3.left_jacobian(below), se3.left_jacobian(above), atol=1e-10)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.4999, 0.5001, 2.0, np.pi, 5.0])
def test_gradcheck_of_exp_and_left_jacobian(angle):
    v = vectors(angle, count=1)[4:].clone().requires_grad_()
    assert torch.autograd.gradcheck(se3.exp, (v,))
    assert torch.autograd.gradcheck(se3.left_jacobian, (v,))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.19, 0.21, 0.4999, 0.5001, 2.0, 3.1, np.pi - 1e-4])
def test_gradcheck_of_log(angle):
    motion = se3.exp(vectors(angle, count=1)[4:]).clone().requires_grad_()
    assert torch.autograd.gradcheck(se3.log, (motion,))


@pytest.mark.parametrize("angle", ALL_ANGLES)
def test_gradient_of_a_round_trip_is_the_identity(angle):
    v = vectors(angle, count=2)

    def round_trip(row):
        return se3.log(se3.exp(row))

    for row in v:
        jacobian = torch.autograd.functional.jacobian(round_trip, row)
        np.testing.assert_allclose(jacobian.numpy(), np.eye(6), atol=1e-6)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_gradients_are_finite_at_zero_and_pi(dtype):
    for angle in (0.0, np.pi):
        v = vectors(angle).to(dtype).requires_grad_()
        se3.exp(v).square().sum().backward()
        motion = se3.exp(v.detach()).requires_grad_()
        se3.log(motion).square().sum().backward()
        assert torch.isfinite(v.grad).all()
        assert torch.isfinite(motion.grad).all()


def test_coefficients_of_the_cotangent_are_bernoulli_numbers():
    even = np.abs(bernoulli(16)[2::2])
    expected = even / np.array([float(math.factorial(2 * n)) for n in range(1, 9)])
    np.testing.assert_allclose(se3._COTANGENT, expected, rtol=1e-10)


def test_second_derivatives_are_right():
    v = vectors(0.3, count=1)[5:].clone().requires_grad_()
    assert torch.autograd.gradgradcheck(se3.exp, (v,))


@pytest.mark.parametrize("batch", [(), (1,), (2, 3), (0,)])
def test_batch_shapes(batch):
    v = torch.zeros(*batch, 6)
    assert se3.exp(v).shape == (*batch, 4, 4)
    assert se3.log(se3.exp(v)).shape == (*batch, 6)
    assert se3.inverse(se3.exp(v)).shape == (*batch, 4, 4)
    assert se3.left_jacobian(v).shape == (*batch, 6, 6)


def test_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match="6"):
        se3.exp(torch.zeros(5))
    with pytest.raises(ValueError, match="4, 4"):
        se3.log(torch.zeros(3, 4))
    with pytest.raises(ValueError, match="floating"):
        se3.exp(torch.zeros(6, dtype=torch.int64))
