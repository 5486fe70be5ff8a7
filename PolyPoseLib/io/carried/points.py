"""Files of points, whatever their kind: what they hold, and how it is written again once it was carried."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.io.carried.markups import read_fiducials, read_markups, write_fiducials, write_markups
from PolyPoseLib.io.carried.screws import read_screws, write_screws
from PolyPoseLib.io.carried.table import read_table, write_table

POINT_ENDINGS = (".csv", ".mrk.json", ".fcsv", ".json")


@dataclass(frozen=True)
class PointFile:
    """The content of a file of points.

    Attributes
    ----------
    labels : tuple of str
        Of the N points.
    points : (N, 3) array
        LPS mm.
    lines : tuple of (int, int)
        Pairs of points that a straight line joins.
    write : callable
        Writes the same kind of file, from its path, the carried points, and a warning or "".

    """

    labels: tuple[str, ...]
    points: np.ndarray
    lines: tuple[tuple[int, int], ...]
    write: Callable[[Path, CarriedPoints, str], None]


def read_points(path: Path, kind: str) -> PointFile:
    """Read a file of a kind of POINT_ENDINGS; raises InputError that names the field and the fix."""
    if kind == ".csv":
        labels, points = read_table(path)
        return PointFile(tuple(labels), points, (), lambda to, carried, _: write_table(to, labels, carried))
    if kind == ".json":
        plan = read_screws(path)
        lines = tuple((n, n + 1) for n in range(0, len(plan.points), 2))
        return PointFile(
            plan.labels,
            plan.points,
            lines,
            lambda to, carried, warning: write_screws(to, plan, carried, warning),
        )
    fiducials = kind == ".fcsv"
    markups = read_fiducials(path) if fiducials else read_markups(path)
    write = write_fiducials if fiducials else write_markups
    return PointFile(
        markups.labels,
        np.asarray(markups.points, dtype=np.float64),
        markups.lines,
        lambda to, carried, warning: write(to, markups, carried, warning),
    )
