"""The rays in plain torch: the fallback where numba is absent, the path for CUDA, and the kernels' oracle."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from PolyPoseLib.rendering.backend import IndexField
from PolyPoseLib.rendering.kernel_arguments import IndexRays
from PolyPoseLib.rendering.occupancy import OccupiedBlocks
from PolyPoseLib.rendering.torch_atlas import Atlas, all_moments
from PolyPoseLib.rendering.torch_rays import Blocks, Bundle, ImageRays, bundle, depth_ranges


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
        volume, count = self.on_device(voxels), len(rays.source)
        high = self._exact(np.array(voxels.shape[::-1]) - 1).expand(count, 3)
        found = bundle(rays, torch.zeros_like(high), high, *self.seen(occupied, np.zeros(3), rays))
        if moments:
            return all_moments(Atlas.of([volume]), torch.zeros_like(found.image), found, rays)
        image = torch.zeros(count * rays.rows * rays.columns, device=self.device)
        image[found.pixel] = _line_sums(volume, found) * rays.step_mm
        return image.reshape(count, rays.rows, rays.columns), None

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
        found = bundle(own, low[None], high[None], *self.seen(occupied, reach, own))
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
        """The rays of one image, or of S whose vectors are (S, 3), on the device."""
        directions = np.stack([rays.per_column, rays.per_row, rays.corner], axis=-1).reshape(-1, 3, 3)
        return ImageRays(
            self._exact(rays.source).reshape(-1, 3),
            self._exact(directions),
            self._exact(rays.inverse_intrinsics).expand(len(directions), 3, 3),
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

    def seen(
        self, occupied: OccupiedBlocks | None, reach: np.ndarray, rays: ImageRays
    ) -> tuple[Tensor, Tensor]:
        """Depths (S, rows, columns) between which anything is to be seen; reach: (3,) of displacements, in indices."""
        finite = bool(torch.isfinite(rays.directions).all() and torch.isfinite(rays.source).all())
        if occupied is None or not finite or not len(occupied.centres):
            shape = (len(rays.source), rays.rows, rays.columns)
            near = torch.zeros(shape, dtype=torch.float64, device=self.device)
            return near, torch.full_like(near, torch.inf if occupied is None or not finite else -1.0)
        count, centres = len(rays.source), self._exact(occupied.centres)
        half_edges = self._exact(occupied.half_edge + reach).expand(count * len(centres), 3)
        image = torch.arange(count, device=self.device).repeat_interleave(len(centres))
        return depth_ranges(Blocks(image, centres.repeat(count, 1), half_edges), rays)

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
