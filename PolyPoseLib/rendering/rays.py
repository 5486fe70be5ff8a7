"""The rays of a camera's pixels, in voxel indices, and where they cross the volume's box (torch)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor


@dataclass(frozen=True)
class Rays:
    """One straight ray per pixel, x(t) = origin + t direction in voxel indices (i, j, k), t in mm of depth.

    Attributes
    ----------
    origins : (R, 3) Tensor
        The sources.
    directions : (R, 3) Tensor
        Indices per mm of depth.
    mm_per_depth : (R,) Tensor
        Length of the ray in mm per mm of depth, 1 at the principal point.

    """

    origins: Tensor
    directions: Tensor
    mm_per_depth: Tensor


class Crossing(NamedTuple):
    """Depths (R,) in mm where each ray enters and leaves a box; enter == leave where it misses."""

    enter: Tensor
    leave: Tensor


def pixel_rays(affine: Tensor, intrinsics: Tensor, extrinsics: Tensor, height: int, width: int) -> Rays:
    """Rays from the source through every pixel's centre, differentiable in all three matrices.

    Parameters
    ----------
    affine : (4, 4) Tensor
        Homogeneous voxel index (i, j, k) to LPS mm, of either handedness.
    intrinsics : (B, 3, 3) Tensor
        px, see :mod:`PolyPoseLib.geometry.camera`.
    extrinsics : (B, 4, 4) Tensor
        World LPS mm to camera mm.
    height : int
        Rows of the images.
    width : int
        Columns of the images.

    Returns
    -------
    Rays
        R = B x height x width, pixels in row-major order, in the matrices' dtype.

    """
    options = {"dtype": intrinsics.dtype, "device": intrinsics.device}
    row, column = torch.meshgrid(
        torch.arange(height, **options), torch.arange(width, **options), indexing="ij"
    )
    pixels = torch.stack([column, row, torch.ones_like(row)], dim=-1).reshape(-1, 3)
    to_camera = pixels @ torch.linalg.inv(intrinsics).mT  # (B, P, 3), depth 1 mm
    to_index = torch.linalg.inv(affine[:3, :3])
    rotation = extrinsics[:, :3, :3]
    sources = -(rotation.mT @ extrinsics[:, :3, 3:])[..., 0]
    origins = (sources - affine[:3, 3]) @ to_index.T
    directions = to_camera @ rotation @ to_index.T
    return Rays(
        origins[:, None].expand_as(directions).reshape(-1, 3),
        directions.reshape(-1, 3),
        to_camera.norm(dim=-1).reshape(-1),
    )


def cross_box(rays: Rays, shape: Sequence[int]) -> Crossing:
    """Depths where rays cross the box of a volume's voxels, half a voxel beyond the outer centres.

    The slab method: the box is where three pairs of parallel planes overlap. Only the part in front of the
    source counts.

    Parameters
    ----------
    rays : Rays
        R rays in voxel indices.
    shape : Sequence[int]
        Voxels along (k, j, i).

    Returns
    -------
    Crossing
        (R,) depths in mm, 0 <= enter <= leave.

    References
    ----------
    T. Kay and J. Kajiya, "Ray tracing complex scenes", SIGGRAPH 1986.

    """
    size = rays.origins.new_tensor(shape[::-1])
    tiny = torch.full_like(rays.directions, torch.finfo(rays.directions.dtype).eps * 1e-3)
    steep = torch.where(rays.directions.abs() < tiny, tiny, rays.directions)
    first = (-0.5 - rays.origins) / steep
    second = (size - 0.5 - rays.origins) / steep
    enter = torch.minimum(first, second).amax(-1).clamp(min=0)
    leave = torch.maximum(first, second).amin(-1)
    missed = leave <= enter
    zero = torch.zeros_like(enter)
    return Crossing(torch.where(missed, zero, enter), torch.where(missed, zero, leave))
