"""Rigid motions SE(3) and their logarithms se(3), batched and differentiable in torch.

A logarithm is v = [w, u]: rotation vector w (3, rad) first, then u (3, mm). Every function takes any leading
batch shape, keeps the dtype and device of its input, and has finite gradients everywhere, 0 and pi included.
Formulas: T. Barfoot, "State Estimation for Robotics", 2017, chapter 7; the coefficients of W and W^2 are
written as functions of the squared angle, by their power series where the closed form loses digits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import comb, factorial

import torch
from torch import Tensor

_SERIES_BELOW = 0.25  # squared angle, rad^2; above it the closed forms keep 12 digits
_TERMS = 8
_SINC = [(-1) ** n / factorial(2 * n + 1) for n in range(_TERMS)]
_VERSINE = [(-1) ** n / factorial(2 * n + 2) for n in range(_TERMS)]
_CUBIC = [(-1) ** n / factorial(2 * n + 3) for n in range(_TERMS)]
_QUARTIC = [(-1) ** n / factorial(2 * n + 4) for n in range(_TERMS)]
_QUINTIC = [(-1) ** n * (n + 1) / factorial(2 * n + 5) for n in range(_TERMS)]
# |B_2n| / (2n)! for n = 1..8, the expansion of the cotangent
_COTANGENT = [
    1 / 12,
    1 / 720,
    1 / 30240,
    1 / 1209600,
    1 / 47900160,
    691 / 1307674368000,
    1 / 74724249600,
    3617 / 10670622842880000,
]
_ARCSINE_BELOW = 0.01  # squared sine of half the angle
_ARCSINE = [comb(2 * n, n) / (4**n * (2 * n + 1)) for n in range(_TERMS)]


def exp(v: Tensor) -> Tensor:
    """Exponential of se(3): the rigid motion whose logarithm is v.

    Parameters
    ----------
    v : (..., 6) Tensor
        [rotation (3) rad, translation part (3) mm].

    Returns
    -------
    (..., 4, 4) Tensor
        R = I + sin t/t W + (1 - cos t)/t^2 W^2, and the translation (I + (1 - cos t)/t^2 W + (t - sin t)/t^3 W^2) u
        with t = |w|.

    Raises
    ------
    ValueError
        The last dimension is not 6.

    References
    ----------
    T. Barfoot, "State Estimation for Robotics", 2017, eq. 7.16 and 7.37.

    """
    _require_last(v, (6,), "v")
    rotation, translation = v[..., :3], v[..., 3:]
    squared = (rotation * rotation).sum(-1)[..., None, None]
    skew = hat(rotation)
    skew2 = skew @ skew
    identity = torch.eye(3, dtype=v.dtype, device=v.device)
    versine = _versine(squared)
    top = torch.cat(
        [
            identity + _sinc(squared) * skew + versine * skew2,
            (identity + versine * skew + _cubic(squared) * skew2) @ translation[..., None],
        ],
        dim=-1,
    )
    return torch.cat([top, _last_row(top)], dim=-2)


def log(motion: Tensor) -> Tensor:
    """Logarithm of rigid motions, the inverse of exp for angles up to pi.

    The rotation goes through its unit quaternion, taken from the row of largest diagonal, which loses no digits
    near pi.

    Parameters
    ----------
    motion : (..., 4, 4) Tensor
        Rigid; translation in mm.

    Returns
    -------
    (..., 6) Tensor
        [rotation (3) rad of norm <= pi, translation part (3) mm]. At exactly pi both signs of the rotation vector
        are logarithms; one of them is returned.

    Raises
    ------
    ValueError
        The last dimensions are not 4 x 4.

    References
    ----------
    S. Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1978.

    """
    _require_last(motion, (4, 4), "motion")
    rotation = _rotation_vector(motion[..., :3, :3])
    squared = (rotation * rotation).sum(-1)[..., None, None]
    skew = hat(rotation)
    inverse = (
        torch.eye(3, dtype=motion.dtype, device=motion.device)
        - 0.5 * skew
        + _cotangent(squared) * (skew @ skew)
    )
    return torch.cat([rotation, (inverse @ motion[..., :3, 3:])[..., 0]], dim=-1)


def inverse(motion: Tensor) -> Tensor:
    """Invert rigid motions: [R, t] becomes [R^T, -R^T t].

    Parameters
    ----------
    motion : (..., 4, 4) Tensor
        Rigid; translation in mm.

    Returns
    -------
    (..., 4, 4) Tensor
        The inverse motions.

    Raises
    ------
    ValueError
        The last dimensions are not 4 x 4.

    """
    _require_last(motion, (4, 4), "motion")
    rotation = motion[..., :3, :3].transpose(-1, -2)
    top = torch.cat([rotation, -rotation @ motion[..., :3, 3:]], dim=-1)
    return torch.cat([top, _last_row(top)], dim=-2)


def adjoint(motion: Tensor) -> Tensor:
    """Adjoint of rigid motions: motion exp(v) motion^-1 = exp(adjoint(motion) v).

    Parameters
    ----------
    motion : (..., 4, 4) Tensor
        Rigid; translation in mm.

    Returns
    -------
    (..., 6, 6) Tensor
        On [rotation (3) rad, translation part (3) mm].

    Raises
    ------
    ValueError
        The last dimensions are not 4 x 4.

    """
    _require_last(motion, (4, 4), "motion")
    rotation = motion[..., :3, :3]
    lower = hat(motion[..., :3, 3]) @ rotation
    top = torch.cat([rotation, torch.zeros_like(rotation)], dim=-1)
    return torch.cat([top, torch.cat([lower, rotation], dim=-1)], dim=-2)


def left_jacobian(v: Tensor) -> Tensor:
    """Left Jacobian of the exponential: exp(v + d) = exp(left_jacobian(v) d) exp(v) to first order in d.

    Parameters
    ----------
    v : (..., 6) Tensor
        [rotation (3) rad, translation part (3) mm].

    Returns
    -------
    (..., 6, 6) Tensor
        In the same order of components: [[J, 0], [Q, J]].

    Raises
    ------
    ValueError
        The last dimension is not 6.

    References
    ----------
    T. Barfoot, "State Estimation for Robotics", 2017, eq. 7.77 and 7.86.

    """
    _require_last(v, (6,), "v")
    squared = (v[..., :3] * v[..., :3]).sum(-1)[..., None, None]
    w, u = hat(v[..., :3]), hat(v[..., 3:])
    wu, uw, ww = w @ u, u @ w, w @ w
    wuw = wu @ w
    jacobian = torch.eye(3, dtype=v.dtype, device=v.device) + _versine(squared) * w + _cubic(squared) * ww
    lower = (
        0.5 * u
        + _cubic(squared) * (wu + uw + wuw)
        + _quartic(squared) * (w @ wu + uw @ w - 3 * wuw)
        + _quintic(squared) * (wuw @ w + w @ wuw)
    )
    top = torch.cat([jacobian, torch.zeros_like(jacobian)], dim=-1)
    return torch.cat([top, torch.cat([lower, jacobian], dim=-1)], dim=-2)


def hat(vector: Tensor) -> Tensor:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    x, y, z = vector.unbind(-1)
    zero = torch.zeros_like(x)
    return torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).unflatten(-1, (3, 3))


def _rotation_vector(rotation: Tensor) -> Tensor:
    """Rotation vectors (..., 3) rad, norm <= pi, of rotation matrices (..., 3, 3)."""
    quaternion = _unit_quaternion(rotation)
    quaternion = torch.where(quaternion[..., :1] < 0, -quaternion, quaternion)
    cosine, axis = quaternion[..., :1], quaternion[..., 1:]
    squared = (axis * axis).sum(-1, keepdim=True)
    small = squared < _ARCSINE_BELOW
    safe = torch.where(small, torch.ones_like(squared), squared)
    sine = safe.sqrt()
    ratio = torch.where(small, _polynomial(_ARCSINE, squared), torch.atan2(sine, cosine) / sine)
    return 2 * ratio * axis


def _unit_quaternion(rotation: Tensor) -> Tensor:
    """Unit quaternions (..., 4), scalar first, of rotation matrices (..., 3, 3), up to sign."""
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = (row.unbind(-1) for row in rotation.unbind(-2))
    # 4 q q^T: every row is a multiple of q, and the one of largest diagonal has a norm of 2 or more
    rows = [
        [1 + r00 + r11 + r22, r21 - r12, r02 - r20, r10 - r01],
        [r21 - r12, 1 + r00 - r11 - r22, r10 + r01, r02 + r20],
        [r02 - r20, r10 + r01, 1 - r00 + r11 - r22, r21 + r12],
        [r10 - r01, r02 + r20, r21 + r12, 1 - r00 - r11 + r22],
    ]
    outer = torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)
    largest = outer.detach().diagonal(dim1=-2, dim2=-1).argmax(-1)
    index = largest[..., None, None].expand(*largest.shape, 1, 4)
    row = outer.gather(-2, index)[..., 0, :]
    return row / row.norm(dim=-1, keepdim=True)


def _sinc(x: Tensor) -> Tensor:
    """Sin t / t of x = t^2."""
    return _series_or(x, _SINC, lambda t, _: torch.sin(t) / t)


def _versine(x: Tensor) -> Tensor:
    """(1 - cos t) / t^2 of x = t^2."""
    return _series_or(x, _VERSINE, lambda t, safe: 2 * torch.sin(t / 2) ** 2 / safe)


def _cubic(x: Tensor) -> Tensor:
    """(t - sin t) / t^3 of x = t^2."""
    return _series_or(x, _CUBIC, lambda t, safe: (t - torch.sin(t)) / (t * safe))


def _quartic(x: Tensor) -> Tensor:
    """(t^2 + 2 cos t - 2) / (2 t^4) of x = t^2."""
    return _series_or(x, _QUARTIC, lambda t, safe: (safe + 2 * torch.cos(t) - 2) / (2 * safe**2))


def _quintic(x: Tensor) -> Tensor:
    """(2 t - 3 sin t + t cos t) / (2 t^5) of x = t^2."""
    return _series_or(
        x, _QUINTIC, lambda t, safe: (2 * t - 3 * torch.sin(t) + t * torch.cos(t)) / (2 * t * safe**2)
    )


def _cotangent(x: Tensor) -> Tensor:
    """(1 - t/2 cot(t/2)) / t^2 of x = t^2, finite for |t| < 2 pi."""
    return _series_or(
        x, _COTANGENT, lambda t, safe: (1 - 0.5 * t * torch.cos(t / 2) / torch.sin(t / 2)) / safe
    )


def _series_or(
    x: Tensor, coefficients: Sequence[float], closed_form: Callable[[Tensor, Tensor], Tensor]
) -> Tensor:
    """Power series in x = t^2 near 0, closed_form(t, x) elsewhere; neither branch can spoil the gradient."""
    small = x < _SERIES_BELOW
    safe = torch.where(small, torch.ones_like(x), x)
    series = _polynomial(coefficients, torch.where(small, x, torch.zeros_like(x)))
    return torch.where(small, series, closed_form(safe.sqrt(), safe))


def _polynomial(coefficients: Sequence[float], x: Tensor) -> Tensor:
    """Horner's rule, constant coefficient first."""
    value = torch.full_like(x, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = value * x + coefficient
    return value


def _last_row(top: Tensor) -> Tensor:
    """The row 0 0 0 1 below the upper rows (..., 3, 4)."""
    row = torch.zeros_like(top[..., :1, :])
    row[..., 3] = 1
    return row


def _require_last(tensor: Tensor, shape: tuple[int, ...], name: str) -> None:
    """Refuse tensors whose last dimensions are not `shape`."""
    if tuple(tensor.shape[-len(shape) :]) != shape or not tensor.is_floating_point():
        wanted = ", ".join(str(size) for size in shape)
        raise ValueError(
            f"{name} has shape {tuple(tensor.shape)} and dtype {tensor.dtype}; "
            f"give floating-point numbers of shape (..., {wanted})."
        )
