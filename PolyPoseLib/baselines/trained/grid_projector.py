"""Line integrals through volumes on the network's grid, differentiable: for losses that compare X-rays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.geometry.camera import Camera


class GridProjector:
    """The X-rays of volumes on one grid through one set of cameras.

    Parameters
    ----------
    grid : NetworkGrid
        Where the volumes are.
    cameras : Sequence[Camera]
        Of the images that the renderings are compared with.

    Notes
    -----
    A sum over as many samples as the grid has nodes along an axis, between the depths at which a ray enters and leaves
    the grid's box.

    """

    def __init__(self, grid: NetworkGrid, cameras: Sequence[Camera]) -> None:
        self.samples: list[Tensor] = []
        self.steps: list[Tensor] = []
        for camera in cameras:
            directions = camera.pixel_directions()  # to depth 1 mm
            near, far = self._depths(grid, camera.source, directions)
            share = (np.arange(grid.side) + 0.5) / grid.side
            depths = near[..., None] + (far - near)[..., None] * share
            points = camera.source + depths[..., None] * directions[..., None, :]
            self.samples.append(torch.from_numpy(grid.normalised(points).astype(np.float32)))
            length = (far - near) * np.linalg.norm(directions, axis=-1) / grid.side
            self.steps.append(torch.from_numpy(length.astype(np.float32)))

    @staticmethod
    def _depths(
        grid: NetworkGrid, source: np.ndarray, directions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Depths (H, W) at which rays enter and leave the grid's box; both 0 for rays that miss it."""
        start = grid.normalised(source)
        along = directions @ np.linalg.inv(grid.half_axes).T
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([(-1 - start) / along, (1 - start) / along])
        near = np.nanmax(ends.min(axis=0), axis=-1).clip(min=0)
        far = np.nanmin(ends.max(axis=0), axis=-1)
        missed = ~(far > near)
        return np.where(missed, 0, near), np.where(missed, 0, far)

    def __call__(self, volume: Tensor) -> list[Tensor]:
        """Of every camera, line integrals (B, H, W) in mm through volumes (B, 1, k, j, i) from -1 (air) to 1."""
        images = []
        for samples, step in zip(self.samples, self.steps, strict=True):
            at = samples.to(volume.device)[None].expand(len(volume), -1, -1, -1, -1)
            values = F.grid_sample(volume + 1, at, padding_mode="zeros", align_corners=True)
            images.append(values[:, 0].sum(dim=-1) * step.to(volume.device))
        return images
