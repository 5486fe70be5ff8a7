"""An initial camera from DICOM's angles, distances, table and view position, with an honest radius.

A guess and nothing more: it assumes that the isocentre lies in the patient where the study says
(`isocenter_mm`, or the point that `place_isocenter` is given later, usually the anchor's centroid), that
the patient lies as the file says, and that the CT's axes are the patient's.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.carm import (
    PATIENT_POSITIONS,
    equipment_to_patient,
    iec_axes,
    receptor_axes,
    view_from_axes,
)
from PolyPoseLib.io.dicom import XrayTags
from PolyPoseLib.io.xray.detector import rt_image_axes
from PolyPoseLib.io.xray.fields import XrayFields

CARM_RADIUS = (12.0, 120.0)
"""Degrees and mm within which a C-arm's guess is expected: patients lie askew, isocentres sit off the
anchor."""

GANTRY_RADIUS = (6.0, 80.0)
VIEW_RADIUS = (25.0, 200.0)
"""A view position names a direction and no more."""

KNOWN_ISOCENTER_MM = 30.0
UNKNOWN_DISTANCE_MM = 100.0
"""Added to the radius when the distance to the isocentre had to be assumed."""

USUAL_SOURCE_SHARE = 0.7
"""Usual share of the source's distance to the isocentre in that to the detector."""

_LETTERS = {"L": (1, 0, 0), "R": (-1, 0, 0), "P": (0, 1, 0), "A": (0, -1, 0), "H": (0, 0, 1), "F": (0, 0, -1)}

_VIEWS = {"AP": 180.0, "PA": 0.0, "LL": 90.0, "RL": -90.0}
"""View positions (0018,5101) as the primary angle that puts the receptor there."""


@dataclass(frozen=True)
class Pose:
    """Where an X-ray was taken from, as a guess.

    Attributes:
        extrinsic: (4, 4) world LPS mm to camera, of the image as seen from the source.
        mirrored: whether the stored image is its mirror image.
        radius: (degrees, mm) within which the truth is expected.
        isocenter: (3,) LPS mm, the point that the guess puts at the isocentre.
        table_mm: (3,) LPS, how far the table had carried the patient, from an arbitrary zero; None if
            unknown.

    """

    extrinsic: np.ndarray
    mirrored: bool
    radius: tuple[float, float]
    isocenter: tuple[float, float, float]
    table_mm: tuple[float, float, float] | None


@dataclass(frozen=True)
class _View:
    """Axes of the stored image in the patient, and how sure they are."""

    columns: np.ndarray
    rows: np.ndarray
    beam: np.ndarray
    radius: tuple[float, float]
    source_keys: tuple[str, ...] = ("DistanceSourceToIsocenter", "DistanceSourceToPatient")
    isocenter: tuple[float, ...] | None = None
    table_mm: np.ndarray | None = field(default=None)


def pose_of(
    tags: XrayTags | None,
    fields: XrayFields,
    source_to_detector_mm: float,
    isocenter: tuple[float, float, float] | None,
    notes: Notes,
) -> Pose | None:
    """Guess the camera, or None when nothing tells the direction.

    Args:
        tags: the frame's attributes, None for files that are not DICOM.
        fields: the study file's entry.
        source_to_detector_mm: distance to the detector.
        isocenter: (3,) LPS mm, used unless the fields or the file give one.
        notes: receives every assumption.

    """
    view = _view(tags, fields, notes)
    if view is None:
        return None
    if fields.mirrored is not None:
        stored_mirrored = np.dot(np.cross(view.columns, view.rows), view.beam) < 0
        if stored_mirrored != fields.mirrored:
            view = _View(**{**view.__dict__, "columns": -view.columns})
    distance, assumed = _source_to_isocenter(tags, fields, view, source_to_detector_mm, notes)
    point, radius_mm = _isocenter(view, fields, isocenter, notes)
    extrinsic, mirrored = view_from_axes(view.columns, view.rows, view.beam, distance, point)
    radius = (view.radius[0], radius_mm + (UNKNOWN_DISTANCE_MM if assumed else 0))
    notes.say(f"extrinsic: a guess, expected within {radius[0]:g} degrees and {radius[1]:g} mm")
    table = None if view.table_mm is None else tuple(float(part) for part in view.table_mm)
    return Pose(extrinsic, mirrored, radius, tuple(float(part) for part in point), table)


