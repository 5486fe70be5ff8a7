"""The rays of a camera that cross a box, and where samples lie on them: constants while the camera stands still."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid


@dataclass(frozen=True)
class RaySamples:
    """Samples at equal distances along R rays.

    Attributes
    ----------
    pixels : np.ndarray
        (R,) int64 row-major numbers of the rays' pixels.
    first, step : np.ndarray
        (R, 3) float64 mm, the first sample and the vector to the next one, relative to ``centre``.
    count : np.ndarray
        (R,) int32, at least 1.
    centre : np.ndarray
        (3,) LPS mm.
    step_mm : float
        Length of a step, the same for all rays.
    height, width : int
        Of the camera's image.

    """

    pixels: np.ndarray
    first: np.ndarray
    step: np.ndarray
    count: np.ndarray
    centre: np.ndarray
    step_mm: float
    height: int
    width: int

    @property
    def rays(self) -> int:
        """Number of rays R."""
        return len(self.pixels)

    def part(self, start: int, stop: int) -> RaySamples:
        """Rays start..stop."""
        rays = slice(start, stop)
        return RaySamples(
            self.pixels[rays], self.first[rays], self.step[rays], self.count[rays],
            self.centre, self.step_mm, self.height, self.width,
        )  # fmt: skip

    def chunks(self, samples: int) -> list[RaySamples]:
        """Consecutive parts of at most about ``samples`` samples each, one ray at least."""
        if not self.rays:
            return []
        number = (np.cumsum(self.count) - 1) // samples
        edges = [int(n) + 1 for n in np.flatnonzero(np.diff(number))]
        return [self.part(a, b) for a, b in zip([0, *edges], [*edges, self.rays], strict=True)]

    def to_image(self, values: np.ndarray) -> np.ndarray:
        """Values (R, ...) of the rays as images (..., height, width), 0 where no ray crosses the box."""
        flat = np.zeros((*values.shape[1:], self.height * self.width), values.dtype)
        flat[..., self.pixels] = np.moveaxis(values, 0, -1)
        return flat.reshape(*values.shape[1:], self.height, self.width)


def sample_rays(
    camera: Camera, volume: Grid, centre: np.ndarray, step_mm: float, margin_mm: float = 0.0
) -> RaySamples:
    """Samples of a camera's rays inside the box of a volume.

    Parameters
    ----------
    camera : Camera
        One ray goes through every pixel's centre.
    volume : Grid
        With orthogonal axes; the box ends at the outer voxels' centres.
    centre : (3,) ndarray
        LPS mm that the samples are counted from.
    step_mm : float
        Distance of the samples. They lie at (n + 1/2) steps from the source, as in ``kernels.project``.
    margin_mm : float
        By which the box is made larger on every side.

    Returns
    -------
    RaySamples
        Of the rays that cross the box.

    """
    affine, shape = volume.affine, volume.voxels.shape
    to_index = np.linalg.inv(affine)
    directions = camera.pixel_directions().reshape(-1, 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    source = to_index[:3, :3] @ camera.source + to_index[:3, 3]
    slope = directions @ to_index[:3, :3].T
    slope = np.where(np.abs(slope) < 1e-12, 1e-12, slope)
    margin = margin_mm / np.linalg.norm(affine[:3, :3], axis=0)
    low, high = (-margin - source) / slope, (np.array(shape[::-1]) - 1 + margin - source) / slope
    near = np.maximum(np.minimum(low, high).max(axis=1), 0)
    far = np.maximum(low, high).min(axis=1)
    number = np.ceil(near / step_mm - 0.5)
    count = np.floor(far / step_mm - 0.5) - number + 1
    hit = np.flatnonzero(count >= 1)
    depth = (number[hit] + 0.5) * step_mm
    return RaySamples(
        pixels=hit,
        first=camera.source - centre + depth[:, None] * directions[hit],
        step=step_mm * directions[hit],
        count=count[hit].astype(np.int32),
        centre=np.asarray(centre, float),
        step_mm=step_mm,
        height=camera.height,
        width=camera.width,
    )
