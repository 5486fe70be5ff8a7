"""Signed distances from simple shapes, and how shapes are joined and cut smoothly.

Distances are below 0 inside. They are exact near a surface and approximate far from it.

References
----------
J. Hart, "Sphere tracing: a geometric method for the antialiased ray tracing of implicit surfaces", The Visual Computer
12, 1996.

"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Points = tuple[np.ndarray, np.ndarray, np.ndarray]
"""x, y and z in mm, of shapes that broadcast to (k, j, i)."""


def ellipsoid(points: Points, centre: Sequence[float], radii: Sequence[float]) -> np.ndarray:
    """Distance (k, j, i) in mm from an ellipsoid along x, y and z: the implicit function over its gradient's length."""
    scaled = [(p - np.float32(c)) / np.float32(r) for p, c, r in zip(points, centre, radii, strict=True)]
    level = np.sqrt(sum(s * s for s in scaled))
    slope = np.sqrt(sum((s / np.float32(r)) ** 2 for s, r in zip(scaled, radii, strict=True)))
    middle = -np.float32(min(radii))
    return np.where(slope > 1e-6, level * (level - 1) / np.maximum(slope, 1e-6), middle).astype(np.float32)


def round_cone(
    points: Points, start: Sequence[float], end: Sequence[float], first: float, last: float
) -> np.ndarray:
    """Distance (k, j, i) in mm from a rod with round ends whose radius changes evenly from first to last (mm)."""
    axis = np.subtract(end, start)
    along = sum((p - np.float32(s)) * np.float32(a) for p, s, a in zip(points, start, axis, strict=True))
    along = np.clip(along / np.float32(axis @ axis), 0, 1)
    away = np.sqrt(
        sum(
            (p - np.float32(s) - along * np.float32(a)) ** 2
            for p, s, a in zip(points, start, axis, strict=True)
        )
    )
    return (away - (first + along * np.float32(last - first))).astype(np.float32)


def joined(first: np.ndarray, second: np.ndarray, rounding: float) -> np.ndarray:
    """Distance from two shapes together; where they meet the surface is rounded over so many mm."""
    near = np.maximum(rounding - np.abs(first - second), 0) / np.float32(rounding)
    return np.minimum(first, second) - near * near * np.float32(rounding / 4)


def without(first: np.ndarray, second: np.ndarray, rounding: float) -> np.ndarray:
    """Distance from what of the first shape lies outside the second, with a rounded edge."""
    return -joined(-first, second, rounding)
