"""C-arms and linear accelerators: from angles and distances to an extrinsic, and back.

Three frames meet here, all right-handed and in millimetres:

- the patient: LPS (x to the patient's left, y to the back, z to the head);
- the equipment: the axes that LPS would have for a patient who lies head first and supine (x across the
  table, y down, z along the table to its head end);
- the camera: x along the image's columns, y down its rows, z from the source through the detector.

C-arm angles follow DICOM PS3.3 C.8.7.5.1.2: the angle belongs to the receptor, not to the source. With both
at 0 the patient faces the receptor, so the beam runs from the back to the chest (along -y). The primary
angle is a longitude about the head-feet axis, +90 with the receptor at the patient's left (LAO), -90 at the
right (RAO); the secondary angle is a latitude, +90 with the receptor at the head (CRA), -90 at the feet
(CAU).

DICOM's positioner angles (0018,1510) and (0018,1511) are relative to the patient, whatever the patient
position: convert them with "HFS". Angles read from the stand, or the isocentre angles (0018,9463) and
(0018,9464), are relative to the equipment: convert them with the patient position.

C-arm images are kept as seen from the receptor, facing the source (PS3.3 C.8.19.6.13.1.2), heads up. A
camera is a view from the source. The two are mirror images, which no rotation can undo: see `view_from_axes`.

Every extrinsic made here is an initial estimate: a patient is never exactly where the stand assumes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import require_rigid

_PATIENT_AXES: dict[str, tuple[tuple[int, int, int], ...]] = {
    # (down, toward the table's head end) seen by the patient, in LPS.
    "HFS": ((0, 1, 0), (0, 0, 1)),
    "HFP": ((0, -1, 0), (0, 0, 1)),
    "HFDR": ((-1, 0, 0), (0, 0, 1)),
    "HFDL": ((1, 0, 0), (0, 0, 1)),
    "FFS": ((0, 1, 0), (0, 0, -1)),
    "FFP": ((0, -1, 0), (0, 0, -1)),
    "FFDR": ((-1, 0, 0), (0, 0, -1)),
    "FFDL": ((1, 0, 0), (0, 0, -1)),
}

PATIENT_POSITIONS: tuple[str, ...] = tuple(_PATIENT_AXES)
"""Patient positions (0018,5100) that can be converted: head or feet first; supine, prone or on a side."""


@dataclass(frozen=True)
class CArmAngles:
    """Angles of a C-arm in degrees.

    Attributes
    ----------
    primary_deg : float
        -180 to 180, positive toward LAO.
    secondary_deg : float
        -90 to 90, positive toward CRA.
    detector_rotation_deg : float
        -180 to 180, rotation of the camera about its axis, its x toward its y; 0 is heads up.

    """

    primary_deg: float
    secondary_deg: float
    detector_rotation_deg: float


def equipment_to_patient(patient_position: str = "HFS") -> np.ndarray:
    """Rotation that takes vectors of the equipment to LPS vectors of the patient.

    Parameters
    ----------
    patient_position : str
        One of PATIENT_POSITIONS (DICOM PS3.3 C.7.3.1.1.2).

    Returns
    -------
    (3, 3) array
        Equipment to patient.

    Raises
    ------
    InputError
        Another position.

    """
    try:
        down, head_end = _PATIENT_AXES[str(patient_position).strip().upper()]
    except KeyError:
        raise InputError(
            f"The patient position {patient_position!r} cannot be converted to a camera; use one of "
            f"{', '.join(PATIENT_POSITIONS)}, or give the extrinsic."
        ) from None
    y, z = np.array(down, float), np.array(head_end, float)
    return np.stack([np.cross(y, z), y, z], axis=1)


def receptor_axes(primary_deg: float, secondary_deg: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes of a C-arm's image as displayed: facing the source, heads up (PS3.3 C.8.7.5.1.2).

    Parameters
    ----------
    primary_deg : float
        Positive toward LAO.
    secondary_deg : float
        Positive toward CRA.

    Returns
    -------
    tuple[np.ndarray, np.ndarray, np.ndarray]
        Three unit vectors (3,): along the columns (to the right), down the rows, and from the source to the
        receptor. They are left-handed, because the viewer stands behind the receptor.

    Raises
    ------
    InputError
        An angle that is not finite or out of range.

    """
    if not (np.isfinite(primary_deg) and abs(primary_deg) <= 360):
        raise InputError(f"The primary angle is {primary_deg}; give degrees from -180 to 180, + is LAO.")
    if not (np.isfinite(secondary_deg) and abs(secondary_deg) <= 180):
        raise InputError(f"The secondary angle is {secondary_deg}; give degrees from -90 to 90, + is CRA.")
    a, b = np.deg2rad([primary_deg, secondary_deg])
    columns = np.array([np.cos(a), np.sin(a), 0.0])
    rows = np.array([np.sin(a) * np.sin(b), -np.cos(a) * np.sin(b), -np.cos(b)])
    beam = np.array([np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b), np.sin(b)])
    return columns, rows, beam


