"""Slicer's markups, .mrk.json and .fcsv: control points are carried, everything else stays as it is."""

from __future__ import annotations

import copy
import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.table import FARTHEST_MM
from PolyPoseLib.io.carried.words import point_words
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, list_of, numbers, parse_object, string

RAS_TO_LPS = np.array([-1.0, -1.0, 1.0])

MARKUP_TYPES = ("Fiducial", "Line", "Angle", "Curve", "ClosedCurve")
"""Markups that are nothing but their control points; planes and regions of interest have axes as well."""

MAX_BYTES = 256 << 20

_FIDUCIAL_COLUMNS = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID"
_SYSTEMS = {"lps": -1, "1": -1, "ras": 1, "0": 1}


@dataclass(frozen=True)
class Markups:
    """The control points of a file, and how to write it again.

    Attributes
    ----------
    labels, points
        Of the N control points that have a position; (N, 3) LPS mm.
    lines : tuple of (int, int)
        Pairs of points that are one straight line: entry and target of a screw, say.
    fields : dict or list
        The file's content, as its format has it.
    places : tuple
        Where in the content each point is.
    signs : (N, 3) array
        By which LPS mm become the file's coordinates.

    """

    labels: tuple[str, ...]
    points: np.ndarray
    lines: tuple[tuple[int, int], ...]
    fields: Any
    places: tuple[Any, ...]
    signs: np.ndarray


def read_markups(path: Path) -> Markups:
    """Read Slicer's markups, whose name ends in .mrk.json; raises InputError that names the field and the fix."""
    record = Record(parse_object(read_text(path, "Slicer's markups", MAX_BYTES), str(path)), f"{path}: ")
    labels, points, lines, places, signs = [], [], [], [], []
    for n, markup in enumerate(record.required("markups", list_of(Record.within))):
        kind = markup.required("type", string)
        if kind not in MARKUP_TYPES:
            raise InputError(
                f'{path}: markup {n} is a "{kind[:40]}": give markups of the types {", ".join(MARKUP_TYPES)}.'
            )
        unit = markup.optional("coordinateUnits", string) or "mm"
        if unit != "mm":
            raise InputError(
                f'{path}: markup {n} has the coordinateUnits "{unit[:40]}": save it in millimetres.'
            )
        sign = _sign(markup.optional("coordinateSystem", string) or "LPS", path)
        first = len(points)
        for m, each in enumerate(markup.optional("controlPoints", list_of(Record.within)) or []):
            status = each.optional("positionStatus", string) or "defined"
            if status != "defined" and each.fields.get("position") is None:
                continue
            place = each.required("position", numbers(3, "a place in mm", FARTHEST_MM))
            labels.append(each.optional("label", string) or each.optional("id", string) or str(m + 1))
            points.append(np.array(place) * sign)
            signs.append(sign)
            places.append((n, m))
        if kind == "Line" and len(points) - first == 2:
            lines.append((first, first + 1))
    return _markups(path, labels, points, lines, dict(record.fields), places, signs)


def write_markups(path: Path, markups: Markups, carried: CarriedPoints, warning: str = "") -> None:
    """Write them again with carried control points, each described by what moved it and how certain it is."""
    fields = copy.deepcopy(markups.fields)
    for n, (markup, point) in enumerate(markups.places):
        each = fields["markups"][markup]["controlPoints"][point]
        each["position"] = (carried.points[n] * markups.signs[n]).tolist()
        each["description"] = _described(each.get("description"), point_words(carried, n, warning))
    for markup in fields["markups"]:
        markup.pop("measurements", None)  # lengths of the points as they were; Slicer computes them again
    path.write_text(json.dumps(fields, indent=4, allow_nan=False) + "\n", encoding="utf-8")


def read_fiducials(path: Path) -> Markups:
    """Read Slicer's older list of points, whose name ends in .fcsv; raises InputError that names the line."""
    text = read_text(path, "Slicer's list of points", MAX_BYTES)
    lines = text.splitlines()
    columns, sign = _FIDUCIAL_COLUMNS.split(","), RAS_TO_LPS  # of files that do not say
    for line in lines:
        name, _, value = line.lstrip("# ").partition("=")
        if not line.startswith("#"):
            continue
        if name.strip().lower() == "coordinatesystem":
            sign = _sign(value.strip(), path)
        elif name.strip().lower() == "columns":
            columns = [each.strip() for each in value.split(",")]
    if not {"x", "y", "z"} <= set(columns):
        raise InputError(
            f'{path}: its line "# columns" names no x, y and z: save the points again in Slicer.'
        )
    labels, points, places = [], [], []
    rows: list[list[str] | str] = []
    for number, line in enumerate(lines):
        if line.startswith("#") or not line.strip():
            rows.append(line)
            continue
        row = next(csv.reader([line]), [])
        row += [""] * (len(columns) - len(row))
        values = [row[columns.index(axis)] for axis in ("x", "y", "z")]
        try:
            place = np.array(values, dtype=np.float64)
        except ValueError:
            place = np.full(3, np.nan)
        if not (np.abs(place) <= FARTHEST_MM).all():
            raise InputError(
                f"{path}: line {number + 1} has no numbers as x, y and z: save it again in Slicer."
            )
        label = row[columns.index("label")] if "label" in columns else ""
        labels.append(label or str(len(points) + 1))
        points.append(place * sign)
        places.append((number, columns))
        rows.append(row)
    return _markups(path, labels, points, [], rows, places, [sign] * len(points))


def write_fiducials(path: Path, markups: Markups, carried: CarriedPoints, warning: str = "") -> None:
    """Write the list of points again."""
    rows: list[Any] = [each if isinstance(each, str) else list(each) for each in markups.fields]
    for n, (number, columns) in enumerate(markups.places):
        row, place = rows[number], carried.points[n] * markups.signs[n]
        for axis, value in zip("xyz", place, strict=True):
            row[columns.index(axis)] = f"{value:.6f}"
        if "desc" in columns:
            at = columns.index("desc")
            row[at] = _described(row[at], point_words(carried, n, warning))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for row in rows:
        if isinstance(row, str):
            out.write(row + "\n")
        else:
            writer.writerow(row)
    path.write_text(out.getvalue(), encoding="utf-8")


def _markups(
    path: Path,
    labels: Sequence[str],
    points: Sequence[np.ndarray],
    lines: Sequence[tuple[int, int]],
    fields: Any,
    places: Sequence[Any],
    signs: Sequence[np.ndarray],
) -> Markups:
    if not points:
        raise InputError(
            f"{path}: the file holds no control point with a position: place points and save it again."
        )
    return Markups(tuple(labels), np.array(points), tuple(lines), fields, tuple(places), np.array(signs))


def _sign(system: str, path: Path) -> np.ndarray:
    """(3,) by which coordinates of a system become LPS."""
    sign = _SYSTEMS.get(system.lower())
    if sign is None:
        raise InputError(f'{path}: the coordinate system "{system[:40]}" is not known: give LPS or RAS.')
    return np.ones(3) if sign < 0 else RAS_TO_LPS


def _described(earlier: Any, words: str) -> str:
    """A description with what was said of an earlier carrying replaced."""
    kept = str(earlier or "").split(" [moved by ")[0]
    kept = "" if kept.startswith("[moved by ") else kept
    return f"{kept} [{words}]".strip()
