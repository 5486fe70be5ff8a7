"""Metal and other things of simple shape in the patient's space: how long each pixel's ray runs inside them.

Exact chords through convex solids, joined where solids overlap; nothing is shared with the registration's renderer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from PolyPoseLib.geometry.camera import Camera

SUBPIXELS = 3
"""Rays per pixel along rows and columns: the edges of thin wires are smooth."""

STEEL, TITANIUM, COBALT_CHROME, LEAD, COPPER = 0.95, 0.35, 1.0, 5.0, 1.4
"""Linear attenuation in 1/mm at 60 keV (Hubbell and Seltzer, NISTIR 5632, 1995)."""

_SOFT, _HARD = 1.4, 0.6
"""Relative attenuation of the two halves of a spectrum that stands for beam hardening in metal."""

_FAR_MM = 1e6
_BAND_ROWS = 8
"""Rows that are computed at once; bounds the temporary memory."""


class Solid(Protocol):
    """A convex thing in world LPS mm."""

    def chord(self, source: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where unit rays (N, 3) from a source (3,) enter and leave, (N,) mm each; enter > leave for a miss."""
        ...

    def bounds(self) -> tuple[np.ndarray, float]:
        """Centre (3,) and radius in mm of a ball around the solid."""
        ...


@dataclass(frozen=True)
class Ellipsoid:
    """Axes (3, 3) as rows, each as long as its semi-axis in mm, about a centre (3,)."""

    centre: np.ndarray
    axes: np.ndarray

    @classmethod
    def ball(cls, centre: np.ndarray, radius: float) -> Ellipsoid:
        """A sphere."""
        return cls(np.asarray(centre, float), radius * np.eye(3))

    def chord(self, source: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Roots of the quadric."""
        to_unit = self.axes / (self.axes**2).sum(1, keepdims=True)
        start, slope = to_unit @ (source - self.centre), rays @ to_unit.T
        return _roots((slope**2).sum(1), slope @ start, float(start @ start) - 1)

    def bounds(self) -> tuple[np.ndarray, float]:
        """The longest semi-axis."""
        return self.centre, float(np.linalg.norm(self.axes, axis=1).max())


@dataclass(frozen=True)
class Rod:
    """A cylinder with flat ends from one point (3,) to another (3,), radius in mm."""

    start: np.ndarray
    end: np.ndarray
    radius: float

    def chord(self, source: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The infinite cylinder between two planes."""
        axis = np.asarray(self.end, float) - self.start
        length = float(np.linalg.norm(axis))
        axis = axis / length
        offset = source - self.start
        along, depth = rays @ axis, float(offset @ axis)
        across, start = rays - along[:, None] * axis, offset - depth * axis
        enter, leave = _roots((across**2).sum(1), across @ start, float(start @ start) - self.radius**2)
        return _within_slab(enter, leave, along, depth, 0.0, length)

    def bounds(self) -> tuple[np.ndarray, float]:
        """Half the diagonal."""
        half = (np.asarray(self.end, float) - self.start) / 2
        return self.start + half, float(np.hypot(np.linalg.norm(half), self.radius))


@dataclass(frozen=True)
class Box:
    """A cuboid: axes (3, 3) as rows, each as long as half of its side in mm, about a centre (3,)."""

    centre: np.ndarray
    axes: np.ndarray

    def chord(self, source: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Between three pairs of planes."""
        enter, leave = np.full(len(rays), -_FAR_MM), np.full(len(rays), _FAR_MM)
        for axis in self.axes:
            half = float(np.linalg.norm(axis))
            along, depth = rays @ (axis / half), float((source - self.centre) @ (axis / half))
            enter, leave = _within_slab(enter, leave, along, depth, -half, half)
        return enter, leave

    def bounds(self) -> tuple[np.ndarray, float]:
        """Half the diagonal."""
        return self.centre, float(np.sqrt((self.axes**2).sum()))


@dataclass(frozen=True)
class HalfBall:
    """The half of a ball on the side to which a unit normal (3,) points."""

    centre: np.ndarray
    radius: float
    normal: np.ndarray

    def chord(self, source: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A ball cut by a plane."""
        enter, leave = Ellipsoid.ball(self.centre, self.radius).chord(source, rays)
        depth = float((source - self.centre) @ self.normal)
        return _within_slab(enter, leave, rays @ self.normal, depth, 0.0, self.radius)

    def bounds(self) -> tuple[np.ndarray, float]:
        """The whole ball."""
        return self.centre, self.radius


def wire(points: Sequence[np.ndarray] | np.ndarray, radius: float) -> list[Solid]:
    """A wire of round section through points (N, 3): rods, with balls at the joints."""
    points = np.asarray(points, dtype=float)
    rods: list[Solid] = [Rod(a, b, radius) for a, b in pairwise(points)]
    return rods + [Ellipsoid.ball(point, radius) for point in points[1:-1]]


def path_lengths(solids: Sequence[Solid], camera: Camera, subpixels: int = SUBPIXELS) -> np.ndarray:
    """Length in mm of each sub-pixel's ray within the union of solids.

    Parameters
    ----------
    solids : sequence of Solid
        Of one material.
    camera : Camera
        Everything must lie before its detector.
    subpixels : int
        Rays per pixel along each axis.

    Returns
    -------
    ndarray (H, W, subpixels ** 2) float32

    """
    total = np.zeros((camera.height, camera.width, subpixels**2), np.float32)
    windows = [_window(solid, camera) for solid in solids]
    for top in range(0, camera.height, _BAND_ROWS):
        bottom = min(top + _BAND_ROWS, camera.height)
        some = [
            n
            for n, (rows, columns) in enumerate(windows)
            if rows.start < bottom and rows.stop > top and columns.stop > columns.start
        ]
        if some:
            left, right = min(windows[n][1].start for n in some), max(windows[n][1].stop for n in some)
            rays = _sub_rays(camera, (top, bottom), (left, right), subpixels)
            spans = np.full((len(some), len(rays), 2), np.inf, np.float32)
            for place, n in enumerate(some):
                enter, leave = solids[n].chord(camera.source, rays)
                hit = leave > enter
                spans[place, hit, 0], spans[place, hit, 1] = enter[hit], leave[hit]
            lengths = _union_length(spans)
            total[top:bottom, left:right] = lengths.reshape(bottom - top, right - left, -1)
    return total


def _sub_rays(camera: Camera, rows: tuple[int, int], columns: tuple[int, int], subpixels: int) -> np.ndarray:
    """Unit vectors (N, 3) from the source through the sub-pixels of a part of the image."""
    steps = (np.arange(subpixels) + 0.5) / subpixels - 0.5
    row, column, down, across = np.meshgrid(
        np.arange(*rows), np.arange(*columns), steps, steps, indexing="ij", sparse=True
    )
    shape = np.broadcast_shapes(row.shape, column.shape, down.shape, across.shape)
    y, x = np.broadcast_to(row + down, shape).ravel(), np.broadcast_to(column + across, shape).ravel()
    pixels = np.stack([x, y, np.ones_like(x)], axis=-1)
    rays = pixels @ (camera.extrinsic[:3, :3].T @ camera.inverse_intrinsics).T
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def metal_line(solids: Sequence[Solid], attenuation: float, camera: Camera) -> np.ndarray:
    """Line integrals (H, W) of things of one material, with beam hardening, as a pixel averages them.

    A pixel averages intensities, not line integrals; of a spectrum, the hard half goes through the metal.
    """
    return transmission_line(path_lengths(solids, camera), attenuation)


def transmission_line(lengths: np.ndarray, attenuation: float) -> np.ndarray:
    """Line integrals (H, W) from lengths (H, W, N) in mm of the rays of each pixel through metal of 1/mm."""
    line = np.float64(attenuation) * lengths
    through = 0.5 * (np.exp(-_SOFT * line) + np.exp(-_HARD * line)).mean(axis=-1)
    return -np.log(np.maximum(through, 1e-12))


def _window(solid: Solid, camera: Camera) -> tuple[slice, slice]:
    """Rows and columns that may see a solid."""
    centre, radius = solid.bounds()
    depth = float(camera.depth(centre))
    if depth <= radius:
        return slice(0, camera.height), slice(0, camera.width)
    middle = camera.project(centre)
    # A ball's outline is an ellipse that reaches beyond the projected radius off the axis: the margin covers it.
    reach = 1.3 * radius / (depth - radius) * np.array([camera.intrinsics[0, 0], camera.intrinsics[1, 1]]) + 2
    size = [camera.width, camera.height]
    low = np.clip(np.floor(middle - reach), 0, size).astype(int)
    high = np.clip(np.ceil(middle + reach) + 1, low, size).astype(int)
    return slice(low[1], high[1]), slice(low[0], high[0])


def _union_length(spans: np.ndarray) -> np.ndarray:
    """Length (N,) of the union of intervals (M, N, 2) of each of N rays; infinite ends are none."""
    order = np.argsort(spans[..., 0], axis=0)
    spans = np.take_along_axis(spans, order[..., None], axis=0)
    reached = np.full(spans.shape[1], -np.inf, np.float32)
    total = np.zeros(spans.shape[1], np.float32)
    for enter, leave in zip(spans[..., 0], spans[..., 1], strict=True):
        there = np.isfinite(enter)
        total[there] += np.maximum(leave[there] - np.maximum(enter[there], reached[there]), 0)
        reached[there] = np.maximum(reached[there], leave[there])
    return total


def _roots(square: np.ndarray, half: np.ndarray, constant: float) -> tuple[np.ndarray, np.ndarray]:
    """Both roots of square t^2 + 2 half t + constant, (N,) each; a miss enters at far and leaves before."""
    discriminant = half**2 - square * constant
    hit = (discriminant > 0) & (square > 1e-15)
    root, scale = np.sqrt(np.where(hit, discriminant, 0)), np.where(hit, square, 1)
    inside = (square <= 1e-15) & (constant < 0)  # parallel to a cylinder's axis, within it
    enter = np.where(hit, (-half - root) / scale, np.where(inside, -_FAR_MM, _FAR_MM))
    leave = np.where(hit, (-half + root) / scale, np.where(inside, _FAR_MM, -_FAR_MM))
    return enter, leave


def _within_slab(
    enter: np.ndarray, leave: np.ndarray, along: np.ndarray, depth: float, low: float, high: float
) -> tuple[np.ndarray, np.ndarray]:
    """Intervals of rays cut to where depth + t along lies between low and high."""
    flat = np.abs(along) < 1e-12
    slope = np.where(flat, 1.0, along)
    first, second = (low - depth) / slope, (high - depth) / slope
    near, far = np.minimum(first, second), np.maximum(first, second)
    outside = flat & ((depth < low) | (depth > high))
    near = np.where(flat, np.where(outside, _FAR_MM, -_FAR_MM), near)
    far = np.where(flat, np.where(outside, -_FAR_MM, _FAR_MM), far)
    return np.maximum(enter, near), np.minimum(leave, far)
