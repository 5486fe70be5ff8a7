"""The rays in plain torch: the fallback where numba is absent, the path for CUDA, and the kernels' oracle."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from PolyPoseLib.rendering.backend import IndexField
from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.occupancy import OccupiedBlocks
from PolyPoseLib.rendering.torch_rays import Bundle, ImageRays, bundle, depth_ranges


class TorchBackend:
    """Same sums as the numba kernels, vectorised over many rays.

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
        images, sums = self.sums(voxels, self.image_rays(rays), moments, occupied)
        image = images[0].cpu().numpy()
        return image, None if sums is None else sums[0].cpu().numpy()

    def sums(
        self, voxels: np.ndarray, rays: ImageRays, moments: bool, occupied: OccupiedBlocks | None = None
    ) -> tuple[Tensor, Tensor | None]:
        """Line integrals (S, rows, columns) of a volume in S images, and their moments (S, rows, columns, 6).

        As :meth:`project`, on the device.
        """
        volume = self.on_device(voxels)
        high = torch.tensor(voxels.shape[::-1], dtype=torch.float64, device=self.device) - 1
        found = bundle(rays, torch.zeros_like(high), high, *self._seen(occupied, np.zeros(3), rays))
        shape = (len(rays.source), rays.rows, rays.columns)
        image = torch.zeros(shape[0] * shape[1] * shape[2], device=self.device)
        if not moments:
            image[found.pixel] = _line_sums(volume, found) * rays.step_mm
            return image.reshape(shape), None
        sums = torch.zeros((len(image), 6), device=self.device)
        line, own = _moments(volume, found)
        image[found.pixel], sums[found.pixel] = line * rays.step_mm, own * rays.step_mm
        return image.reshape(shape), sums.reshape(*shape, 6)

    def project_warped(
        self, voxels: np.ndarray, field: IndexField, rays: IndexRays, occupied: OccupiedBlocks | None = None
    ) -> np.ndarray:
        """See :class:`PolyPoseLib.rendering.backend.Backend`."""
        volume, own = self.on_device(voxels), self.image_rays(rays)
        low, high, scale, offset = (
            torch.as_tensor(value, dtype=torch.float64, device=self.device)
            for value in (field.low, field.high, field.scale, field.offset)
        )
        reach = np.abs(field.vectors).reshape(-1, 3).max(axis=0)
        found = bundle(own, low, high, *self._seen(occupied, reach, own))
        vectors = torch.as_tensor(field.vectors, device=self.device).permute(3, 0, 1, 2)[None]
        to_field = _normalising(vectors.shape[2:], scale, offset)
        to_volume = _normalising(volume.shape, torch.ones_like(scale), torch.zeros_like(offset))
        image = torch.zeros(own.rows * own.columns, device=self.device)
        for part, number, counts in found.chunks():
            points = found.points(part, number)
            place = (points * to_field[0] + to_field[1])[None, None]
            moved = grid_sample(vectors, place, padding_mode="border", align_corners=True)[0, :, 0]
            points = points + moved.permute(1, 2, 0)
            value = _values(volume, points * to_volume[0] + to_volume[1])
            image[found.pixel[part]] = (value * counts).sum(1) * own.step_mm
        return image.reshape(rays.shape).cpu().numpy()

    def image_rays(self, rays: IndexRays) -> ImageRays:
        """The rays of one image on the device."""
        directions = np.stack([rays.per_column, rays.per_row, rays.corner], axis=1)
        return ImageRays(
            self._exact(rays.source)[None],
            self._exact(directions)[None],
            self._exact(rays.inverse_intrinsics),
            rays.rows,
            rays.columns,
            rays.step_mm,
        )

    def on_device(self, voxels: np.ndarray) -> Tensor:
        """A volume, copied once."""
        known = self._resident.get(id(voxels))
        if known is None or known[0] is not voxels:
            if len(self._resident) > 64:
                self._resident.clear()
            known = (voxels, torch.as_tensor(voxels, device=self.device))
            self._resident[id(voxels)] = known
        return known[1]

    def _seen(
        self, occupied: OccupiedBlocks | None, reach: np.ndarray, rays: ImageRays
    ) -> tuple[Tensor, Tensor]:
        """Depths (S, rows, columns) between which anything is to be seen; reach: (3,) of displacements, in indices."""
        finite = bool(torch.isfinite(rays.directions).all() and torch.isfinite(rays.source).all())
        if occupied is None or not finite or not len(occupied.centres):
            shape = (len(rays.source), rays.rows, rays.columns)
            near = torch.zeros(shape, dtype=torch.float64, device=self.device)
            return near, torch.full_like(near, torch.inf if occupied is None or not finite else -1.0)
        half_edges = self._exact(occupied.half_edge + reach)
        return depth_ranges(self._exact(occupied.centres), half_edges, rays)

    def _exact(self, values: np.ndarray) -> Tensor:
        return torch.as_tensor(np.asarray(values, np.float64), device=self.device)


