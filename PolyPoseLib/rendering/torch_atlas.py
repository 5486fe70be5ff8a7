"""Many volumes in one row of voxels, through which rays of all of them are followed at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from PolyPoseLib.rendering.torch_rays import Bundle, ImageRays


@dataclass(frozen=True)
class Atlas:
    """K volumes.

    Attributes
    ----------
    flat : (N,) tensor of float32
        All voxels.
    first : (K,) tensor of int64
        Where each volume begins.
    size : (K, 3) tensor of int64
        Voxels of each along (i, j, k).

    """

    flat: Tensor
    first: Tensor
    size: Tensor

    @classmethod
    def of(cls, volumes: Sequence[Tensor]) -> Atlas:
        """Volumes (D, H, W) float32 on one device; one alone is not copied."""
        device = volumes[0].device
        counts = torch.tensor([volume.numel() for volume in volumes], device=device)
        size = torch.tensor([tuple(volume.shape)[::-1] for volume in volumes], device=device)
        flat = (
            volumes[0].reshape(-1) if len(volumes) == 1 else torch.cat([each.reshape(-1) for each in volumes])
        )
        return cls(flat, counts.cumsum(0) - counts, size)


def all_lines(atlas: Atlas, owner: Tensor, rays: Bundle, images: ImageRays) -> Tensor:
    """Line integrals (S, rows, columns); owner: (R,) which of the volumes each ray crosses."""
    lines = torch.empty(len(rays.count), device=atlas.flat.device)
    for part, number, counts in rays.chunks():
        value, _ = _interpolate(atlas, owner[part], rays.points(part, number), False)
        lines[part] = (value * counts).sum(1)
    image = torch.zeros(len(images.source) * images.rows * images.columns, device=lines.device)
    image[rays.pixel] = lines * images.step_mm
    return image.reshape(len(images.source), images.rows, images.columns)


def all_moments(atlas: Atlas, owner: Tensor, rays: Bundle, images: ImageRays) -> tuple[Tensor, Tensor]:
    """Line integrals (S, rows, columns), and their moments (S, rows, columns, 6).

    The moments are those of :class:`PolyPoseLib.rendering.backend.Backend`; owner: as in :func:`all_lines`.
    """
    found = torch.empty((len(rays.count), 7), device=atlas.flat.device)
    for part, number, counts in rays.chunks():
        value, gradient = _interpolate(atlas, owner[part], rays.points(part, number), True)
        assert gradient is not None
        gradient = gradient * counts[..., None]
        depth = rays.depth[part, None] + number * rays.spacing[part, None]
        found[part, 0] = (value * counts).sum(1)
        found[part, 1:4], found[part, 4:] = gradient.sum(1), (gradient * depth[..., None]).sum(1)
    shape = (len(images.source), images.rows, images.columns)
    sums = torch.zeros((shape[0] * shape[1] * shape[2], 7), device=found.device)
    sums[rays.pixel] = found * images.step_mm
    return sums[:, 0].reshape(shape), sums[:, 1:].reshape(*shape, 6)


def _interpolate(atlas: Atlas, owner: Tensor, points: Tensor, gradient: bool) -> tuple[Tensor, Tensor | None]:
    """Trilinear values at index points (r, n, 3) of rays (r,), and the interpolant's own gradient (r, n, 3)."""
    size = atlas.size[owner][:, None]
    corner = torch.minimum(points.long().clamp(min=0), size - 2)
    fx, fy, fz = (points - corner).unbind(-1)
    next_j, next_k = size[..., 0], size[..., 0] * size[..., 1]
    base = atlas.first[owner][:, None] + corner[..., 2] * next_k + corner[..., 1] * next_j + corner[..., 0]
    flat = atlas.flat
    edges = [
        (flat[base + offset], flat[base + offset + 1])
        for offset in (torch.zeros_like(next_j), next_j, next_k, next_k + next_j)
    ]
    steps = [b - a for a, b in edges]
    c00, c01, c10, c11 = (a + fx * step for (a, _), step in zip(edges, steps, strict=True))
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    value = c0 + fz * (c1 - c0)
    if not gradient:
        return value, None
    e0, e1 = steps[0] + fy * (steps[1] - steps[0]), steps[2] + fy * (steps[3] - steps[2])
    by_y = (c01 - c00) + fz * ((c11 - c10) - (c01 - c00))
    return value, torch.stack([e0 + fz * (e1 - e0), by_y, c1 - c0], dim=-1)
