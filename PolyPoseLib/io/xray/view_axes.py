"""How an image and its beam lie in the patient, from positioner angles, an RT gantry or a view position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.geometry.carm import PATIENT_POSITIONS, equipment_to_patient, iec_axes, receptor_axes
from PolyPoseLib.io.xray.distance_checks import SOURCE_TO_PATIENT
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.frame_increments import frame_increment
from PolyPoseLib.io.xray.patient_orientation import contradicts, nearest_orientation
from PolyPoseLib.io.xray.rt_image import rt_image_axes
from PolyPoseLib.io.xray.tags import XrayTags

CARM_RADIUS = (12.0, 120.0)
"""Degrees and mm within which a C-arm's initial camera is expected: patients lie askew, isocentres sit off the
anchor."""

GANTRY_RADIUS = (6.0, 80.0)
"""The same for a treatment machine, at whose isocentre the patient was placed with care."""

VIEW_RADIUS = (25.0, 200.0)
"""The same for a view position, which names a direction and no more."""

FARTHEST_VIEW_DEG = 60.0
"""Between a named view and the angles: an oblique view lies 45 degrees from the nearest name."""

_VIEWS = {"AP": 180.0, "PA": 0.0, "LL": 90.0, "RL": -90.0}
"""View positions (0018,5101) as the primary angle that puts the receptor there."""


@dataclass(frozen=True)
class ViewAxes:
    """Axes of the stored image in the patient, and how well they are known.

    Attributes
    ----------
    columns, rows
        (3,) unit vectors along the image's columns (to the right) and rows (downward), LPS.
    beam
        (3,) unit vector from the source to the detector, LPS.
    radius
        (degrees, mm) within which the true camera is expected.
    source_keys
        Keywords of attributes that may hold the distance from the source to the isocentre.
    isocenter
        (3,) LPS mm, where the file says it, or None.
    table_mm
        (3,) LPS, how far the table had carried the patient, from an arbitrary zero, or None.
    virtual_plane
        Whether the image's plane may lie anywhere along the beam, as that of an RT image, in the patient even.

    """

    columns: np.ndarray
    rows: np.ndarray
    beam: np.ndarray
    radius: tuple[float, float]
    source_keys: tuple[str, ...] = SOURCE_TO_PATIENT
    isocenter: tuple[float, float, float] | None = None
    table_mm: np.ndarray | None = None
    virtual_plane: bool = False


def view_axes_of(tags: XrayTags | None, fields: XrayFields, notes: Notes) -> ViewAxes | None:
    """Axes from the fields' angles, an RT image, positioner angles or a view position; None when nothing says.

    Parameters
    ----------
    tags
        The frame's attributes, None for files that are not DICOM.
    fields
        The study file's entry; its angles win over DICOM.
    notes
        Receives every assumption.

    """
    if fields.primary_angle_deg is not None or fields.secondary_angle_deg is not None:
        primary, secondary = fields.primary_angle_deg or 0.0, fields.secondary_angle_deg or 0.0
        position = fields.patient_position or "HFS"
        notes.say(
            f"angles {_angles_text(primary, secondary)} from {notes.entry}, patient position {position}"
        )
        return _carm_view(tags, primary, secondary, position, notes)
    if tags is None:
        return None
    if tags.text("Modality") == "RTIMAGE":
        return _rt_view(tags, fields, notes)
    return _positioner_view(tags, fields, notes) or _named_view(tags, notes)


def _angles_text(primary: float, secondary: float) -> str:
    """Angles as radiographers write them: LAO 30, CRA 10."""
    return f"{'RAO' if primary < 0 else 'LAO'} {abs(primary):g}, {'CAU' if secondary < 0 else 'CRA'} {abs(secondary):g}"


def _positioner_view(tags: XrayTags, fields: XrayFields, notes: Notes) -> ViewAxes | None:
    """View of a C-arm from positioner angles (PS3.3 C.8.7.5, C.8.19.6.10, C.8.19.6.13)."""
    if tags.text("Modality") not in ("XA", "RF") and tags.text("PositionerType") != "CARM":
        return None
    primary, secondary = tags.number("PositionerPrimaryAngle"), tags.number("PositionerSecondaryAngle") or 0.0
    position, source = "HFS", "(0018,1510) and (0018,1511), relative to the patient"
    if primary is not None:
        primary += frame_increment(tags, "PositionerPrimaryAngleIncrement", notes)
        secondary += frame_increment(tags, "PositionerSecondaryAngleIncrement", notes)
    else:
        primary = tags.number("PositionerIsocenterPrimaryAngle")
        secondary = tags.number("PositionerIsocenterSecondaryAngle") or 0.0
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
    return _carm_view(tags, primary, secondary, position, notes)


def _carm_view(
    tags: XrayTags | None, primary: float, secondary: float, position: str, notes: Notes
) -> ViewAxes:
    """View of a C-arm with these angles; the image is heads up as displayed unless the file says otherwise."""
    to_patient = equipment_to_patient(position)
    columns, rows, beam = (to_patient @ axis for axis in receptor_axes(primary, secondary))
    _compare_directions(tags, beam, notes)
    oriented = nearest_orientation(tags, columns, rows, beam)
    if tags is None or oriented is None:
        notes.say("orientation: heads up, facing the patient, as C-arm images are displayed")
    else:
        columns, rows = oriented
        notes.say(f"orientation: Patient Orientation (0020,0020) {tags.text('PatientOrientation')}")
    return ViewAxes(columns, rows, beam, CARM_RADIUS, table_mm=_xa_table(tags, notes))


def _compare_directions(tags: XrayTags | None, beam: np.ndarray, notes: Notes) -> None:
    """Flag a Patient Orientation or View Position that is far from the beam (3,) of the angles."""
    if tags is None:
        return
    if contradicts(tags, beam):
        notes.warn(_orientation_ignored(tags, "the C-arm's angles"))
    name = tags.text("ViewPosition")
    if name not in _VIEWS:
        return
    # Front and back are not told apart: a frontal view of a C-arm is called AP whichever way its beam runs.
    share = min(abs(float(receptor_axes(_VIEWS[name], 0.0)[2] @ beam)), 1.0)
    if (turn := float(np.degrees(np.arccos(share)))) > FARTHEST_VIEW_DEG:
        notes.warn(
            f"the view position {name} (0018,5101) and the C-arm's angles are {turn:.0f} degrees apart; the angles "
            'were used: if they are wrong, give "primary_angle_deg" and "secondary_angle_deg".'
        )


def _orientation_ignored(tags: XrayTags, against: str) -> str:
    """Sentence about a Patient Orientation, whose letters are no patient's data, that cannot be right."""
    return (
        f"Patient Orientation (0020,0020) {tags.text('PatientOrientation')} describes another direction than "
        f"{against}, and was ignored: the image may be shown from the other side or turned; check it, and add "
        '"mirrored" if you know it.'
    )


