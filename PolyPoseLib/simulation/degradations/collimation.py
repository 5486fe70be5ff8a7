"""Collimators: leaves of lead in the beam with a penumbra; scatter and noise remain behind them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter

from PolyPoseLib.simulation.degradations.anatomy import bone_points
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View
from PolyPoseLib.simulation.degradations.detector import LEAF_TRANSMISSION

PENUMBRA_MM = 1.8
"""Standard deviation at the detector of an edge's blur: a focal spot of 1 mm, leaves 250 mm from it."""

SHARE_SHOWN = 0.92
"""Of every bone that one leaf leaves in sight, at least."""

SUBPIXELS = 4


def collimation_square(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Four leaves along the image's sides, as they come off the detector."""
    shown = _shown_bones(degraded)
    return degraded.with_views(lambda view, _: _collimated(view, *_square(view, shown, rng)))


def collimation_tilted(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Four leaves turned by 8 to 20 degrees, each by a little of its own."""
    shown = _shown_bones(degraded)

    def close(view: View, _: int) -> View:
        turn = np.radians(rng.uniform(8, 20)) * rng.choice([-1, 1])
        angles = turn + np.arange(4) * np.pi / 2 + np.radians(rng.uniform(-2, 2, 4))
        return _collimated(view, angles, _reach(view, shown, angles, rng.uniform(0.80, 0.95, 4)))

    return degraded.with_views(close)


def collimation_black(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Four leaves along the image's sides, painted black by the workstation a little outside of their edges."""
    shown = _shown_bones(degraded)

    def close(view: View, _: int) -> View:
        angles, reach = _square(view, shown, rng)
        return _painted(_collimated(view, angles, reach), _half_planes(view, angles, reach + 0.012))

    return degraded.with_views(close)


def collimation_round(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """An iris, painted black outside."""
    shown = _shown_bones(degraded)

    def close(view: View, _: int) -> View:
        centre, least = rng.uniform(-0.03, 0.03, 2), rng.uniform(0.93, 1.0)
        away = [np.linalg.norm(_places(view, points) - centre, axis=1) for points in shown]
        radius = max(least, *(float(np.quantile(each, SHARE_SHOWN)) for each in away))
        iris = _soft(view, _disc(view, centre, radius))
        leaves = iris if view.leaves is None else view.leaves * iris
        return _painted(replace(view, leaves=leaves), _disc(view, centre, radius + 0.01))

    return degraded.with_views(close)


def _shown_bones(degraded: DegradedCase) -> list[np.ndarray]:
    """Points (N, 3) of every structure: a person collimates to what is to be seen."""
    return [bone_points(degraded.case, name)[::5] for name in degraded.case.structures.names]


def _square(view: View, shown: list[np.ndarray], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Directions (4,) in rad of the leaves' normals, and how far each is open, 1 being the image's side."""
    angles = np.arange(4) * np.pi / 2
    return angles, _reach(view, shown, angles, rng.uniform(0.74, 0.94, 4))


def _reach(view: View, shown: list[np.ndarray], angles: np.ndarray, least: np.ndarray) -> np.ndarray:
    """How far (M,) leaves are open that are at least so far (M,) open and hide little of any bone."""
    normals = np.stack([np.cos(angles), np.sin(angles)])
    needed = [np.quantile(_places(view, points) @ normals, SHARE_SHOWN, axis=0) for points in shown]
    return np.maximum(least, np.max(needed, axis=0))


def _places(view: View, points: np.ndarray) -> np.ndarray:
    """Where points (N, 3) appear, (N, 2), from the image's middle; 1 is half of the smaller side."""
    height, width = view.line.shape
    return (view.camera.project(points) - [(width - 1) / 2, (height - 1) / 2]) / (min(height, width) / 2)


def _collimated(view: View, angles: np.ndarray, reach: np.ndarray) -> View:
    """The view with leaves whose normals point into these directions."""
    open_share = _soft(view, _half_planes(view, angles, reach))
    return replace(view, leaves=open_share if view.leaves is None else view.leaves * open_share)


def _half_planes(view: View, angles: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Coverage (H, W) of what lies within all edges."""
    x, y = _coordinates(view)
    inside = np.ones_like(x, dtype=bool)
    for angle, limit in zip(angles, reach, strict=True):
        inside &= x * np.cos(angle) + y * np.sin(angle) < limit
    return _averaged(inside, view.line.shape)


def _disc(view: View, centre: np.ndarray, radius: float) -> np.ndarray:
    """Coverage (H, W) of a disc; 1 is half of the image's smaller side."""
    x, y = _coordinates(view)
    return _averaged((x - centre[0]) ** 2 + (y - centre[1]) ** 2 < radius**2, view.line.shape)


def _coordinates(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Places x and y of sub-pixels from the image's middle; 1 is half of the smaller side."""
    height, width = view.line.shape
    half = min(height, width) / 2
    rows = ((np.arange(height * SUBPIXELS) + 0.5) / SUBPIXELS - height / 2) / half
    columns = ((np.arange(width * SUBPIXELS) + 0.5) / SUBPIXELS - width / 2) / half
    x, y = np.meshgrid(columns, rows)
    return x, y


def _averaged(inside: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Means (H, W) over the sub-pixels."""
    return inside.reshape(shape[0], SUBPIXELS, shape[1], SUBPIXELS).mean(axis=(1, 3))


def _soft(view: View, coverage: np.ndarray) -> np.ndarray:
    """Share of the beam (H, W) behind edges with a penumbra."""
    blurred = gaussian_filter(coverage, PENUMBRA_MM / np.array(view.stated.pixel_spacing_mm), mode="nearest")
    return LEAF_TRANSMISSION + (1 - LEAF_TRANSMISSION) * blurred


def _painted(view: View, coverage: np.ndarray) -> View:
    """The view with everything outside of a coverage (H, W) painted over."""
    outside = coverage < 0.5
    return replace(view, blanked=outside if view.blanked is None else view.blanked | outside)