def _normalising(shape: tuple[int, ...], scale: Tensor, offset: Tensor) -> tuple[Tensor, Tensor]:
    """Factor and shift (3,) float32 that take volume indices to grid_sample's -1 .. 1 along (i, j, k)."""
    last = torch.tensor(tuple(shape)[::-1], dtype=torch.float64, device=scale.device) - 1
    return (2 * scale / last).float(), (2 * offset / last - 1).float()


def _values(volume: Tensor, places: Tensor) -> Tensor:
    """(r, n) trilinear values of a volume (D, H, W) at places (r, n, 3) from -1 to 1; 0 beyond."""
    found = grid_sample(volume[None, None], places[None, None], padding_mode="zeros", align_corners=True)
    return found[0, 0, 0]


def _line_sums(volume: Tensor, rays: Bundle) -> Tensor:
    """(R,) sums of a volume's values over each ray's samples."""
    unit = torch.ones(3, dtype=torch.float64, device=volume.device)
    scale, shift = _normalising(volume.shape, unit, 0 * unit)
    first, step = rays.first * scale + shift, rays.step * scale
    sums = torch.empty(len(first), device=volume.device)
    for part, number, counts in rays.chunks():
        places = torch.addcmul(first[part, None], number[:, None], step[part, None])
        sums[part] = (_values(volume, places) * counts).sum(1)
    return sums


def _moments(volume: Tensor, rays: Bundle) -> tuple[Tensor, Tensor]:
    """(R,) sums of values, and (R, 6) of gradients by index and of depth times these, over each ray's samples."""
    lines, sums = (
        torch.empty(len(rays.count), device=volume.device),
        torch.empty((len(rays.count), 6), device=volume.device),
    )
    for part, number, counts in rays.chunks():
        value, gradient = _interpolate(volume, rays.points(part, number))
        gradient = gradient * counts[..., None]
        depth = rays.depth[part, None] + number * rays.spacing[part, None]
        lines[part] = (value * counts).sum(1)
        sums[part, :3], sums[part, 3:] = gradient.sum(1), (gradient * depth[..., None]).sum(1)
    return lines, sums


def _corner(points: Tensor, size: tuple[int, ...]) -> tuple[Tensor, Tensor]:
    """Lowest corner (..., 3) of the cell around each index point, and the fraction inside it."""
    top = torch.tensor(size[::-1], device=points.device) - 2
    corner = torch.minimum(points.long().clamp(min=0), top)
    return corner, points - corner


def _interpolate(volume: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
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
    e0, e1 = steps[0] + fy * (steps[1] - steps[0]), steps[2] + fy * (steps[3] - steps[2])
    by_y = (c01 - c00) + fz * ((c11 - c10) - (c01 - c00))
    return value, torch.stack([e0 + fz * (e1 - e0), by_y, c1 - c0], dim=-1)