def _view(tags: XrayTags | None, fields: XrayFields, notes: Notes) -> _View | None:
    """Axes from the fields' angles, an RT image, positioner angles or a view position."""
    if fields.primary_angle_deg is not None or fields.secondary_angle_deg is not None:
        primary, secondary = fields.primary_angle_deg or 0.0, fields.secondary_angle_deg or 0.0
        position = fields.patient_position or "HFS"
        notes.say(
            f"angles {_angles_text(primary, secondary)} from {notes.entry}, patient position {position}"
        )
        return _carm_view(tags, primary, secondary, position, CARM_RADIUS, notes)
    if tags is None:
        return None
    if tags.text("Modality") == "RTIMAGE":
        return _rt_view(tags, fields, notes)
    return _positioner_view(tags, fields, notes) or _named_view(tags, notes)


def _angles_text(primary: float, secondary: float) -> str:
    """Angles as radiographers write them: LAO 30, CRA 10."""
    return f"{'RAO' if primary < 0 else 'LAO'} {abs(primary):g}, {'CAU' if secondary < 0 else 'CRA'} {abs(secondary):g}"


def _frame_number(tags: XrayTags, keyword: str) -> float:
    """Increment of this frame, from a list with one value a frame; 0 when there is none."""
    values = tags.numbers(keyword) or ()
    return values[tags.frame] if tags.frame < len(values) else 0.0


def _positioner_view(tags: XrayTags, fields: XrayFields, notes: Notes) -> _View | None:
    """View of a C-arm from positioner angles (PS3.3 C.8.7.5, C.8.19.6.10, C.8.19.6.13)."""
    if tags.text("Modality") not in ("XA", "RF") and tags.text("PositionerType") != "CARM":
        return None
    primary, secondary = tags.number("PositionerPrimaryAngle"), tags.number("PositionerSecondaryAngle")
    position, source = "HFS", "(0018,1510) and (0018,1511), relative to the patient"
    if primary is not None:
        primary += _frame_number(tags, "PositionerPrimaryAngleIncrement")
        secondary = (secondary or 0.0) + _frame_number(tags, "PositionerSecondaryAngleIncrement")
    else:
        primary, secondary = (
            tags.number("PositionerIsocenterPrimaryAngle"),
            tags.number("PositionerIsocenterSecondaryAngle") or 0.0,
        )
        position, source = _patient_position(tags, fields, notes), "(0018,9463) and (0018,9464)"
        if primary is None:
            return None
    if abs(primary) > 360 or abs(secondary) > 180:
        notes.warn(f"the positioner angles {primary:g} and {secondary:g} are no angles and were ignored.")
        return None
    notes.say(f"angles {_angles_text(primary, secondary)} from DICOM {source}")
    for keyword, axis in (("DetectorPrimaryAngle", "row"), ("DetectorSecondaryAngle", "column")):
        if tilt := tags.number(keyword):
            notes.warn(
                f"the detector is tilted {tilt:g} degrees in its {axis} direction, which no camera here models."
            )
    return _carm_view(tags, primary, secondary, position, CARM_RADIUS, notes)


def _carm_view(
    tags: XrayTags | None, primary: float, secondary: float, position: str, radius, notes: Notes
) -> _View:
    """View of a C-arm with these angles; the image is heads up as displayed unless the file says
    otherwise.
    """
    to_patient = equipment_to_patient(position)
    columns, rows, beam = (to_patient @ axis for axis in receptor_axes(primary, secondary))
    oriented = _oriented(tags, columns, rows, beam)
    if oriented is None:
        notes.say("orientation: heads up, facing the patient, as C-arm images are displayed")
    else:
        columns, rows = oriented
        notes.say(f"orientation: Patient Orientation (0020,0020) {tags.text('PatientOrientation')}")
    return _View(columns, rows, beam, radius, table_mm=_xa_table(tags, notes))