def _named_view(tags: XrayTags, notes: Notes) -> ViewAxes | None:
    """View of a radiograph whose View Position (0018,5101) is AP, PA or lateral."""
    name = tags.text("ViewPosition")
    if name not in _VIEWS or tags.text("Modality") == "MG":
        return None
    columns, rows, beam = receptor_axes(_VIEWS[name], 0.0)
    if name == "AP":
        columns = -columns
    if contradicts(tags, beam):
        notes.warn(_orientation_ignored(tags, f"the view position {name} (0018,5101)"))
    columns, rows = nearest_orientation(tags, columns, rows, beam) or (columns, rows)
    notes.say(f"direction: view position {name} (0018,5101)")
    return ViewAxes(columns, rows, beam, VIEW_RADIUS)


def _rt_view(tags: XrayTags, fields: XrayFields, notes: Notes) -> ViewAxes | None:
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
    table = _rt_table(tags)
    return ViewAxes(
        columns=to_patient @ (across[0] * x - across[1] * down),
        rows=to_patient @ (along[0] * x - along[1] * down),
        beam=to_patient @ beam,
        radius=GANTRY_RADIUS,
        source_keys=("RadiationMachineSAD",),
        isocenter=tags.triple("IsocenterPosition"),
        table_mm=None if table is None else to_patient @ table,
        virtual_plane=True,
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


def _xa_table(tags: XrayTags | None, notes: Notes) -> np.ndarray | None:
    """Table position (3,) in LPS of an XA frame, from an arbitrary zero (PS3.3 C.8.7.4, C.8.19.6.11).

    DICOM measures "longitudinal" toward LAO, "lateral" toward CRA and "vertical" downward, for a supine patient with
    the head in the usual place; other patient positions turn the equipment's axes.
    """
    if tags is None:
        return None
    names = ("Longitudinal", "Vertical", "Lateral")
    absolute = [tags.number(f"TableTop{name}Position") for name in names]
    if None not in absolute:
        table = np.array(absolute, dtype=np.float64)
    elif tags.text("TableMotion") == "DYNAMIC":
        table = np.array([frame_increment(tags, f"Table{name}Increment", notes) for name in names])
    else:
        return None
    position = tags.text("PatientPosition")
    notes.say(f"table: {shown(table)} mm toward LAO, down, toward CRA")
    return equipment_to_patient(position if position in PATIENT_POSITIONS else "HFS") @ table


def _rt_table(tags: XrayTags) -> np.ndarray | None:
    """Table top position (3,) in the equipment's axes from IEC lateral, longitudinal and vertical coordinates."""
    lateral, longitudinal, vertical = (
        tags.number(f"TableTop{name}Position") for name in ("Lateral", "Longitudinal", "Vertical")
    )
    if lateral is None or longitudinal is None or vertical is None:
        return None
    return np.array([lateral, -vertical, longitudinal])
