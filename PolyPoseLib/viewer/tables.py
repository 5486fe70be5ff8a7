"""The tables of the page: motions with intervals and doubts, and carried points; what they say is the report's."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.result import Result
from PolyPoseLib.io.report.words import CELLS, bone_lines, number
from PolyPoseLib.viewer.content import NamedPoints

MOTION_HEADER = ("structure", *CELLS, "doubts")
POINT_HEADER = (
    "point", "in the CT: x, y, z (mm)", "as X-rayed: x, y, z (mm)", "moved (mm)", "95 % half axes (mm)", "moved by",
    "remarks",
)  # fmt: skip


def motion_rows(result: Result) -> list[list[str]]:
    """One row for every structure; the anchor, which defines the frame, has no motion."""
    rows = []
    for line in bone_lines(result):
        name = f"{line.name} (anchor)" if line.name == result.anchor else line.name
        doubts = "; ".join(line.doubts) or ("" if line.still else "none found")
        rows.append([name, *line.cells, *line.intervals, doubts])
    return rows


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
