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
    """Rays of all pixels of S images, in voxel indices (i, j, k) of what each shows; all of float64.

    Attributes
    ----------
    source : (S, 3) tensor
        Where they begin.
    directions : (S, 3, 3) tensor
        Takes (column, row, 1) to index units per mm of depth.
    inverse_intrinsics : (S, 3, 3) tensor
        Takes (column, row, 1) to the plane at depth 1.
    rows, columns : int
        Of the largest image.
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
    pixel, image : (R,) tensor of int64
        Number of the pixel, counted through all images, and of the image.
    first, step : (R, 3) tensor of float32
        Index of the first sample, and from one sample to the next.
    depth, spacing : (R,) tensor of float32
        Depth of the first sample, and from one to the next, mm.
    count : (R,) tensor of int64
        Samples, in falling order.

    """

    pixel: Tensor
    image: Tensor
    first: Tensor
    step: Tensor
    depth: Tensor
    spacing: Tensor
    count: Tensor

    def chunks(self) -> Iterator[tuple[slice, Tensor, Tensor]]:
        """Yield (rays, (most,) float32 numbers of samples, (r, most) float32 1 where a ray has the sample)."""
        device = self.count.device
        limit = SAMPLES_PER_CUDA_CHUNK if device.type == "cuda" else SAMPLES_PER_CHUNK
        begin = 0
        while begin < len(self.count):
            most = int(self.count[begin])  # alone: on a GPU, all of them would be copied back
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
    low, high : (S, 3) tensor
        Box of indices of each image.
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
    on_plane = torch.einsum("rab,rb->ra", rays.inverse_intrinsics[image], place)
    spacing = rays.step_mm / on_plane.norm(dim=1)
    source = rays.source[image]
    safe = torch.where(along.abs() < 1e-12, torch.full_like(along, 1e-12), along)
    first, second = (low[image] - source) / safe, (high[image] - source) / safe
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
        image[order],
        (source + depth[:, None] * along)[order].float(),
        (spacing[:, None] * along)[order].float(),
        depth[order].float(),
        spacing[order].float(),
        count[order],
    )


@dataclass(frozen=True)
class Blocks:
    """Blocks of voxels outside of which an image's volume is zero: P pairs of an image and a block.

    Attributes
    ----------
    image : (P,) tensor of int64
        Number of the image.
    centres, half_edges : (P, 3) tensor of float64
        Indices (i, j, k) of the blocks' centres, and half of their edges.

    """

    image: Tensor
    centres: Tensor
    half_edges: Tensor


def depth_ranges(blocks: Blocks, rays: ImageRays) -> tuple[Tensor, Tensor]:
    """Depths in mm between which the rays of each pixel's tile can meet any of an image's blocks.

    Parameters
    ----------
    blocks : Blocks
        Of S images.
    rays : ImageRays
        Of the same.

    Returns
    -------
    near, far : (S, rows, columns) tensor
        Far is less than near where no block projects.

    """
    shape = (len(rays.source), -(-rays.rows // TILE), -(-rays.columns // TILE))
    to_pixels = torch.linalg.inv(rays.directions)[blocks.image]
    seen = torch.einsum("pab,pb->pa", to_pixels, blocks.centres - rays.source[blocks.image])
    half = torch.einsum("pab,pb->pa", to_pixels.abs(), blocks.half_edges)[:, 2]
    nearest, farthest = seen[:, 2] - half, seen[:, 2] + half
    around = nearest <= _SURROUNDS * farthest  # around the source, where every ray may meet it, or behind it
    where, owner = _tiles_met(blocks, seen, to_pixels, torch.where(around, torch.inf, nearest), shape)
    near = torch.full(
        (shape[0] * shape[1] * shape[2],), torch.inf, dtype=nearest.dtype, device=nearest.device
    )
    far = torch.full_like(near, -torch.inf)
    near.scatter_reduce_(0, where, nearest[owner], "amin")
    far.scatter_reduce_(0, where, farthest[owner], "amax")
    near, far = near.reshape(shape), far.reshape(shape)
    surrounding = torch.zeros(shape[0], dtype=far.dtype, device=far.device)
    surrounding.scatter_reduce_(0, blocks.image, torch.where(around, farthest, 0.0), "amax")
    inside = (surrounding > 0)[:, None, None]
    far = torch.where(inside, torch.maximum(far, surrounding[:, None, None]), far)
    near = torch.where(inside, torch.zeros_like(near), near)
    return _per_pixel(near, rays), _per_pixel(far, rays)


def _tiles_met(
    blocks: Blocks, seen: Tensor, to_pixels: Tensor, nearest: Tensor, shape: tuple[int, int, int]
) -> tuple[Tensor, Tensor]:
    """Numbers of the tiles that each block's bounds touch, and of the pair that each belongs to.

    seen: (P, 3) centres as (depth column, depth row, depth); nearest: (P,) depth, infinite for what touches none.
    """
    centre = seen[:, :2] / seen[:, 2:]
    # |a / d - a0 / d0| = |(a - a0) - (a0 / d0) (d - d0)| / d
    across = (to_pixels[:, :2] - centre[..., None] * to_pixels[:, 2:]).abs()
    spread = torch.einsum("pab,pb->pa", across, blocks.half_edges) / nearest[:, None]
    last = torch.tensor([shape[2] - 1, shape[1] - 1], dtype=centre.dtype, device=centre.device)
    first = torch.floor((centre - spread) / TILE).clamp(min=0)
    size = (torch.minimum(torch.floor((centre + spread) / TILE), last) - first + 1).clamp(min=0)
    size = torch.where(torch.isfinite(nearest)[:, None], size, 0.0).long()
    tiles = size[:, 0] * size[:, 1]
    owner = torch.repeat_interleave(torch.arange(len(tiles), device=tiles.device), tiles)
    number = torch.arange(len(owner), device=tiles.device) - (tiles.cumsum(0) - tiles)[owner]
    first, wide = first.nan_to_num(0.0).long()[owner], size[owner, 0]
    row, column = first[:, 1] + number // wide, first[:, 0] + number % wide
    return (blocks.image[owner] * shape[1] + row) * shape[2] + column, owner


def _per_pixel(tiles: Tensor, rays: ImageRays) -> Tensor:
    """Values of tiles (S, tile rows, tile columns) at pixels (S, rows, columns)."""
    pixels = tiles.repeat_interleave(TILE, dim=1).repeat_interleave(TILE, dim=2)
    return pixels[:, : rays.rows, : rays.columns]
