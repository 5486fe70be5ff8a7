"""How far a predicted camera is from the true one, as differentiable losses."""

from __future__ import annotations

import torch
from torch import Tensor

from PolyPoseLib.geometry import se3

SOFT_MM = 0.1
"""Distances d count as sqrt(d^2 + SOFT_MM^2) - SOFT_MM: as they are, but with a gradient at zero."""

LEAST_DEPTH_MM = 50.0

DEPTH_WEIGHT = 0.3
"""Of motion along the ray: it hardly changes the image."""


def projection_mm(predicted: Tensor, true: Tensor, points: Tensor) -> Tensor:
    """Mean distance between the projections of points.

    Parameters
    ----------
    predicted, true : (B, 4, 4) Tensor
        World LPS mm to camera.
    points : (N, 3) Tensor
        LPS mm.

    Returns
    -------
    (B,) Tensor
        mm in the plane through each true point, as :func:`PolyPoseLib.evaluation.metrics.projection_error_mm`
        measures it.

    """
    found, real = (points @ m[:, :3, :3].transpose(1, 2) + m[:, None, :3, 3] for m in (predicted, true))
    ahead = found[..., 2:].clamp(min=LEAST_DEPTH_MM)
    apart = found[..., :2] / ahead * real[..., 2:] - real[..., :2]
    return _soft_norm(apart).mean(1)


def geodesic_mm(predicted: Tensor, true: Tensor, centre: Tensor, radius_mm: float) -> Tensor:
    """Length of the motion between two cameras about the anchor; rotations count at the anchor's radius.

    The logarithm in SE(3) of the relative motion in the true camera's axes about the anchor's centre, weighted less for
    the depth.

    Parameters
    ----------
    predicted, true : (B, 4, 4) Tensor
        World LPS mm to camera.
    centre : (3,) Tensor
        The anchor's centre, LPS mm.
    radius_mm : float
        The anchor's radius.

    Returns
    -------
    (B,) Tensor
        mm.

    References
    ----------
    V. Gopalakrishnan et al., "Intraoperative 2D/3D Image Registration via Differentiable X-ray Rendering", CVPR 2024
    (the double geodesic).

    """
    place = true[:, :3, :3] @ centre + true[:, :3, 3]
    shift = torch.eye(4, dtype=true.dtype, device=true.device).repeat(len(true), 1, 1)
    shift[:, :3, 3] = place
    relative = se3.inverse(shift) @ predicted @ se3.inverse(true) @ shift
    motion = se3.log(relative)
    weight = motion.new_tensor([radius_mm] * 3 + [1.0, 1.0, DEPTH_WEIGHT])
    return _soft_norm(motion * weight)


def _soft_norm(vectors: Tensor) -> Tensor:
    """Lengths over the last axis, smooth at zero and zero there."""
    return torch.sqrt((vectors * vectors).sum(-1) + SOFT_MM**2) - SOFT_MM