def _named_view(tags: XrayTags, notes: Notes) -> _View | None:
    """View of a radiograph whose View Position (0018,5101) is AP, PA or lateral."""
    name = tags.text("ViewPosition")
    if name not in _VIEWS or tags.text("Modality") == "MG":
        return None
    columns, rows, beam = receptor_axes(_VIEWS[name], 0.0)
    if name == "AP":
        columns = -columns
    columns, rows = _oriented(tags, columns, rows, beam) or (columns, rows)
    notes.say(f"direction: view position {name} (0018,5101)")
    return _View(columns, rows, beam, VIEW_RADIUS)


def _rt_view(tags: XrayTags, fields: XrayFields, notes: Notes) -> _View | None:
    """View of an RT image from gantry, couch and receptor angles (PS3.3 C.8.8.2)."""
    gantry = tags.number("GantryAngle")
    if gantry is None:
        return None
    couch, receptor = tags.number("PatientSupportAngle") or 0.0, tags.number("XRayImageReceptorAngle") or 0.0
    notes.say(f"gantry {gantry:g}, couch {couch:g}, receptor {receptor:g} degrees from DICOM, IEC 61217")
    if tags.text("RTImagePlane") == "NON_NORMAL":
        notes.warn("the RT image plane is not perpendicular to the beam, which no camera here models.")
    to_patient = equipment_to_patient(_patient_position(tags, fields, notes))
    x, down, beam = iec_axes(gantry, couch, receptor)
    across, along = rt_image_axes(tags)
    columns = to_patient @ (across[0] * x - across[1] * down)
    rows = to_patient @ (along[0] * x - along[1] * down)
    table = _rt_table(tags)
    return _View(
        columns,
        rows,
        to_patient @ beam,
        GANTRY_RADIUS,
        ("RadiationMachineSAD",),
        tags.numbers("IsocenterPosition", 3),
        None if table is None else to_patient @ table,
    )


def _patient_position(tags: XrayTags, fields: XrayFields, notes: Notes) -> str:
    """Patient position from the study file, DICOM, or the usual one with a warning."""
    found = fields.patient_position or tags.text("PatientPosition")
    if found in PATIENT_POSITIONS:
        notes.say(
            f"patient position {found} from {notes.entry if fields.patient_position else 'DICOM (0018,5100)'}"
        )
        return found
    notes.warn('the patient position is not given; head first and supine is assumed; add "patient_position".')
    return "HFS"


def _direction(letters: str) -> np.ndarray | None:
    """Unit vector (3,) of letters such as "L" or "LF", the first weighing most; None when not letters."""
    if not letters or any(letter not in _LETTERS for letter in letters):
        return None
    total = sum(np.array(_LETTERS[letter]) / 2**rank for rank, letter in enumerate(letters))
    length = np.linalg.norm(total)
    return total / length if length > 0 else None


