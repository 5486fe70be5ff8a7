"""The entry of one X-ray in study.json, validated: an XrayFields that exists is valid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.data.xray import CAMERA_STATES, DISTANCE_RANGE_MM
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.carm import PATIENT_POSITIONS
from PolyPoseLib.geometry.negative_focal import has_negative_focal, positive_camera, require_signed_intrinsics
from PolyPoseLib.geometry.rigid import is_real_number, require_pose
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS
from PolyPoseLib.io.json_records import (
    Record,
    boolean,
    file_path,
    nonempty,
    number_in,
    numbers,
    one_of,
    string,
    whole_number,
)
from PolyPoseLib.io.xray.intensity import INTENSITIES
from PolyPoseLib.io.xray.landmarks import FARTHEST, parse_landmarks

CALIBRATION_FRAMES = ("own", "ct")
"""Worlds that a calibration's pose may start from: its own, or the CT's."""

SPACING_RANGE_MM = (0.005, 10.0)
"""Pitches of a detector's pixels."""


@dataclass(frozen=True)
class XrayFields:
    """What study.json says about one X-ray; None where a field is absent.

    Attributes
    ----------
    name
        Shown to people.
    source_to_detector_mm
        Distance from the source to the detector's plane.
    pixel_spacing_mm
        At the detector, (between rows, between columns), DICOM's order.
    principal_point_px
        (column, row) in the file's own pixels, centres at whole numbers.
    intrinsics
        K (3, 3) in the file's own pixels, focal lengths above 0; takes the place of distance, spacing and principal
        point. Where the entry's focal lengths are negative, `extrinsic` and `mirrored` follow from their signs.
    extrinsic
        (4, 4) world LPS mm to camera, for the image as seen from the source; an entry may leave out the last row.
    camera
        "known", "initial" or "absent".
    frame
        Image of a run or stack, counted from 0.
    mask
        Path of an image whose pixels that are not zero are used; a Path is taken as it is.
    intensity
        One of `INTENSITIES`.
    unattenuated
        Pixel value of the direct beam (I0).
    mirrored
        Whether the file shows the detector's side; None leaves it to DICOM.
    isocenter_mm
        (3,) LPS, the point of the patient at the isocentre.
    source_to_isocenter_mm
        Distance from the source to the isocentre.
    primary_angle_deg
        Positive toward LAO.
    secondary_angle_deg
        Positive toward CRA.
    patient_position
        "HFS" and so on, how the patient lay under a stand with these angles.
    standard_view
        One of `STANDARD_VIEWS`, around which the camera is searched.
    landmarks
        Points in the CT and in the file's own pixels, from which the camera is computed.
    calibration
        Path of a calibrated camera (`PolyPoseLib.io.xray.calibration`); a Path is taken as it is.
    calibration_frame
        "ct" when its rotation and translation start from the CT's LPS mm, "own" (the default) when they start from
        the calibration's world.
    rig
        Name of the calibrated rig (a biplane stand, say) that took it; the cameras of one rig keep their relative
        pose, which comes from their calibrations, or else from their extrinsics; all of them in the same world.
    distortion_corrected
        Whether an image intensifier's distortion was corrected; None leaves it to the shape of the field.

    """

    name: str | None = None
    source_to_detector_mm: float | None = None
    pixel_spacing_mm: tuple[float, float] | None = None
    principal_point_px: tuple[float, float] | None = None
    intrinsics: np.ndarray | None = None
    extrinsic: np.ndarray | None = None
    camera: str | None = None
    frame: int | None = None
    mask: str | Path | None = None
    intensity: str | None = None
    unattenuated: float | None = None
    mirrored: bool | None = None
    isocenter_mm: tuple[float, float, float] | None = None
    source_to_isocenter_mm: float | None = None
    primary_angle_deg: float | None = None
    secondary_angle_deg: float | None = None
    patient_position: str | None = None
    standard_view: str | None = None
    landmarks: Landmarks | None = None
    calibration: str | Path | None = None
    calibration_frame: str | None = None
    rig: str | None = None
    distortion_corrected: bool | None = None

    @staticmethod
    def parse(entry: Mapping[str, Any], where: str) -> XrayFields:
        """Validate an entry; fields that are null count as absent and fields of others are left alone.

        Parameters
        ----------
        entry
            The JSON object.
        where
            Opening of the sentences of errors.

        Raises
        ------
        InputError
            A field that breaks its rule, named with the rule.

        """
        record = Record(entry, f"{where}: ")
        distance = number_in(DISTANCE_RANGE_MM, "millimetres")
        fields = XrayFields(
            name=record.optional("name", string),
            source_to_detector_mm=record.optional("source_to_detector_mm", distance),
            pixel_spacing_mm=record.optional("pixel_spacing_mm", _pixel_spacing),
            principal_point_px=record.optional("principal_point_px", _point_2d),
            intrinsics=record.optional("intrinsics", require_signed_intrinsics),
            extrinsic=record.optional("extrinsic", require_pose),
            camera=record.optional("camera", one_of(CAMERA_STATES)),
            frame=record.optional("frame", whole_number(0, "counted from 0")),
            mask=record.optional("mask", file_path),
            intensity=_intensity(record),
            unattenuated=record.optional("unattenuated", number_in((1e-12, 1e12), "a pixel value")),
            mirrored=record.optional("mirrored", boolean),
            isocenter_mm=record.optional("isocenter_mm", _point_3d),
            source_to_isocenter_mm=record.optional("source_to_isocenter_mm", distance),
            primary_angle_deg=record.optional(
                "primary_angle_deg", number_in((-180, 180), "degrees, LAO positive")
            ),
            secondary_angle_deg=record.optional(
                "secondary_angle_deg", number_in((-90, 90), "degrees, CRA positive")
            ),
            patient_position=record.optional("patient_position", one_of(PATIENT_POSITIONS)),
            standard_view=record.optional("standard_view", one_of(tuple(STANDARD_VIEWS))),
            landmarks=record.optional("landmarks", parse_landmarks),
            calibration=record.optional("calibration", file_path),
            calibration_frame=record.optional("calibration_frame", one_of(CALIBRATION_FRAMES)),
            rig=record.optional("rig", nonempty),
            distortion_corrected=record.optional("distortion_corrected", boolean),
        )
        return _with_positive_focal(fields, record)


