"""Many rays through one volume in plain torch, on a CPU or a GPU: their samples, and sums over these.

Rays are sorted by their number of samples, and those with about as many are gone through together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

SAMPLES_PER_CHUNK = 1 << 17
"""Ray samples held at once on a CPU, few enough to stay in its cache; about 100 bytes each."""

SAMPLES_PER_CUDA_CHUNK = 1 << 24

TILE = 4
"""Pixels along the edge of the image's tiles; each has its own range of depths."""

_SURROUNDS = 1e-6
"""A block whose nearest depth is a smaller share of its farthest is taken to surround the source."""


@dataclass(frozen=True)
class ImageRays:
    """Rays of all pixels of S images of one camera, in voxel indices (i, j, k); all of float64.

    Attributes
    ----------
    source : (S, 3) tensor
        Where they begin.
    directions : (S, 3, 3) tensor
        Takes (column, row, 1) to index units per mm of depth.
    inverse_intrinsics : (3, 3) tensor
        Takes (column, row, 1) to the plane at depth 1.
    rows, columns : int
        Of each image.
    step_mm : float
        Distance of samples along a ray.

    """

    source: Tensor
    directions: Tensor
    inverse_intrinsics: Tensor
    rows: int
    columns: int
    step_mm: float


@dataclass(frozen=True)
class Bundle:
    """R rays that meet something.

    Attributes
    ----------
    pixel : (R,) tensor of int64
        Number of the pixel, counted through all images.
    first, step : (R, 3) tensor of float32
        Index of the first sample, and from one sample to the next.
    depth, spacing : (R,) tensor of float32
        Depth of the first sample, and from one to the next, mm.
    count : (R,) tensor of int64
        Samples, in falling order.

    """

    pixel: Tensor
    first: Tensor
    step: Tensor
    depth: Tensor
    spacing: Tensor
    count: Tensor

    def chunks(self) -> Iterator[tuple[slice, Tensor, Tensor]]:
        """Yield (rays, (most,) float32 numbers of samples, (r, most) float32 1 where a ray has the sample)."""
        device = self.count.device
        limit = SAMPLES_PER_CUDA_CHUNK if device.type == "cuda" else SAMPLES_PER_CHUNK
        counts, begin = self.count.tolist(), 0
        while begin < len(counts):
            most = counts[begin]
            part = slice(begin, begin + max(1, limit // most))
            number = torch.arange(most, dtype=torch.float32, device=device)
            yield part, number, (number < self.count[part, None]).float()
            begin = part.stop

    def points(self, part: slice, number: Tensor) -> Tensor:
        """(r, most, 3) float32 indices of samples."""
        return torch.addcmul(self.first[part, None], number[:, None], self.step[part, None])


def bundle(rays: ImageRays, low: Tensor, high: Tensor, near: Tensor, far: Tensor) -> Bundle:
    """The rays that cross a box between given depths.

    Parameters
    ----------
    rays : ImageRays
        Of S images.
    low, high : (3,) tensor
        Box of indices.
    near, far : (S, rows, columns) tensor
        Depths in mm between which anything is to be seen.

    Returns
    -------
    Bundle
        Samples lie at fixed depths from the source, wherever a ray is clipped.

    """
    pixel = torch.nonzero((far > near).reshape(-1))[:, 0]
    image, within = pixel // (rays.rows * rays.columns), pixel % (rays.rows * rays.columns)
    place = torch.stack([within % rays.columns, within // rays.columns, torch.ones_like(within)], -1).to(low)
    along = torch.einsum("rab,rb->ra", rays.directions[image], place)
    spacing = rays.step_mm / (place @ rays.inverse_intrinsics.T).norm(dim=1)
    source = rays.source[image]
    safe = torch.where(along.abs() < 1e-12, torch.full_like(along, 1e-12), along)
    first, second = (low - source) / safe, (high - source) / safe
    enters = torch.minimum(first, second).amax(1)
    leaves = torch.maximum(first, second).amin(1)
    enters = torch.maximum(enters, near.reshape(-1)[pixel].clamp(min=0))
    leaves = torch.minimum(leaves, far.reshape(-1)[pixel])
    number = torch.ceil(enters / spacing - 0.5)
    count = (torch.floor(leaves / spacing - 0.5) - number + 1).clamp(min=0).long()
    order = torch.argsort(count, descending=True, stable=True)
    order = order[: int((count > 0).sum())]
    depth = (number + 0.5) * spacing
    return Bundle(
        pixel[order],
        (source + depth[:, None] * along)[order].float(),
        (spacing[:, None] * along)[order].float(),
        depth[order].float(),
        spacing[order].float(),
        count[order],
    )


def depth_ranges(centres: Tensor, half_edges: Tensor, rays: ImageRays) -> tuple[Tensor, Tensor]:
    """Depths in mm (S, rows, columns) between which the rays of each pixel's tile can meet any of some blocks.

    Parameters
    ----------
    centres : (M, 3) tensor
        Indices of the blocks' centres.
    half_edges : (3,) tensor
        Of the blocks.
    rays : ImageRays
        Of S images.

    Returns
    -------
    near, far : (S, rows, columns) tensor
        Far is less than near where no block projects.

    """
    count = len(rays.source)
    tile_rows, tile_columns = -(-rays.rows // TILE), -(-rays.columns // TILE)
    to_pixels = torch.linalg.inv(rays.directions)
    seen = torch.einsum("sab,smb->sma", to_pixels, centres - rays.source[:, None])
    half = to_pixels.abs() @ half_edges
    nearest, farthest = seen[..., 2] - half[:, None, 2], seen[..., 2] + half[:, None, 2]
    around = nearest <= _SURROUNDS * farthest
    depth = torch.where(around, torch.ones_like(nearest), nearest)
    centre = seen[..., :2] / seen[..., 2:]
    spread = (to_pixels[:, None, :2] - centre[..., None] * to_pixels[:, None, 2:]).abs() @ half_edges
    spread = spread / depth[..., None]
    last = torch.tensor([tile_columns - 1, tile_rows - 1], device=centre.device)
    first_tile = torch.floor((centre - spread) / TILE).clamp(min=0)
    last_tile = torch.minimum(torch.floor((centre + spread) / TILE), last.to(centre))
    size = (last_tile - first_tile + 1).clamp(min=0)
    size[around] = 0
    tiles = (size[..., 0] * size[..., 1]).long()
    owner = torch.repeat_interleave(torch.arange(tiles.numel(), device=tiles.device), tiles.reshape(-1))
    begins = tiles.reshape(-1).cumsum(0) - tiles.reshape(-1)
    number = torch.arange(len(owner), device=tiles.device) - begins[owner]
    wide = size[..., 0].reshape(-1)[owner].long()
    first = first_tile.reshape(-1, 2)[owner].long()
    row, column = first[:, 1] + number // wide, first[:, 0] + number % wide
    where = ((owner // len(centres)) * tile_rows + row) * tile_columns + column
    near = torch.full(
        (count * tile_rows * tile_columns,), torch.inf, dtype=nearest.dtype, device=nearest.device
    )
    far = torch.full_like(near, -torch.inf)
    near.scatter_reduce_(0, where, nearest.reshape(-1)[owner], "amin")
    far.scatter_reduce_(0, where, farthest.reshape(-1)[owner], "amax")
    near, far = (each.reshape(count, tile_rows, tile_columns) for each in (near, far))
    surrounding = torch.where(around, farthest, torch.zeros_like(farthest)).amax(dim=1)[:, None, None]
    far = torch.where(surrounding > 0, torch.maximum(far, surrounding), far)
    near = torch.where(surrounding > 0, torch.zeros_like(near), near)
    return _per_pixel(near, rays), _per_pixel(far, rays)


def _per_pixel(tiles: Tensor, rays: ImageRays) -> Tensor:
    """Values of tiles (S, tile rows, tile columns) at pixels (S, rows, columns)."""
    pixels = tiles.repeat_interleave(TILE, dim=1).repeat_interleave(TILE, dim=2)
    return pixels[:, : rays.rows, : rays.columns]
