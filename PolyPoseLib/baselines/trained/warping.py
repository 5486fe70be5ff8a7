"""Warps of volumes on the network's grid, in torch: resampling, inversion, and the penalty on their gradient."""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

INVERSE_ITERATIONS = 7
"""Of the fixed point that inverts a displacement, as in the published code."""


def identity_coordinates(side: int, like: Tensor) -> Tensor:
    """Normalised coordinates (1, 3, side, side, side) of the nodes, x (along i) first."""
    line = torch.linspace(-1, 1, side, dtype=like.dtype, device=like.device)
    z, y, x = torch.meshgrid(line, line, line, indexing="ij")
    return torch.stack([x, y, z])[None]


def warped(volume: Tensor, displacement: Tensor) -> Tensor:
    """A volume (B, C, k, j, i) at x + u(x), (B, 3, k, j, i) in normalised coordinates; -1, which is air, outside."""
    coordinates = (identity_coordinates(displacement.shape[-1], displacement) + displacement).permute(
        0, 2, 3, 4, 1
    )
    return F.grid_sample(volume + 1, coordinates, padding_mode="zeros", align_corners=True) - 1


def inverse(displacement: Tensor, iterations: int = INVERSE_ITERATIONS) -> Tensor:
    """The displacement of the inverse map, by the fixed point v = -u(x + v); where it leaves the grid, 0 is taken."""
    coordinates = identity_coordinates(displacement.shape[-1], displacement)
    found = torch.zeros_like(displacement)
    for _ in range(iterations):
        at = (coordinates + found).permute(0, 2, 3, 4, 1)
        found = -F.grid_sample(displacement, at, padding_mode="zeros", align_corners=True)
    return found


def gradient_penalty(displacement: Tensor) -> Tensor:
    """Mean over the inner nodes of the squared Frobenius norm of the displacement's gradient (no unit)."""
    width = 4 / (displacement.shape[-1] - 1)  # two nodes in normalised coordinates
    total = displacement.new_zeros(())
    for axis in (2, 3, 4):
        ends = displacement.narrow(axis, 2, displacement.shape[axis] - 2)
        starts = displacement.narrow(axis, 0, displacement.shape[axis] - 2)
        total = total + ((ends - starts) / width).square().mean() * 3
    return total


def inner(volume: Tensor) -> Tensor:
    """A volume (..., k, j, i) without its outermost nodes: a CT that ends in the body lacks what moved in there.

    Two of 32 nodes are left out at every end; with them, the truth was no minimum of the loss in 3D.
    """
    side = volume.shape[-1]
    kept = slice(side // 16, side - side // 16)
    return volume[..., kept, kept, kept]


def dissimilarity(first: Tensor, second: Tensor, dims: int) -> Tensor:
    """1 - normalised cross-correlation over the last `dims` axes, averaged over the others; 0 where both agree."""
    axes = tuple(range(-dims, 0))
    a = first - first.mean(dim=axes, keepdim=True)
    b = second - second.mean(dim=axes, keepdim=True)
    norms = (a.square().mean(dim=axes) * b.square().mean(dim=axes) + 1e-12).sqrt()
    return 1 - ((a * b).mean(dim=axes) / norms).mean()
