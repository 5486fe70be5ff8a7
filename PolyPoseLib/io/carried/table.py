"""Tables of points: CSV with label, x, y and z in LPS millimetres; the written one adds covariances and what moved."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text

COVARIANCE = {"xx": (0, 0), "xy": (0, 1), "xz": (0, 2), "yy": (1, 1), "yz": (1, 2), "zz": (2, 2)}
"""Columns of the covariance, mm^2, and their places in the matrix."""

COLUMNS = ("label", "x", "y", "z", *COVARIANCE, "moved_by", "inside")
"""Of the written table; the first four are read, the others may be there."""

MAX_BYTES = 256 << 20
"""Of a table; ten million points have no more."""

FARTHEST_MM = 1e5
"""No patient has points farther from the origin."""


def read_table(path: Path) -> tuple[list[str], np.ndarray]:
    """Labels and points (N, 3), LPS mm, of a CSV file; raises InputError that names line and fix."""
    text = read_text(path, "a CSV file with the columns label,x,y,z", MAX_BYTES)
    if not text.strip():
        raise InputError(f"{path}: the file is empty: begin with label,x,y,z (LPS millimetres).")
    rows = csv.reader(io.StringIO(text, newline=""))
    labels: list[str] = []
    points: list[tuple[float, ...]] = []
    try:
        header = [each.strip().lower() for each in next(rows, [])]
        missing = [name for name in COLUMNS[:4] if header.count(name) != 1]
        for sign, name in ((";", "semicolons"), ("\t", "tabs")):
            if missing and sum(each.count(sign) for each in header) >= 3:
                raise InputError(
                    f"{path}: its columns are separated by {name}: save it with commas, and numbers with decimal "
                    "points."
                )
        if missing:
            raise InputError(
                f'{path}: the first line has no column "{missing[0]}" or several: begin with label,x,y,z '
                "(LPS millimetres)."
            )
        places = [header.index(name) for name in COLUMNS[:4]]
        for row in rows:
            if not any(each.strip() for each in row):
                continue
            labels.append(row[places[0]] if len(row) > places[0] else "")
            points.append(_point(row, places[1:], rows.line_num, path))
    except csv.Error as error:
        raise InputError(f"{path}: line {rows.line_num} is no CSV ({error}): correct it there.") from error
    if not points:
        raise InputError(f"{path}: the table holds no points: add a line for each below label,x,y,z.")
    return labels, np.array(points)


def write_table(path: Path, labels: Sequence[str], carried: CarriedPoints) -> None:
    """Write carried points as CSV; numbers that are not known are empty."""
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for n, label in enumerate(labels):
            covariance = [carried.covariances[n][place] for place in COVARIANCE.values()]
            writer.writerow(
                [
                    label,
                    *(f"{each:.6f}" for each in carried.points[n]),
                    *(f"{each:.8g}" if np.isfinite(each) else "" for each in covariance),
                    carried.moved_by[n],
                    "yes" if carried.inside[n] else "no",
                ]
            )


def _point(row: list[str], places: list[int], line: int, path: Path) -> tuple[float, ...]:
    """x, y and z of one line; raises InputError for what is no place in mm."""
    numbers = []
    for name, place in zip("xyz", places, strict=True):
        text = row[place].strip() if len(row) > place else ""
        try:
            number = float(text)
        except ValueError:
            number = float("nan")
        if not abs(number) <= FARTHEST_MM:
            raise InputError(
                f'{path}: line {line} has "{text[:40]}" as {name}: give a number, LPS millimetres.'
            )
        numbers.append(number)
    return tuple(numbers)
