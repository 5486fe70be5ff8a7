"""The pitch of the pixels at the detector's plane, which K needs.

DICOM says it in Imager Pixel Spacing (0018,1164); Pixel Spacing (0028,0030) may have been calibrated to the patient
(PS3.3 10.7.1) and never stands in for it without a warning.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.lengths import given_or_found
from PolyPoseLib.io.xray.tags import XrayTags

Pitch = tuple[float, float]
"""(between rows, between columns) in mm."""

_PITCH_TAGS = (
    ("ImagePlanePixelSpacing", "(3002,0011)"),
    ("ImagerPixelSpacing", "(0018,1164)"),
    ("NominalScannedPixelSpacing", "(0018,2010)"),
)


def pixel_pitch(tags: XrayTags | None, fields: XrayFields, notes: Notes) -> Pitch | None:
    """Pitch at the detector, None when neither the study file nor DICOM says it.

    Parameters
    ----------
    tags
        The frame's attributes, None for files that are not DICOM.
    fields
        The study file's entry, which wins over DICOM.
    notes
        Receives the origin, and what other attributes say otherwise.

    Raises
    ------
    InputError
        DICOM's pitch is one that no detector has.

    """
    given = fields.pixel_spacing_mm
    if tags is None:
        return given_or_found("pixel_spacing_mm", given, None, "", notes)
    found, origin = _of_tags(tags, derive=given is None, notes=notes)
    pitch = given_or_found("pixel_spacing_mm", given, found, origin, notes)
    if pitch is not None:
        _compare(tags, pitch, given is None, notes)
    return pitch


def _of_tags(tags: XrayTags, *, derive: bool, notes: Notes) -> tuple[Pitch | None, str]:
    """Pitch that DICOM states, or else one that follows from other attributes; (None, "") when there is none."""
    for keyword, tag in _PITCH_TAGS:
        if (pair := tags.positive_pair(keyword)) is not None:
            return pair, tag
    if not derive:
        return None, ""
    found, origin = _demagnified(tags, notes)
    return (found, origin) if found is not None else _of_field_of_view(tags, notes)


def _demagnified(tags: XrayTags, notes: Notes) -> tuple[Pitch | None, str]:
    """Pitch at the detector from Pixel Spacing calibrated at the patient, where its magnification is known.

    The magnification is the Estimated Radiographic Magnification Factor (0018,1114), or, for the calibration type
    GEOMETRY, the distance to the detector over that to the patient. The depth of a FIDUCIAL is unknown, so it needs
    the factor.
    """
    pair = tags.positive_pair("PixelSpacing")
    kind = tags.text("PixelSpacingCalibrationType")
    if pair is None or kind not in ("GEOMETRY", "FIDUCIAL"):
        return None, ""
    factor, source = tags.positive("EstimatedRadiographicMagnificationFactor"), "(0018,1114)"
    far, near = tags.positive("DistanceSourceToDetector"), tags.positive("DistanceSourceToPatient")
    if factor is None and kind == "GEOMETRY" and far and near:
        factor, source = far / near, "(0018,1110) over (0018,1111)"
    if factor is None or factor < 1:
        return None, ""
    notes.warn(
        f"the detector's pixel spacing was computed from Pixel Spacing {shown(pair)}, calibrated at the patient "
        f'({kind}), and the magnification {factor:.4g} of {source}; add "pixel_spacing_mm" if you know it.'
    )
    return (pair[0] * factor, pair[1] * factor), f"(0028,0030) times the magnification of {source}"


def _of_field_of_view(tags: XrayTags, notes: Notes) -> tuple[Pitch | None, str]:
    """Pitch from the Field of View's dimensions in mm over the rows and columns (PS3.3 C.8.11.4.1.1)."""
    sizes = tags.numbers("FieldOfViewDimensions")
    if not sizes or min(sizes) <= 0 or tags.positive_pair("PixelSpacing"):
        return None, ""
    rows, columns = tags.dataset.Rows, tags.dataset.Columns
    high, wide = (sizes * 2)[:2]  # one number stands for both
    pair = (high / rows, wide / columns)
    if not 0.98 < pair[0] / pair[1] < 1.02:
        return None, ""
    notes.warn(
        f"the pixel spacing {shown(pair)} is the field of view {shown(sizes)} mm over the pixels; add "
        '"pixel_spacing_mm" if you know it.'
    )
    return pair, "(0018,1149) over rows and columns"


def _compare(tags: XrayTags, pitch: Pitch, from_dicom: bool, notes: Notes) -> None:
    """Say where other attributes disagree with the pitch."""
    at_patient = tags.positive_pair("PixelSpacing")
    if from_dicom and at_patient and not np.allclose(at_patient, pitch, rtol=1e-3):
        kind = tags.text("PixelSpacingCalibrationType") or "uncalibrated, says the file"
        notes.say(f"Pixel Spacing (0028,0030) {shown(at_patient)} ({kind}) is the patient's and was not used")
    sizes = tags.positive_pair("FieldOfViewDimensions")
    if sizes is None or tags.text("FieldOfViewShape") not in ("", "RECTANGLE"):
        return
    extent = (pitch[0] * tags.dataset.Rows, pitch[1] * tags.dataset.Columns)
    if not any(np.allclose(extent, order, rtol=0.03, atol=1.5) for order in (sizes, sizes[::-1])):
        notes.warn(
            f"the image spans {shown(extent)} mm by its pixel spacing but {shown(sizes)} mm by its field of view "
            '(0018,1149): it may have been cropped or resampled; check "pixel_spacing_mm".'
        )
