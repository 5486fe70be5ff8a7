"""The tables of the page: motions with intervals and doubts, and carried points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from PolyPoseLib.data.result import Result, StructureResult
from PolyPoseLib.viewer.content import NamedPoints

MOTION_HEADER = (
    "structure", "rotation °", "to left mm", "to back mm", "to head mm", "distance mm", "95 % along view mm",
    "95 % across mm", "95 % rotation °", "doubts",
)  # fmt: skip
POINT_HEADER = (
    "point", "in the CT (x, y, z) mm", "as X-rayed (x, y, z) mm", "moved mm", "95 % half axes mm", "moved by",
    "remarks",
)  # fmt: skip


def motion_rows(result: Result) -> list[list[str]]:
    """One row for every structure; the anchor, which defines the frame, has no motion."""
    return [_motion_row(name, each, name == result.anchor) for name, each in result.structures.items()]


def _motion_row(name: str, structure: StructureResult, anchor: bool) -> list[str]:
    doubts = "; ".join(structure.doubts) or "none found"
    if anchor:
        return [f"{name} (anchor)", *["–"] * 8, "; ".join(structure.doubts)]
    shift = np.asarray(structure.translation_mm, float)
    numbers = [number(structure.rotation_deg), *(number(each, sign=True) for each in shift)]
    return [name, *numbers, number(float(np.linalg.norm(shift))), *_intervals(structure.uncertainty), doubts]


def _intervals(uncertainty: Mapping[str, Any] | None) -> list[str]:
    """Along the views, the larger one across them, and the largest rotation's."""
    if not uncertainty:
        return ["not computed"] * 3
    turns = [uncertainty.get("rotation_about_view_deg"), *(uncertainty.get("rotation_across_deg") or ())]
    groups = ([uncertainty.get("along_mm")], uncertainty.get("across_mm") or (), turns)
    return [_largest([each for each in group if each is not None]) for group in groups]


def _largest(values: list[float]) -> str:
    return f"± {number(max(values))}" if values and np.isfinite(values).all() else "unknown"


def number(value: float, sign: bool = False) -> str:
    """A number with one decimal, without "-0.0"; "unknown" when it is none."""
    if not np.isfinite(value):
        return "unknown"
    rounded = round(float(value), 1) + 0.0
    return f"{rounded:+.1f}" if sign and rounded else f"{rounded:.1f}"


def point_rows(points: NamedPoints) -> list[list[str]]:
    """One row for every carried point."""
    carried, axes = points.carried, points.carried.semi_axes_mm
    rows = []
    for n, name in enumerate(points.names):
        known = np.isfinite(axes[n]).all()
        rows.append(
            [
                name,
                _place(points.in_ct[n]),
                _place(carried.points[n]),
                number(float(np.linalg.norm(carried.points[n] - points.in_ct[n]))),
                " × ".join(number(each) for each in axes[n][::-1]) if known else "unknown",
                carried.moved_by[n],
                "" if carried.inside[n] else "beyond the transform's grid: extrapolated",
            ]
        )
    return rows


def _place(point: np.ndarray) -> str:
    return ", ".join(number(each) for each in point)


def verdict(result: Result) -> tuple[str, str]:
    """How far the result can be relied on, in words, and "good", "caution" or "bad"."""
    if not result.trusted:
        return "Not to be trusted: " + " ".join(result.distrust), "bad"
    doubted = [name for name, each in result.structures.items() if each.doubts]
    if doubted:
        return f"Flagged as uncertain: {', '.join(doubted)} (reasons in the table).", "caution"
    if len(result.cameras) < 2:
        return (
            "One view only: positions along its rays are hardly known. Compare the outlines yourself.",
            "caution",
        )
    return "No sign of failure; compare the outlines yourself.", "good"
