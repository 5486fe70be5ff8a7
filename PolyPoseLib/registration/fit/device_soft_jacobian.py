"""The derivative of the soft tissue's line integrals in torch, on a CPU or a GPU; see ``soft_jacobian_kernel``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.registration.fit.soft_kernel_arguments import CosineTables, DisplacedTissue, SegmentedRays

BYTES = {"cpu": 1 << 25, "cuda": 1 << 29}
"""Temporary memory on a device."""

_SAMPLE, _SEGMENT, _MODE = 300, 100, 20
"""Bytes of a sample, of a segment, and of a mode in a segment."""


@dataclass(frozen=True)
class DeviceTissue:
    """A :class:`DisplacedTissue` on torch's device: maps in float64, all else in float32."""

    to_node: Tensor
    vectors: Tensor
    freedom: Tensor
    to_index: Tensor
    gradient: Tensor

    @classmethod
    def of(cls, tissue: DisplacedTissue, device: torch.device) -> DeviceTissue:
        """The same, copied to a device."""

        def copied(values: np.ndarray, kind: torch.dtype) -> Tensor:
            return torch.as_tensor(values, dtype=kind, device=device)

        return cls(
            copied(tissue.to_node, torch.float64),
            copied(tissue.vectors, torch.float32),
            copied(tissue.freedom, torch.float32),
            copied(tissue.to_index, torch.float64),
            copied(tissue.gradient, torch.float32),
        )


def changes_by_modes(rays: SegmentedRays, tissue: DeviceTissue, modes: CosineTables) -> Tensor:
    """Derivatives (M, 3, P) float32 on the tissue's device, by the coefficients of M modes.

    Parameters
    ----------
    rays
        Rays of P pixels.
    tissue
        The soft tissue and the field that displaces it.
    modes
        Of the displacement.

    """
    device = tissue.gradient.device
    source, directions, near, far = (
        torch.as_tensor(each, dtype=torch.float64, device=device)
        for each in (rays.source, rays.directions, rays.near, rays.far)
    )
    to_angles = torch.as_tensor(modes.to_angles, dtype=torch.float64, device=device)
    numbers = torch.as_tensor(modes.numbers, device=device)
    length = rays.step_mm * rays.per_segment
    begin = torch.floor((near - rays.first) / length)
    count = (torch.ceil((far - rays.first) / length) - begin).long().masked_fill(far <= near, 0)
    order = torch.argsort(count, descending=True, stable=True)[: int((count > 0).sum())]
    first = 0
    changes = torch.zeros((len(numbers), 3, len(near)), device=device)
    segment = rays.per_segment * _SAMPLE + _SEGMENT + len(numbers) * _MODE
    while first < len(order):
        most = int(count[order[first]])  # of these rays, the first has the most segments
        part = order[first : first + max(1, BYTES[device.type] // (most * segment))]
        number = begin[part, None] + torch.arange(most, device=device)
        start = rays.first + number * length
        within = (torch.arange(rays.per_segment, device=device) + 0.5) * rays.step_mm
        depth = start[..., None] + within
        crossed = (depth >= near[part, None, None]) & (depth <= far[part, None, None])
        points = source + depth[..., None] * directions[part, None, None]
        gradient = (_gradients(tissue, points) * crossed[..., None]).sum(2) * rays.step_mm
        gradient = gradient * (gradient.abs().amax(-1, keepdim=True) > rays.negligible)
        middles = source + (start + length / 2)[..., None] * directions[part, None]
        values = _cosines(to_angles, middles, numbers)
        changes[:, :, part] = torch.bmm(gradient.transpose(1, 2), values).permute(2, 1, 0)
        first += len(part)
    return changes


def _gradients(tissue: DeviceTissue, points: Tensor) -> Tensor:
    """(..., 3) gradients of the attenuation that fixed points (..., 3) show, times the share of the modes there."""
    nodes = torch.tensor(tissue.freedom.shape[::-1], device=points.device)
    node = _flat(_place(tissue.to_node, points).round().long().clamp(min=0).minimum(nodes - 1), nodes)
    index = _place(tissue.to_index, points + tissue.vectors.reshape(-1, 3)[node]).round()
    size = torch.tensor(tissue.gradient.shape[2::-1], device=points.device)
    inside = ((index >= 0) & (index < size)).all(-1)
    voxel = _flat(torch.where(inside[..., None], index, 0.0).long(), size)
    share = tissue.freedom.reshape(-1)[node] * inside
    return tissue.gradient.reshape(-1, 3)[voxel] * share[..., None]


def _place(affine: Tensor, points: Tensor) -> Tensor:
    """Points (..., 3) under an affine map (3, 4)."""
    return points @ affine[:, :3].T + affine[:, 3]


def _flat(index: Tensor, size: Tensor) -> Tensor:
    """Numbers (...) of indices (..., 3) in the order (i, j, k) in an array of so many (3,) elements along them."""
    return (index[..., 2] * size[1] + index[..., 1]) * size[0] + index[..., 0]


def _cosines(to_angles: Tensor, points: Tensor, numbers: Tensor) -> Tensor:
    """Values (r, s, M) float32 of modes at points (r, s, 3)."""
    angles = _place(to_angles, points)
    multiples = torch.arange(int(numbers.max()) + 1, device=points.device)
    tables = torch.cos(angles[..., None] * multiples).float()
    along = (tables[:, :, axis][..., numbers[:, axis]] for axis in range(3))
    return next(along) * next(along) * next(along)
