"""An initial camera from DICOM's angles, distances, table and view position.

It assumes that the isocentre lies in the patient where the study says (`isocenter_mm`, or the point that
`place_isocenter` is given later, usually the anchor's centroid), that the patient lies as the file says, and that the
CT's axes are the patient's. It comes with the radius in which the true camera is expected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.carm import view_from_axes
from PolyPoseLib.io.xray.distance_checks import usable_source_distance
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.tags import XrayTags
from PolyPoseLib.io.xray.view_axes import ViewAxes, view_axes_of

KNOWN_ISOCENTER_MM = 30.0
"""Radius in mm where the file says which point of the patient was at the isocentre."""

UNKNOWN_DISTANCE_MM = 100.0
"""Added to the radius when the distance to the isocentre had to be assumed."""

USUAL_SOURCE_SHARE = 0.7
"""Usual share of the source's distance to the isocentre in that to the detector."""

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Pose:
    """Where an X-ray was probably taken from.

    Attributes
    ----------
    extrinsic
        (4, 4) world LPS mm to camera, of the image as seen from the source.
    mirrored
        Whether the stored image is its mirror image.
    radius
        (degrees, mm) within which the truth is expected.
    isocenter
        (3,) LPS mm, the point that is put at the isocentre.
    table_mm
        (3,) LPS, how far the table had carried the patient, from an arbitrary zero; None if unknown.

    """

    extrinsic: np.ndarray
    mirrored: bool
    radius: tuple[float, float]
    isocenter: Point
    table_mm: Point | None


def pose_of(
    tags: XrayTags | None,
    fields: XrayFields,
    source_to_detector_mm: float,
    isocenter: Sequence[float] | None,
    notes: Notes,
) -> Pose | None:
    """Initial camera, or None when nothing gives the direction.

    Parameters
    ----------
    tags
        The frame's attributes, None for files that are not DICOM.
    fields
        The study file's entry.
    source_to_detector_mm
        Distance to the detector.
    isocenter
        (3,) LPS mm, used unless the fields or the file give one.
    notes
        Receives every assumption.

    """
    view = view_axes_of(tags, fields, notes)
    if view is None:
        return None
    if fields.mirrored is not None:
        stored_mirrored = np.dot(np.cross(view.columns, view.rows), view.beam) < 0
        if stored_mirrored != fields.mirrored:
            view = replace(view, columns=-view.columns)
    distance, assumed = _source_to_isocenter(tags, fields, view, source_to_detector_mm, notes)
    point, radius_mm = _isocenter(view, fields, isocenter, notes)
    extrinsic, mirrored = view_from_axes(view.columns, view.rows, view.beam, distance, point)
    radius = (view.radius[0], radius_mm + (UNKNOWN_DISTANCE_MM if assumed else 0))
    notes.say(f"extrinsic: an initial estimate, expected within {radius[0]:g} degrees and {radius[1]:g} mm")
    table = None if view.table_mm is None else _point(view.table_mm)
    return Pose(extrinsic, mirrored, radius, _point(point), table)


def _point(values: ArrayLike) -> Point:
    """Three numbers (3,) as plain floats."""
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return x, y, z


def _source_to_isocenter(
    tags: XrayTags | None, fields: XrayFields, view: ViewAxes, source_to_detector_mm: float, notes: Notes
) -> tuple[float, bool]:
    """Distance from the source to the isocentre in mm, and whether it was only assumed."""
    given = fields.source_to_isocenter_mm
    if given is not None:
        if given >= source_to_detector_mm:
            raise InputError(
                f'{notes.where}: "source_to_isocenter_mm" is {given:g}, not below the detector\'s distance '
                f"{source_to_detector_mm:g}; give the distance to the isocentre."
            )
        notes.say(f"source_to_isocenter_mm {given:g} from {notes.entry}")
        return given, False
    stated = [(tags.positive(key), key) for key in view.source_keys] if tags else []
    if view.virtual_plane:  # an RT image may lie at the isocentre itself
        found, key = next(((value, key) for value, key in stated if value is not None), (None, ""))
    else:
        found, key = usable_source_distance(stated, source_to_detector_mm, notes)
    if found is not None:
        notes.say(f"source_to_isocenter_mm {found:g} from DICOM {key}")
        return found, False
    factor = tags.number("EstimatedRadiographicMagnificationFactor") if tags else None
    share = 1 / factor if factor and 1 < factor < 4 else USUAL_SOURCE_SHARE
    assumed = share * source_to_detector_mm
    notes.say(f"source_to_isocenter_mm {assumed:g}: assumed, {share:.2f} of the distance to the detector")
    return assumed, True


def _isocenter(
    view: ViewAxes, fields: XrayFields, isocenter: Sequence[float] | None, notes: Notes
) -> tuple[np.ndarray, float]:
    """Point (3,) at the isocentre, and the radius in mm that goes with its origin."""
    for point, source, radius in (
        (fields.isocenter_mm, notes.entry, view.radius[1]),
        (view.isocenter, "DICOM (300A,012C)", KNOWN_ISOCENTER_MM),
        (isocenter, "the caller", view.radius[1]),
    ):
        if point is not None:
            notes.say(f"isocentre at {shown(point)} mm from {source}")
            return np.asarray(point, dtype=np.float64), radius
    notes.say("isocentre at the world's origin until it is placed")
    return np.zeros(3), view.radius[1]
