"""The rays in plain torch: the fallback where numba is absent, the path for CUDA, and the kernels' oracle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.rendering.backend import IndexField
from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.occupancy import OccupiedBlocks

SAMPLES_PER_CHUNK = 1 << 20
"""Ray samples held at once on a CPU; about 100 bytes each."""

SAMPLES_PER_CUDA_CHUNK = 1 << 24


class TorchBackend:
    """Same sums as the numba kernels, vectorised over a chunk of rays.

    Volumes are copied to the device once and kept while they live.
    """

    def __init__(self, device: str = "cpu") -> None:
        """device: "cpu" or "cuda"."""
        self.device = torch.device(device)
        self.name = f"torch ({device})"
        self._resident: dict[int, tuple[np.ndarray, Tensor]] = {}

    def project(
        self, voxels: np.ndarray, rays: IndexRays, moments: bool, occupied: OccupiedBlocks | None = None
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """See :class:`PolyPoseLib.rendering.backend.Backend`."""
        volume = self._on_device(voxels)
        high = torch.tensor(voxels.shape[::-1], dtype=torch.float64, device=self.device) - 1
        lines, sums = [], []
        for points, depth, inside in self._samples(rays, torch.zeros_like(high), high):
            value, gradient = _interpolate(volume, points, moments)
            lines.append((value * inside).sum(1))
            if gradient is not None:
                gradient = gradient * inside[..., None]
                by_depth = (gradient * depth[..., None]).sum(1)
                sums.append(torch.cat([gradient.sum(1), by_depth], dim=1))
        image = (torch.cat(lines) * rays.step_mm).reshape(rays.shape).cpu().numpy()
        if not moments:
            return image, None
        return image, (torch.cat(sums) * rays.step_mm).reshape(*rays.shape, 6).cpu().numpy()

    def project_warped(
        self, voxels: np.ndarray, field: IndexField, rays: IndexRays, occupied: OccupiedBlocks | None = None
    ) -> np.ndarray:
        """See :class:`PolyPoseLib.rendering.backend.Backend`."""
        volume = self._on_device(voxels)
        vectors = torch.as_tensor(field.vectors, device=self.device)
        low, high, scale, offset = (
            torch.as_tensor(value, dtype=torch.float64, device=self.device)
            for value in (field.low, field.high, field.scale, field.offset)
        )
        top = torch.tensor(field.vectors.shape[2::-1], device=self.device) - 1.001
        end = torch.tensor(voxels.shape[::-1], device=self.device) - 1
        lines = []
        for points, _, inside in self._samples(rays, low, high):
            place = points * scale.float() + offset.float()
            place = torch.minimum(place.clamp(min=0), top.float())
            moved = points + _interpolate_vectors(vectors, place)
            within = inside * ((moved > 0) & (moved < end)).all(-1)
            value, _ = _interpolate(volume, torch.minimum(moved.clamp(min=0), end.float()), False)
            lines.append((value * within).sum(1))
        return (torch.cat(lines) * rays.step_mm).reshape(rays.shape).cpu().numpy()

    def _on_device(self, voxels: np.ndarray) -> Tensor:
        known = self._resident.get(id(voxels))
        if known is None or known[0] is not voxels:
            if len(self._resident) > 64:
                self._resident.clear()
            known = (voxels, torch.as_tensor(voxels, device=self.device))
            self._resident[id(voxels)] = known
        return known[1]

    def _samples(self, rays: IndexRays, low: Tensor, high: Tensor) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
        """Yield (rays, samples, 3) index points, their depth and whether they count, in chunks of rays."""
        to_device = {"dtype": torch.float64, "device": self.device}
        source, corner, per_column, per_row = (
            torch.as_tensor(v, **to_device) for v in (rays.source, rays.corner, rays.per_column, rays.per_row)
        )
        inverse = torch.as_tensor(rays.inverse_intrinsics, **to_device)
        row, column = torch.meshgrid(
            torch.arange(rays.shape[0], **to_device), torch.arange(rays.shape[1], **to_device), indexing="ij"
        )
        row, column = row.reshape(-1, 1), column.reshape(-1, 1)
        direction = corner + column * per_column + row * per_row
        pixel = torch.cat([column, row, torch.ones_like(row)], dim=1) @ inverse.T
        ds = rays.step_mm / pixel.norm(dim=1)
        safe = torch.where(direction.abs() < 1e-12, torch.full_like(direction, 1e-12), direction)
        first, second = (low - source) / safe, (high - source) / safe
        near = torch.minimum(first, second).amax(1).clamp(min=0)
        far = torch.maximum(first, second).amin(1)
        start = torch.ceil(near / ds - 0.5)
        count = (torch.floor(far / ds - 0.5) - start + 1).clamp(min=0)
        limit = SAMPLES_PER_CUDA_CHUNK if self.device.type == "cuda" else SAMPLES_PER_CHUNK
        most = int(count.max()) if len(count) else 0
        size = max(1, limit // max(most, 1))
        for begin in range(0, len(count), size):
            part = slice(begin, begin + size)
            number = torch.arange(max(int(count[part].max()), 1), **to_device)
            depth = (start[part, None] + 0.5 + number) * ds[part, None]
            inside = (number < count[part, None]).float()
            points = source + depth[..., None] * direction[part, None]
            yield torch.minimum(torch.maximum(points, low), high).float(), depth.float(), inside


def _corner(points: Tensor, size: tuple[int, ...]) -> tuple[Tensor, Tensor]:
    """Lowest corner (..., 3) of the cell around each index point, and the fraction inside it."""
    top = torch.tensor(size[::-1], device=points.device) - 2
    corner = torch.minimum(points.long().clamp(min=0), top)
    return corner, points - corner


def _interpolate(volume: Tensor, points: Tensor, gradient: bool) -> tuple[Tensor, Tensor | None]:
    """Trilinear values at (..., 3) index points (i, j, k), and the interpolant's own gradient (..., 3)."""
    corner, fraction = _corner(points, tuple(volume.shape))
    stride_k, stride_j = volume.shape[1] * volume.shape[2], volume.shape[2]
    base = corner[..., 2] * stride_k + corner[..., 1] * stride_j + corner[..., 0]
    flat = volume.reshape(-1)

    def at(offset: int) -> Tensor:
        return flat[base + offset]

    fx, fy, fz = fraction.unbind(-1)
    edges = [(at(o), at(o + 1)) for o in (0, stride_j, stride_k, stride_k + stride_j)]
    steps = [b - a for a, b in edges]
    c00, c01, c10, c11 = (a + fx * step for (a, _), step in zip(edges, steps, strict=True))
    c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
    value = c0 + fz * (c1 - c0)
    if not gradient:
        return value, None
    e0, e1 = steps[0] + fy * (steps[1] - steps[0]), steps[2] + fy * (steps[3] - steps[2])
    by_y = (c01 - c00) + fz * ((c11 - c10) - (c01 - c00))
    return value, torch.stack([e0 + fz * (e1 - e0), by_y, c1 - c0], dim=-1)


def _interpolate_vectors(vectors: Tensor, points: Tensor) -> Tensor:
    """Trilinear vectors (..., 3) of a (d, h, w, 3) field at (..., 3) grid coordinates."""
    corner, fraction = _corner(points, tuple(vectors.shape[:3]))
    stride_k, stride_j = vectors.shape[1] * vectors.shape[2], vectors.shape[2]
    base = corner[..., 2] * stride_k + corner[..., 1] * stride_j + corner[..., 0]
    flat = vectors.reshape(-1, 3)
    total = torch.zeros_like(points)
    for dz in (0, 1):
        for dy in (0, 1):
            for dx in (0, 1):
                part = [fraction[..., a] if d else 1 - fraction[..., a] for a, d in enumerate((dx, dy, dz))]
                weight = part[0] * part[1] * part[2]
                total += weight[..., None] * flat[base + dz * stride_k + dy * stride_j + dx]
    return total