def iec_axes(
    gantry_deg: float, couch_deg: float = 0.0, receptor_deg: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes of an RT image in the equipment's frame, as seen from the source (PS3.3 C.8.8.2.7, IEC 61217).

    IEC fixed axes are Xf to the right of a person who faces the gantry, Yf toward the gantry, Zf up; a
    patient who lies head first has the head at the gantry. The gantry turns about Yf with the source at Xf
    at 90 degrees; the couch turns about Zf, counter-clockwise from above; the receptor counter-clockwise as
    seen from the source.

    Parameters
    ----------
    gantry_deg : float
        Gantry angle (300A,011E).
    couch_deg : float
        Patient support angle (300A,0122).
    receptor_deg : float
        X-ray image receptor angle (3002,000E).

    Returns
    -------
    tuple[np.ndarray, np.ndarray, np.ndarray]
        Three unit vectors (3,), right-handed: Xr (along the columns), -Yr (down the rows), -Zr (the beam).

    Raises
    ------
    InputError
        An angle that is not finite.

    """
    if not np.isfinite([gantry_deg, couch_deg, receptor_deg]).all():
        raise InputError("The gantry, couch and receptor angles must be finite numbers of degrees.")
    gantry, couch, receptor = np.deg2rad([gantry_deg, couch_deg, receptor_deg])
    x_gantry = np.array([np.cos(gantry), 0.0, -np.sin(gantry)])
    y_gantry = np.array([0.0, 1.0, 0.0])
    beam = -np.array([np.sin(gantry), 0.0, np.cos(gantry)])
    x = np.cos(receptor) * x_gantry + np.sin(receptor) * y_gantry
    y = -np.sin(receptor) * x_gantry + np.cos(receptor) * y_gantry
    cos, sin = np.cos(couch), np.sin(couch)
    fixed_to_table = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1.0]])
    table_to_equipment = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    fixed_to_equipment = table_to_equipment @ fixed_to_table
    return fixed_to_equipment @ x, fixed_to_equipment @ -y, fixed_to_equipment @ beam


def view_from_axes(
    columns: ArrayLike,
    rows: ArrayLike,
    beam: ArrayLike,
    source_to_isocenter_mm: float,
    isocenter: ArrayLike = (0.0, 0.0, 0.0),
) -> tuple[np.ndarray, bool]:
    """Extrinsic of an image whose axes are known in the patient, and whether the image is a mirror image.

    Parameters
    ----------
    columns : (3,) array_like
        Unit vector along the stored image's columns, LPS.
    rows : (3,) array_like
        Unit vector down the stored image's rows, LPS.
    beam : (3,) array_like
        Unit vector from the source to the detector, LPS, perpendicular to both.
    source_to_isocenter_mm : float
        Distance from the source to `isocenter`.
    isocenter : (3,) array_like
        LPS mm, the point of the patient on the central ray.

    Returns
    -------
    tuple[np.ndarray, bool]
        (extrinsic (4, 4) world to camera, mirrored). When the image was stored as seen from the detector's side,
        mirrored is True and the extrinsic belongs to the image with its columns in reverse order.

    Raises
    ------
    InputError
        A distance that is not above 0, or an isocenter that is not three finite numbers.

    """
    if not (np.isfinite(source_to_isocenter_mm) and source_to_isocenter_mm > 0):
        raise InputError(
            f"The distance from the source to the isocentre is {source_to_isocenter_mm} mm; give a number "
            "above 0."
        )
    point = np.asarray(isocenter, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError("The isocentre must be three finite numbers, LPS mm.")
    columns, rows, beam = (np.asarray(axis, dtype=np.float64) for axis in (columns, rows, beam))
    mirrored = bool(np.dot(np.cross(columns, rows), beam) < 0)
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = np.stack([-columns if mirrored else columns, rows, beam])
    extrinsic[:3, 3] = (0, 0, source_to_isocenter_mm) - extrinsic[:3, :3] @ point
    return require_rigid(extrinsic, "The camera of these axes"), mirrored


def carm_extrinsic(
    primary_deg: float,
    secondary_deg: float,
    source_to_isocenter_mm: float,
    isocenter: ArrayLike = (0.0, 0.0, 0.0),
    patient_position: str = "HFS",
    *,
    detector_rotation_deg: float = 0.0,
) -> np.ndarray:
    """Extrinsic of a C-arm: the view from the source, heads up.

    Parameters
    ----------
    primary_deg : float
        Positive toward LAO.
    secondary_deg : float
        Positive toward CRA.
    source_to_isocenter_mm : float
        Distance from the source to the isocentre (0018,1111).
    isocenter : (3,) array_like
        LPS mm, the point of the patient at the isocentre.
    patient_position : str
        "HFS" for angles relative to the patient (DICOM's positioner angles); for angles of the stand, how the
        patient lies: one of PATIENT_POSITIONS.
    detector_rotation_deg : float
        Rotation of the camera about its axis, its x toward its y.

    Returns
    -------
    (4, 4) array
        World LPS to camera. The camera's x is the display's right-to-left: at 0 and 0 its columns run to the
        patient's right, because the source is behind the patient.

    Raises
    ------
    InputError
        A number out of range or an unknown patient position.

    """
    if not np.isfinite(detector_rotation_deg):
        raise InputError(
            f"The detector's rotation is {detector_rotation_deg}; give a finite number of degrees."
        )
    to_patient = equipment_to_patient(patient_position)
    columns, rows, beam = (to_patient @ axis for axis in receptor_axes(primary_deg, secondary_deg))
    turn = np.deg2rad(detector_rotation_deg)
    x = -np.cos(turn) * columns + np.sin(turn) * rows
    y = np.sin(turn) * columns + np.cos(turn) * rows
    return view_from_axes(x, y, beam, source_to_isocenter_mm, isocenter)[0]


def carm_angles(extrinsic: ArrayLike, patient_position: str = "HFS") -> CArmAngles:
    """Angles of a C-arm whose view from the source is `extrinsic`: the inverse of `carm_extrinsic`.

    Straight above the head or below the feet (secondary +-90) the primary angle and the detector's rotation are
    the same rotation: the primary angle is then 0.

    Parameters
    ----------
    extrinsic : (4, 4) array_like
        World LPS to camera.
    patient_position : str
        As in `carm_extrinsic`.

    Returns
    -------
    CArmAngles
        Degrees.

    Raises
    ------
    InputError
        Not rigid, or an unknown patient position.

    """
    rotation = require_rigid(extrinsic)[:3, :3] @ equipment_to_patient(patient_position)
    x, _, beam = rotation
    secondary = np.rad2deg(np.arctan2(beam[2], np.hypot(beam[0], beam[1])))
    upright = np.hypot(beam[0], beam[1]) > 1e-9
    primary = np.rad2deg(np.arctan2(beam[0], -beam[1])) if upright else 0.0
    columns, rows, _ = receptor_axes(primary, secondary)
    turn = np.rad2deg(np.arctan2(x @ rows, -(x @ columns)))
    return CArmAngles(float(primary), float(secondary), float(turn))


def with_isocenter(extrinsic: ArrayLike, old: ArrayLike, new: ArrayLike) -> np.ndarray:
    """Extrinsic that sees one point exactly as another extrinsic sees another point.

    Parameters
    ----------
    extrinsic : (4, 4) array_like
        World LPS mm to camera mm.
    old : (3,) array_like
        The point that this extrinsic sees, LPS mm.
    new : (3,) array_like
        The point to be seen in its place, LPS mm.

    Returns
    -------
    (4, 4) array
        World LPS mm to camera mm.

    """
    moved = require_rigid(extrinsic)
    moved[:3, 3] += moved[:3, :3] @ (np.asarray(old, np.float64) - np.asarray(new, np.float64))
    return moved
