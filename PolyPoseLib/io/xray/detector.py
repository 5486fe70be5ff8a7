"""The detector of one X-ray: distance, pixel pitch and principal point, each with its origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import intrinsics_matrix
from PolyPoseLib.io.xray.distance_checks import (
    SOURCE_TO_PATIENT,
    usable_source_distance,
    warn_of_distance,
    warn_of_magnification,
)
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.lengths import given_or_found, require_usual
from PolyPoseLib.io.xray.pixel_pitch import pixel_pitch
from PolyPoseLib.io.xray.principal_point import principal_point
from PolyPoseLib.io.xray.tags import XrayTags

_DISTANCE_TAGS = (("RTImageSID", "(3002,0026)"), ("DistanceSourceToDetector", "(0018,1110)"))

_NOMINAL_DISTANCE_MM = 1000.0
"""Stands for a distance that nobody knows, where K is given and images do not depend on it."""


@dataclass(frozen=True)
class Detector:
    """A flat detector and its source.

    Attributes
    ----------
    source_to_detector_mm
        Distance along the perpendicular.
    pixel_spacing_mm
        (between rows, between columns) at the detector.
    principal_point_px
        (column, row) in the file's own pixels.
    intrinsics
        K (3, 3) in the file's own pixels.

    """

    source_to_detector_mm: float
    pixel_spacing_mm: tuple[float, float]
    principal_point_px: tuple[float, float]
    intrinsics: np.ndarray


def detector_of(tags: XrayTags | None, fields: XrayFields, shape: tuple[int, int], notes: Notes) -> Detector:
    """Find the detector's geometry; what the study file gives wins over DICOM.

    Parameters
    ----------
    tags
        The frame's attributes, None for files that are not DICOM.
    fields
        The study file's entry.
    shape
        (H, W) of the image.
    notes
        Receives every number's origin.

    Raises
    ------
    InputError
        Distance or pixel spacing unknown, or such as no detector has: names the fields to add.

    """
    if fields.intrinsics is not None:
        return _of_intrinsics(fields.intrinsics, fields, notes)
    distance, spacing = _distance(tags, fields, notes), pixel_pitch(tags, fields, notes)
    if distance is None or spacing is None:
        raise InputError(_missing(distance, spacing, tags, notes))
    principal = principal_point(tags, fields, shape, spacing, notes)
    return Detector(distance, spacing, principal, intrinsics_matrix(distance, spacing, *shape, principal))


def _of_intrinsics(intrinsics: np.ndarray, fields: XrayFields, notes: Notes) -> Detector:
    """Detector of a K that the user gives; distance and pitch are known only up to one common factor."""
    fx, fy = float(intrinsics[0, 0]), float(intrinsics[1, 1])
    notes.say(f"intrinsics from {notes.entry}: focal lengths {fx:.6g}, {fy:.6g} px")
    if fields.source_to_detector_mm is None and fields.pixel_spacing_mm is not None:
        distance = fx * fields.pixel_spacing_mm[1]
        require_usual("source_to_detector_mm", distance, "by its focal length and pixel spacing", notes)
    else:
        distance = fields.source_to_detector_mm or _NOMINAL_DISTANCE_MM
    principal = (float(intrinsics[0, 2]), float(intrinsics[1, 2]))
    return Detector(distance, (distance / fy, distance / fx), principal, intrinsics)


def _distance(tags: XrayTags | None, fields: XrayFields, notes: Notes) -> float | None:
    """Distance from the source to the detector in mm."""
    stated = [(tags.positive(keyword), tag) for keyword, tag in _DISTANCE_TAGS] if tags else []
    found, origin = next(((value, tag) for value, tag in stated if value is not None), (None, ""))
    distance = given_or_found("source_to_detector_mm", fields.source_to_detector_mm, found, origin, notes)
    if distance is not None:
        warn_of_distance(distance, fields.source_to_detector_mm is None, notes)
    if tags is not None and fields.source_to_detector_mm is None and distance is not None:
        warn_of_magnification(tags, notes)
        if tags.text("Modality") != "RTIMAGE" and fields.source_to_isocenter_mm is None:
            stated = [(tags.positive(key), key) for key in SOURCE_TO_PATIENT]
            usable_source_distance(stated, distance, Notes(notes.where, notes.entry))
    return distance


def _missing(
    distance: float | None, spacing: tuple[float, float] | None, tags: XrayTags | None, notes: Notes
) -> str:
    """Sentence that names the fields to add, and which of them is known already."""
    unsaid = "DICOM does not say" if tags else "the file cannot say"
    where, entry = notes.where, notes.entry
    if distance is not None:
        return (
            f'{where}: {_why_no_pitch(tags, unsaid)}; add "pixel_spacing_mm", measured at the detector, to its entry '
            f'in {entry} ("source_to_detector_mm" is known: {shown(distance)}).'
        )
    if spacing is not None:
        return (
            f'{where}: {unsaid} how far the source is from the detector; add "source_to_detector_mm" to its entry in '
            f'{entry} ("pixel_spacing_mm" is known: {shown(spacing)}).'
        )
    return (
        f"{where}: {unsaid} how far the source is from the detector and how large a pixel is there; add "
        f'"source_to_detector_mm" and "pixel_spacing_mm" to its entry in {entry}.'
    )


def _why_no_pitch(tags: XrayTags | None, unsaid: str) -> str:
    """Why there is no pitch: none at all, or one that may be the patient's."""
    at_patient = tags.positive_pair("PixelSpacing") if tags else None
    if tags is None or at_patient is None:
        return f"{unsaid} how large a pixel is at the detector"
    kind = tags.text("PixelSpacingCalibrationType")
    if kind:
        return (
            f"Pixel Spacing (0028,0030) {shown(at_patient)} is calibrated at the patient ({kind}) and no magnification "
            "leads back to the detector"
        )
    return f"Pixel Spacing (0028,0030) {shown(at_patient)} may hold at the detector or in the patient"
