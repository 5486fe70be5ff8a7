"""Digitally reconstructed radiographs: line integrals of attenuation along X-rays (torch, CPU and CUDA).

Between voxel centres the attenuation is trilinear; in the outer half voxel it is that of the nearest centres,
and outside the box it is zero. Each ray is clipped to the box and summed by the midpoint rule. Rays go through in
chunks, and the backward pass renders each chunk again, so memory is bounded whatever the size of the images.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn.functional import grid_sample

from PolyPoseLib.rendering.rays import cross_box, pixel_rays

CHUNK_SAMPLES = 1 << 21
"""Samples that are in memory at a time; about 50 bytes each in float32."""


def render(
    volume: Tensor,
    affine: Tensor,
    intrinsics: Tensor,
    extrinsics: Tensor,
    height: int,
    width: int,
    step_mm: float | None = None,
    chunk_samples: int = CHUNK_SAMPLES,
) -> Tensor:
    """Digitally reconstructed radiographs: line integrals along the rays of every pixel of every view.

    Differentiable once in the volume, the intrinsics and the extrinsics. On the CPU the same input gives the
    same bits; on CUDA the gradient of the volume sums in no fixed order.

    Parameters
    ----------
    volume : (D, H, W) Tensor
        Attenuation in 1/mm, float32 or float64; the images share its dtype and device.
    affine : (4, 4) Tensor
        Homogeneous voxel index (i, j, k) to LPS mm, oblique and left-handed ones included.
    intrinsics : (B, 3, 3) Tensor
        px, or one (3, 3) for all views; see :mod:`PolyPoseLib.geometry.camera`.
    extrinsics : (B, 4, 4) Tensor
        World LPS mm to camera mm; rays are set up in float64.
    height : int
        Rows of the images.
    width : int
        Columns of the images.
    step_mm : float, optional
        Longest distance between samples in mm; each ray is divided evenly. The smallest voxel spacing when None.
    chunk_samples : int
        Samples in memory at a time (see CHUNK_SAMPLES).

    Returns
    -------
    (B, height, width) Tensor
        Line integrals, no unit.

    Raises
    ------
    ValueError
        A wrong shape or dtype, or a step that is not above 0.

    """
    _require_valid(volume, intrinsics, extrinsics, step_mm)
    affine, intrinsics, extrinsics = (
        torch.as_tensor(matrix).to(device=volume.device, dtype=torch.float64)
        for matrix in (affine, intrinsics, extrinsics)
    )
    views = len(extrinsics)
    rays = pixel_rays(affine, intrinsics.expand(views, 3, 3), extrinsics, height, width)
    enter, leave = cross_box(rays, volume.shape)
    step = step_mm or float(affine[:3, :3].norm(dim=0).min())
    counts = torch.ceil((leave - enter).detach() * rays.mm_per_depth.detach() / step - 1e-9).long()
    hit = counts.nonzero()[:, 0]
    per_depth = _LineIntegral.apply(
        volume,
        rays.origins[hit],
        rays.directions[hit],
        enter[hit],
        leave[hit],
        counts[hit],
        chunk_samples,
    )
    images = torch.zeros(len(counts), dtype=torch.float64, device=volume.device)
    images = images.index_put((hit,), per_depth * rays.mm_per_depth[hit])
    return images.to(volume.dtype).reshape(views, height, width)


class _LineIntegral(torch.autograd.Function):
    """Integral over depth of a volume along rays (R,), by chunks; backward renders each chunk again."""

    @staticmethod
    def forward(ctx, volume, origins, directions, enter, leave, counts, chunk_samples):
        """Sum every chunk of rays without a graph."""
        ctx.save_for_backward(volume, origins, directions, enter, leave, counts)
        ctx.chunk_samples = chunk_samples
        sums = torch.empty_like(enter)
        for rays in _chunks(counts, chunk_samples):
            sums[rays] = _integrate(
                volume, origins[rays], directions[rays], enter[rays], leave[rays], counts[rays]
            )
        return sums

    @staticmethod
    @once_differentiable
    def backward(ctx, *gradients):  # pyright: ignore[reportIncompatibleMethodOverride]
        """Differentiate chunk by chunk."""
        (gradient,) = gradients
        *inputs, counts = ctx.saved_tensors
        needed = [index for index in range(5) if ctx.needs_input_grad[index]]
        totals = {index: torch.zeros_like(inputs[index]) for index in needed}
        for rays in _chunks(counts, ctx.chunk_samples):
            with torch.enable_grad():
                part = [
                    tensor.detach() if index == 0 else tensor[rays].detach()
                    for index, tensor in enumerate(inputs)
                ]
                for index in needed:
                    part[index].requires_grad_()
                volume, origins, directions, enter, leave = part
                sums = _integrate(volume, origins, directions, enter, leave, counts[rays])
                found = torch.autograd.grad(sums, [part[index] for index in needed], gradient[rays])
            for index, value in zip(needed, found, strict=True):
                if index == 0:
                    totals[0] += value
                else:
                    totals[index][rays] = value
        return (*(totals.get(index) for index in range(5)), None, None)


def _integrate(
    volume: Tensor, origins: Tensor, directions: Tensor, enter: Tensor, leave: Tensor, counts: Tensor
) -> Tensor:
    """Integrals (R,) over depth from enter to leave by the midpoint rule with counts (R,) samples."""
    size = origins.new_tensor(volume.shape[::-1])
    # without aligned corners -1 and 1 are the faces of the box, half a voxel beyond the outer centres
    start = (2 * (origins + enter[:, None] * directions) + 1) / size - 1
    span = 2 * ((leave - enter)[:, None] * directions) / size
    number = torch.arange(int(counts.max()), dtype=volume.dtype, device=volume.device)
    fraction = (number + 0.5) / counts[:, None].to(volume.dtype)
    inside = fraction < 1
    grid = (
        start.to(volume.dtype)[:, None]
        + torch.where(inside, fraction, 0)[..., None] * span.to(volume.dtype)[:, None]
    )
    samples = _sample(volume, grid) * inside
    return samples.sum(-1).to(enter.dtype) * (leave - enter) / counts


def _sample(volume: Tensor, grid: Tensor) -> Tensor:
    """Trilinear samples (R, N) of a volume (D, H, W) at normalised points (R, N, 3)."""
    count = len(grid)
    lanes = 1
    if volume.device.type == "cpu" and not (volume.requires_grad and torch.is_grad_enabled()):
        lanes = min(torch.get_num_threads(), count)  # grid_sample uses one thread per image of a batch
    padding = -count % lanes
    if padding:
        grid = torch.cat([grid, grid[:padding]])
    grid = grid.reshape(lanes, 1, -1, grid.shape[1], 3)
    volume = volume.expand(lanes, 1, *volume.shape)
    samples = grid_sample(volume, grid, mode="bilinear", padding_mode="border", align_corners=False)
    return samples.reshape(count + padding, -1)[:count]


def _chunks(counts: Tensor, chunk_samples: int) -> list[slice]:
    """Consecutive slices of rays of at most chunk_samples samples each, one ray at least."""
    if not len(counts):
        return []
    rays = max(1, chunk_samples // int(counts.max()))
    return [slice(start, start + rays) for start in range(0, len(counts), rays)]


def _require_valid(volume: Tensor, intrinsics: Tensor, extrinsics: Tensor, step_mm: float | None) -> None:
    """Refuse shapes and steps that cannot be rendered."""
    if volume.ndim != 3 or not volume.is_floating_point():
        raise ValueError(
            f"volume has shape {tuple(volume.shape)} and dtype {volume.dtype}; "
            "give floating-point voxels (k, j, i)."
        )
    if extrinsics.ndim != 3 or tuple(extrinsics.shape[1:]) != (4, 4):
        raise ValueError(f"extrinsics has shape {tuple(extrinsics.shape)}; give (B, 4, 4).")
    if tuple(intrinsics.shape) not in {(3, 3), (1, 3, 3), (len(extrinsics), 3, 3)}:
        raise ValueError(
            f"intrinsics has shape {tuple(intrinsics.shape)}; give ({len(extrinsics)}, 3, 3), "
            "one matrix for each view, or one for all."
        )
    if step_mm is not None and not (math.isfinite(step_mm) and step_mm > 0):
        raise ValueError(f"step_mm is {step_mm}; give a number of mm above 0.")
