"""The numbers that stand for a camera: continuous, centred, and nearly independent of where the anchor shows.

A camera is written as the anchor's centre in the image (tangents a, b of the angles from the axis), its depth, and the
rotation as seen along the ray to that centre, relative to a standard view.  That rotation changes little when the
camera turns about its source, as the image does.  It is given by two columns that Gram and Schmidt make orthonormal:
a code without jumps (Y. Zhou et al., "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019).
"""

from __future__ import annotations

import torch
from torch import Tensor

LENGTH = 9
"""Numbers per camera: six of the rotation, two of the place in the image, one of the depth."""

DEPTH_SCALE = 0.2
"""Change of the depth's logarithm for one unit."""


def encode(
    extrinsics: Tensor, view_rotations: Tensor, centre: Tensor, half_tangent: float, depth_mm: float
) -> Tensor:
    """Codes of cameras.

    Parameters
    ----------
    extrinsics : (B, 4, 4) Tensor
        World LPS mm to camera.
    view_rotations : (B, 3, 3) Tensor
        Of the standard views to which the codes refer.
    centre : (3,) Tensor
        The anchor's centre, LPS mm.
    half_tangent : float
        One unit of the place in the image.
    depth_mm : float
        Distance whose code is 0.

    Returns
    -------
    (B, 9) Tensor
        Two columns of the rotation, place in the image, depth.

    """
    rotation, shift = extrinsics[:, :3, :3], extrinsics[:, :3, 3]
    place = rotation @ centre + shift
    tangents = place[:, :2] / place[:, 2:]
    seen = tilt(tangents).transpose(1, 2) @ rotation @ view_rotations.transpose(1, 2)
    depth = torch.log(place[:, 2:] / depth_mm) / DEPTH_SCALE
    return torch.cat([seen[:, :, 0], seen[:, :, 1], tangents / half_tangent, depth], dim=1)


def decode(
    codes: Tensor, view_rotations: Tensor, centre: Tensor, half_tangent: float, depth_mm: float
) -> Tensor:
    """Cameras (B, 4, 4) of codes (B, 9), the inverse of :func:`encode`; any finite code gives a rigid motion."""
    seen = _orthonormal(codes[:, :6])
    tangents = codes[:, 6:8] * half_tangent
    depth = depth_mm * torch.exp(DEPTH_SCALE * codes[:, 8:].clamp(-8, 8))
    rotation = tilt(tangents) @ seen @ view_rotations
    place = torch.cat([tangents, torch.ones_like(depth)], dim=1) * depth
    shift = place - rotation @ centre
    top = torch.cat([rotation, shift[:, :, None]], dim=2)
    last = torch.tensor([0.0, 0.0, 0.0, 1.0], dtype=top.dtype, device=top.device)
    return torch.cat([top, last.expand(len(top), 1, 4)], dim=1)


def tilt(tangents: Tensor) -> Tensor:
    """(B, 3, 3) smallest rotations that take the axis (0, 0, 1) to rays (a, b, 1) with tangents (B, 2)."""
    ray = torch.cat([tangents, torch.ones_like(tangents[:, :1])], dim=1)
    ray = ray / ray.norm(dim=1, keepdim=True)
    x, y, cosine = ray.unbind(dim=1)
    zero = torch.zeros_like(x)
    skew = torch.stack([zero, zero, x, zero, zero, y, -x, -y, zero], dim=1).reshape(-1, 3, 3)
    identity = torch.eye(3, dtype=ray.dtype, device=ray.device)
    return identity + skew + skew @ skew / (1 + cosine)[:, None, None]


def _orthonormal(pairs: Tensor) -> Tensor:
    """(B, 3, 3) rotations whose first two columns lie closest, in this order, to the pairs (B, 6)."""
    first = torch.nn.functional.normalize(pairs[:, :3], dim=1, eps=1e-6)
    second = pairs[:, 3:] - (first * pairs[:, 3:]).sum(1, keepdim=True) * first
    second = torch.nn.functional.normalize(second, dim=1, eps=1e-6)
    return torch.stack([first, second, torch.linalg.cross(first, second)], dim=2)