FIELDS = (*XrayFields.__dataclass_fields__, "image", "polarity")
"""Every key that an X-ray's entry may have as far as reading the image is concerned."""


def _with_positive_focal(fields: XrayFields, record: Record) -> XrayFields:
    """Fields without negative focal lengths: extrinsic of the view from the source, and whether the file mirrors it."""
    if fields.intrinsics is None or not has_negative_focal(fields.intrinsics):
        return fields
    try:
        intrinsics, extrinsic, mirrored = positive_camera(fields.intrinsics, fields.extrinsic)
    except InputError as error:
        raise InputError(f"{record.place('intrinsics')}: {error}") from error
    if mirrored is not None and fields.mirrored not in (None, mirrored):
        raise InputError(
            f"{record.place('mirrored')} is {str(fields.mirrored).lower()}, but the negative focal lengths of "
            f'"intrinsics" with this "extrinsic" say {str(mirrored).lower()}; remove it.'
        )
    mirrored = fields.mirrored if mirrored is None else mirrored
    return replace(fields, intrinsics=intrinsics, extrinsic=extrinsic, mirrored=mirrored)


def _point_2d(value: Any, place: str) -> tuple[float, float]:
    """Parse a point of the image."""
    column, row = numbers(2, "[column, row] in pixels", FARTHEST)(value, place)
    return column, row


def _point_3d(value: Any, place: str) -> tuple[float, float, float]:
    """Parse a point of the patient."""
    x, y, z = numbers(3, "[x, y, z], LPS millimetres", FARTHEST)(value, place)
    return x, y, z


def _pixel_spacing(value: Any, place: str) -> tuple[float, float]:
    """Parse one spacing for both directions, or [between rows, between columns]."""
    unit = "millimetres at the detector"
    pair = (value, value) if is_real_number(value) else value
    rows, columns = numbers(2, f"[between rows, between columns], {unit}")(pair, place)
    spacing = number_in(SPACING_RANGE_MM, unit)
    return spacing(rows, place), spacing(columns, place)


def _intensity(record: Record) -> str | None:
    """The field "intensity", which "polarity" is another name of."""
    intensity = record.optional("intensity", one_of(INTENSITIES))
    polarity = record.optional("polarity", one_of(INTENSITIES))
    if intensity is not None and polarity is not None and intensity != polarity:
        raise InputError(
            f'{record.opening}"intensity" is "{intensity}" and "polarity" is "{polarity}"; '
            "they mean the same, give one."
        )
    return intensity or polarity