def _stored_axes(tags: XrayTags | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Directions of columns and rows in the patient from Patient Orientation (0020,0020), PS3.3
    C.7.6.1.1.1.
    """
    letters = tags.texts("PatientOrientation") if tags else ()
    if len(letters) != 2:
        return None
    columns, rows = map(_direction, letters)
    return None if columns is None or rows is None else (columns, rows)


def stored_handedness(tags: XrayTags | None, beam: np.ndarray) -> int:
    """1 when Patient Orientation says that the stored image is a view from the source, -1 its mirror image,
    else 0.

    Args:
        tags: the frame's attributes.
        beam: (3,) unit vector from the source to the detector in the patient.

    """
    axes = _stored_axes(tags)
    turn = 0.0 if axes is None else float(np.dot(np.cross(*axes), beam))
    return 0 if abs(turn) < 0.3 else int(np.sign(turn))


def _oriented(
    tags: XrayTags | None, columns: np.ndarray, rows: np.ndarray, beam: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Stored axes: of all quarter turns and mirror images of the display, the one nearest to Patient
    Orientation.
    """
    handedness = stored_handedness(tags, beam)
    if handedness == 0:
        return None
    wanted = _stored_axes(tags)
    if np.dot(np.cross(columns, rows), beam) * handedness < 0:
        columns = -columns
    turns = ((columns, rows), (rows, -columns), (-columns, -rows), (-rows, columns))
    return max(turns, key=lambda pair: pair[0] @ wanted[0] + pair[1] @ wanted[1])


def _xa_table(tags: XrayTags | None, notes: Notes) -> np.ndarray | None:
    """Table position (3,) in LPS of an XA frame, from an arbitrary zero (PS3.3 C.8.7.4, C.8.19.6.11).

    DICOM measures "longitudinal" toward LAO, "lateral" toward CRA and "vertical" downward, for a supine
    patient with the head in the usual place; other patient positions turn the equipment's axes.
    """
    if tags is None:
        return None
    absolute = [tags.number(f"TableTop{name}Position") for name in ("Longitudinal", "Vertical", "Lateral")]
    if None not in absolute:
        table = np.array(absolute)
    elif tags.text("TableMotion") == "DYNAMIC":
        table = np.array(
            [_frame_number(tags, f"Table{n}Increment") for n in ("Longitudinal", "Vertical", "Lateral")]
        )
    else:
        return None
    position = tags.text("PatientPosition")
    notes.say(f"table: {shown(table)} mm toward LAO, down, toward CRA")
    return equipment_to_patient(position if position in PATIENT_POSITIONS else "HFS") @ table


def _rt_table(tags: XrayTags) -> np.ndarray | None:
    """Table top position (3,) in the equipment's axes from IEC lateral, longitudinal and vertical
    coordinates.
    """
    lateral, longitudinal, vertical = (
        tags.number(f"TableTop{name}Position") for name in ("Lateral", "Longitudinal", "Vertical")
    )
    if None in (lateral, longitudinal, vertical):
        return None
    return np.array([lateral, -vertical, longitudinal])


def _source_to_isocenter(
    tags: XrayTags | None, fields: XrayFields, view: _View, source_to_detector_mm: float, notes: Notes
) -> tuple[float, bool]:
    """Distance from the source to the isocentre in mm, and whether it was only assumed."""
    found = key = None
    for key in view.source_keys if tags else ():
        value = tags.number(key)
        if value is not None and 0 < value < source_to_detector_mm:
            found = value
            break
    if fields.source_to_isocenter_mm is not None:
        if fields.source_to_isocenter_mm >= source_to_detector_mm:
            raise InputError(
                f'{notes.where}: "source_to_isocenter_mm" is {fields.source_to_isocenter_mm:g}, not below the '
                f"detector's distance {source_to_detector_mm:g}; give the distance to the isocentre."
            )
        also = f" (DICOM says {found:g})" if found else ""
        notes.say(f"source_to_isocenter_mm {fields.source_to_isocenter_mm:g} from {notes.entry}{also}")
        return fields.source_to_isocenter_mm, False
    if found is not None:
        notes.say(f"source_to_isocenter_mm {found:g} from DICOM {key}")
        return found, False
    factor = tags.number("EstimatedRadiographicMagnificationFactor") if tags else None
    share = 1 / factor if factor and 1 < factor < 4 else USUAL_SOURCE_SHARE
    assumed = share * source_to_detector_mm
    notes.say(f"source_to_isocenter_mm {assumed:g}: assumed, {share:.2f} of the distance to the detector")
    return assumed, True


def _isocenter(
    view: _View, fields: XrayFields, isocenter: tuple[float, float, float] | None, notes: Notes
) -> tuple[np.ndarray, float]:
    """Point at the isocentre, and the radius in mm that its origin deserves."""
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
