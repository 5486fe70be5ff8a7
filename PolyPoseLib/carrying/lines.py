"""Straight lines, such as screws, carried as one rigid piece where a bone holds them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.carrying.points import PointCarrier
from PolyPoseLib.data.carried import CarriedPoints

STEP_MM = 0.5
"""Along a line, to see which bones hold it."""

MOST_STEPS = 2000

LEAST_SHARE = 0.25
"""Of a line inside a bone that makes it the bone's: a screw's entry lies on the surface, or beyond it."""


def carry_with_lines(
    carrier: PointCarrier, points: np.ndarray, lines: Sequence[tuple[int, int]], to: str
) -> CarriedPoints:
    """Carry points (N, 3), of which pairs are the ends of lines.

    The bone that holds most of a line, a quarter of it at least, moves both ends; the line keeps its length.
    Raises InputError as ``Result.transform_points``.
    """
    carried = carrier(points, to)
    for pair in lines:
        name = holding_bone(carrier, points[list(pair)], to)
        if name is not None:
            carried = carrier.rigidly(carried, points, pair, name, to)
    return carried


def holding_bone(carrier: PointCarrier, ends: np.ndarray, to: str) -> str | None:
    """Name of the bone in which most of a line between two ends (2, 3) lies, None where none holds enough of it."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    share = np.linspace(0, 1, min(MOST_STEPS, 2 + int(length / STEP_MM)))[:, None]
    names, counts = np.unique(
        carrier.bones_at(ends[0] * (1 - share) + ends[1] * share, to), return_counts=True
    )
    held = [(count, name) for name, count in zip(names.tolist(), counts.tolist(), strict=True) if name]
    if not held or max(held)[0] < LEAST_SHARE * len(share):
        return None
    return max(held)[1]
