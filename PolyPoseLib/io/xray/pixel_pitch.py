"""The pitch of the pixels at the detector's plane, which K needs.

DICOM says it in Imager Pixel Spacing (0018,1164); Pixel Spacing (0028,0030) may have been calibrated to the patient
(PS3.3 10.7.1) and never stands in for it without a warning.
"""

from __future__ import annotations

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.lengths import given_or_found
from PolyPoseLib.io.xray.pitch_checks import Pitch, binned_pitch, warn_of_pitch
from PolyPoseLib.io.xray.tags import XrayTags

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
        warn_of_pitch(tags, pitch, given is None, notes)
    return pitch


def _of_tags(tags: XrayTags, *, derive: bool, notes: Notes) -> tuple[Pitch | None, str]:
    """Pitch that DICOM states, or else one that follows from other attributes; (None, "") when there is none."""
    for keyword, tag in _PITCH_TAGS:
        if (pair := tags.positive_pair(keyword)) is not None:
            return pair, tag
    if not derive:
        return None, ""
    for derive_from in (_demagnified, _of_binned_elements, _of_field_of_view, _of_intensifier):
        found, origin = derive_from(tags, notes)
        if found is not None:
            return found, origin
    return None, ""


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
    """A guess: the Field of View's dimensions in mm fill the rows and columns (PS3.3 C.8.11.4.1.1)."""
    sizes = tags.numbers("FieldOfViewDimensions")
    if not sizes or min(sizes) <= 0 or tags.positive_pair("PixelSpacing"):
        return None, ""
    rows, columns = tags.dataset.Rows, tags.dataset.Columns
    high, wide = (sizes * 2)[:2]  # one number stands for both
    pair = (high / rows, wide / columns)
    if not 0.98 < pair[0] / pair[1] < 1.02:
        return None, ""
    notes.warn(
        f"nothing in the file says how large a pixel is: {shown(pair)} mm is a guess, that the field of view of "
        f"{shown(sizes)} mm (0018,1149) fills the image; if it does not, every distance is wrong by as much: measure "
        'it and add "pixel_spacing_mm".'
    )
    return pair, "(0018,1149) over rows and columns, a guess"


def _of_binned_elements(tags: XrayTags, notes: Notes) -> tuple[Pitch | None, str]:
    """Pitch from the detector's elements, where the file says how many of them make a pixel."""
    pair = binned_pitch(tags)
    if pair is None or tags.positive_pair("PixelSpacing"):
        return None, ""
    notes.warn(
        f"nothing in the file says how large a pixel is: {shown(pair)} mm is a guess, the detector's elements times "
        'their binning, which holds only where the image was not resized; add "pixel_spacing_mm" if you know it.'
    )
    return pair, "(0018,7022) times (0018,701A), a guess"


def _of_intensifier(tags: XrayTags, notes: Notes) -> tuple[Pitch | None, str]:
    """A guess: the diameter of the image intensifier fills the image's longer side."""
    size = tags.positive("IntensifierSize")
    if size is None or tags.positive_pair("PixelSpacing"):
        return None, ""
    pitch = size / max(tags.dataset.Rows, tags.dataset.Columns)
    notes.warn(
        f"nothing in the file says how large a pixel is: {shown(pitch)} mm is a guess, that the whole intensifier of "
        f"{shown(size)} mm (0018,1162) fills the image; with a zoomed field it is too large, and so is every distance: "
        'measure it and add "pixel_spacing_mm".'
    )
    return (pitch, pitch), "(0018,1162) over the longer side, a guess"
