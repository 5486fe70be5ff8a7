"""The bones' motions as people read them: a table, absolute or relative to one of the bones."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _

from .frames import flip_vectors

MOTIONS_ATTRIBUTE = "PolyPose.Motions"
"""Attribute of the table node with all motions as JSON, so that they outlive the scene file."""

DECIMALS = 6
"""Numbers in tables are rounded to these."""


@dataclass(frozen=True)
class Motion:
    """The motion of one structure from the CT to the posture of the X-rays.

    matrix: (4, 4) moving to fixed, LPS mm. centroid: (3,) of the structure in the CT, LPS mm, or None.
    uncertainty: as in the result. doubts: why not to rely on it, one clause each.
    """

    matrix: np.ndarray
    centroid: np.ndarray | None = None
    uncertainty: Mapping[str, Any] | None = None
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class MotionRow:
    """One line of the table: angle in degrees, unit axis and centroid displacement in mm, both in RAS."""

    name: str
    rotation_deg: float
    axis: np.ndarray
    translation_mm: np.ndarray
    uncertainty: dict[str, float]
    doubts: tuple[str, ...] = ()


def motion_rows(motions: Mapping[str, Motion], relative_to: str | None = None) -> list[MotionRow]:
    """The lines of the table; relative_to names the structure that is held still, None the anchor's frame.

    Relative motions have no uncertainty: that of two structures does not add up simply.
    """
    base = np.eye(4) if relative_to is None else np.linalg.inv(motions[relative_to].matrix)
    return [_row(name, base @ each.matrix, each, relative_to is None) for name, each in motions.items()]


def _row(name: str, matrix: np.ndarray, motion: Motion, absolute: bool) -> MotionRow:
    rotation = matrix[:3, :3]
    # Both formulas lose digits at one end of the range; atan2 of the two does not.
    twist = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    angle = np.arctan2(np.linalg.norm(twist), np.trace(rotation) - 1.0)
    centroid = np.zeros(3) if motion.centroid is None else motion.centroid
    shift = rotation @ centroid + matrix[:3, 3] - centroid
    uncertainty = interval_columns(motion.uncertainty or {}) if absolute else {}
    return MotionRow(
        name,
        float(np.degrees(angle)),
        flip_vectors(_axis(rotation, twist)),
        flip_vectors(shift),
        uncertainty,
        motion.doubts if absolute else (),
    )


def _axis(rotation: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """The unit axis of a rotation, (3,); at half a turn the twist vanishes and the eigenvector is left."""
    length = np.linalg.norm(twist)
    if length > 1e-6:
        return twist / length
    if np.trace(rotation) > 0:
        return np.array([0.0, 0.0, 1.0])
    values, vectors = np.linalg.eigh((rotation + rotation.T) / 2)
    return vectors[:, np.argmax(values)]


def interval_columns(uncertainty: Mapping[str, Any]) -> dict[str, float]:
    """The intervals that a table shows, by the columns' titles; the larger of two directions.

    uncertainty: as PolyPoseLib.registration.uncertainty gives it, half widths in mm and degrees at a level.
    """
    percent = 100 * float(uncertainty.get("level", 0.95))
    columns = {}
    for key, title in (
        ("along_mm", _("{percent:.0f} % along the beam [mm]")),
        ("across_mm", _("{percent:.0f} % across the beam [mm]")),
        ("rotation_about_view_deg", _("{percent:.0f} % about the beam [deg]")),
        ("rotation_across_deg", _("{percent:.0f} % across the beam [deg]")),
    ):
        if uncertainty.get(key) is not None:
            columns[title.format(percent=percent)] = float(np.max(uncertainty[key]))
    return columns


def fill_motion_table(
    node: slicer.vtkMRMLTableNode, motions: Mapping[str, Motion], relative_to: str | None = None
) -> None:
    """Write the motions into a table node, replacing what it held."""
    rows = motion_rows(motions, relative_to)
    extra = list(dict.fromkeys(name for row in rows for name in row.uncertainty))
    columns: dict[str, list] = {
        _("Structure"): [row.name for row in rows],
        _("Rotation [deg]"): [row.rotation_deg for row in rows],
        _("Displacement [mm]"): [float(np.linalg.norm(row.translation_mm)) for row in rows],
    }
    for index, side in enumerate((_("Right [mm]"), _("Anterior [mm]"), _("Superior [mm]"))):
        columns[side] = [float(row.translation_mm[index]) for row in rows]
    for index, side in enumerate((_("Axis R"), _("Axis A"), _("Axis S"))):
        columns[side] = [float(row.axis[index]) for row in rows]
    for name in extra:
        columns[name] = [row.uncertainty.get(name, float("nan")) for row in rows]
    if any(row.doubts for row in rows):
        columns[_("Doubts")] = ["; ".join(row.doubts) for row in rows]
    set_table(node, columns)
    node.SetAttribute(MOTIONS_ATTRIBUTE, motions_to_text(motions))


def set_table(node: slicer.vtkMRMLTableNode, columns: Mapping[str, list]) -> None:
    """Replace a table node's columns by lists of texts or numbers."""
    was = node.StartModify()
    node.RemoveAllColumns()
    for name, values in columns.items():
        column = _text_column(values) if values and isinstance(values[0], str) else _number_column(values)
        column.SetName(name)
        node.AddColumn(column)
    node.SetUseColumnTitleAsColumnHeader(False)
    node.EndModify(was)


def _text_column(texts: list[str]) -> vtk.vtkStringArray:
    column = vtk.vtkStringArray()
    for text in texts:
        column.InsertNextValue(text)
    return column


def _number_column(numbers: list[float]) -> vtk.vtkDoubleArray:
    column = vtk.vtkDoubleArray()
    for number in numbers:
        column.InsertNextValue(round(float(number), DECIMALS) + 0.0)  # no minus zero
    return column


def motions_to_text(motions: Mapping[str, Motion]) -> str:
    """All motions as JSON."""
    return json.dumps(
        {
            name: {
                "matrix": each.matrix.tolist(),
                "centroid": None if each.centroid is None else each.centroid.tolist(),
                "uncertainty": None if each.uncertainty is None else dict(each.uncertainty),
                "doubts": list(each.doubts),
            }
            for name, each in motions.items()
        }
    )


def motions_of(node: slicer.vtkMRMLTableNode | None) -> dict[str, Motion]:
    """The motions that a table node was filled with, empty for any other node."""
    text = node.GetAttribute(MOTIONS_ATTRIBUTE) if node is not None else None
    return {
        name: Motion(
            np.array(each["matrix"], dtype=np.float64),
            None if each["centroid"] is None else np.array(each["centroid"], dtype=np.float64),
            each["uncertainty"],
            tuple(each.get("doubts", ())),  # tables of earlier versions have none
        )
        for name, each in json.loads(text or "{}").items()
    }
