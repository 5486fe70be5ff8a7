"""The pixel pitch of a DICOM X-ray against the file's other lengths, and against the sizes of detectors."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.io.xray.distance_checks import MAGNIFICATION_TOLERANCE, magnification_of
from PolyPoseLib.io.xray.tags import XrayTags

Pitch = tuple[float, float]
"""(between rows, between columns) in mm."""

USUAL_EXTENT_MM = (30.0, 1600.0)
"""From a dental sensor to a stitched radiograph of a whole body."""

SMALLEST_SIDE_PX = 256
"""Smaller images are parts or thumbnails, of which nothing follows about their detector."""

LARGEST_AT_PATIENT = 1.01
"""Pixel Spacing over the detector's pitch: what lies before the detector is magnified on it."""

_SAME = 0.01


def warn_of_pitch(tags: XrayTags, pitch: Pitch, from_dicom: bool, notes: Notes) -> None:
    """Say where other attributes disagree with the pitch.

    Parameters
    ----------
    tags
        The frame's attributes.
    pitch
        At the detector, (between rows, between columns) in mm.
    from_dicom
        Whether the file states it, and not the study.
    notes
        Receives what disagrees, with the numbers.

    """
    if from_dicom:
        _compare_with_patient(tags, pitch, notes)
        _compare_with_elements(tags, pitch, notes)
    _compare_with_field_of_view(tags, pitch, notes)
    extent = _extent(tags, pitch)
    least, largest = USUAL_EXTENT_MM
    side = min(tags.dataset.Rows, tags.dataset.Columns)
    if side >= SMALLEST_SIDE_PX and not least <= min(extent) <= max(extent) <= largest:
        notes.warn(
            f"the image spans {shown(extent)} mm by its pixel spacing {shown(pitch)} mm, which no detector does; check "
            '"pixel_spacing_mm", in millimetres.'
        )


def binned_pitch(tags: XrayTags) -> Pitch | None:
    """Pitch of the stored pixels by the detector's elements and how many of them make a pixel; None if unsaid."""
    element, binning = tags.positive_pair("DetectorElementSpacing"), tags.positive_pair("DetectorBinning")
    if element is None or binning is None:
        return None
    return element[0] * binning[0], element[1] * binning[1]


def _compare_with_patient(tags: XrayTags, pitch: Pitch, notes: Notes) -> None:
    """Pixel Spacing (0028,0030), at the patient, is smaller than the detector's pitch by the magnification."""
    at_patient = tags.positive_pair("PixelSpacing")
    if at_patient is None or np.allclose(at_patient, pitch, rtol=1e-3):
        return
    kind, share = tags.text("PixelSpacingCalibrationType"), at_patient[0] / pitch[0]
    notes.say(
        f"Pixel Spacing (0028,0030) {shown(at_patient)} ({kind or 'uncalibrated, says the file'}) is the patient's and "
        "was not used"
    )
    found = magnification_of(tags)
    if share > LARGEST_AT_PATIENT:
        notes.warn(
            f"the pixel spacing at the patient, {shown(at_patient)} mm, exceeds that at the detector, {shown(pitch)}, "
            'which cannot be: they may have been exchanged; check "pixel_spacing_mm".'
        )
    elif kind == "GEOMETRY" and found and abs(share * found[0] - 1) > MAGNIFICATION_TOLERANCE:
        notes.warn(
            f"the pixel spacings {shown(at_patient)} mm at the patient and {shown(pitch)} mm at the detector make a "
            f"magnification of {1 / share:.4g}, but {found[1]} says {found[0]:.4g}; check "
            '"pixel_spacing_mm" and "source_to_detector_mm".'
        )


def _compare_with_elements(tags: XrayTags, pitch: Pitch, notes: Notes) -> None:
    """Detector elements that were joined to one pixel, and a pitch that is theirs divided by the magnification."""
    binned, element = binned_pitch(tags), tags.positive_pair("DetectorElementSpacing")
    if binned is None or element is None or np.allclose(binned, pitch, rtol=_SAME):
        return
    if np.allclose(element, pitch, rtol=_SAME):
        joined = shown((binned[0] / element[0], binned[1] / element[1]))
        notes.warn(
            f"the pixel spacing {shown(pitch)} mm is that of one detector element, but {joined} of them make one pixel "
            f"(0018,701A): the spacing may be {shown(binned)} mm; check it, and add "
            '"pixel_spacing_mm".'
        )
    elif (found := magnification_of(tags)) and np.allclose(np.array(binned) / found[0], pitch, rtol=_SAME):
        notes.warn(
            f"the pixel spacing {shown(pitch)} mm is that of the detector, {shown(binned)} mm, divided by the "
            f"magnification {found[0]:.4g}: it may hold at the patient; check it, and add "
            '"pixel_spacing_mm", measured at the detector.'
        )


def _compare_with_field_of_view(tags: XrayTags, pitch: Pitch, notes: Notes) -> None:
    """The image's size in mm against Field of View Dimensions (0018,1149)."""
    sizes = tags.positive_pair("FieldOfViewDimensions")
    if sizes is None or tags.text("FieldOfViewShape") not in ("", "RECTANGLE"):
        return
    extent = _extent(tags, pitch)
    if not any(np.allclose(extent, order, rtol=0.03, atol=1.5) for order in (sizes, sizes[::-1])):
        notes.warn(
            f"the image spans {shown(extent)} mm by its pixel spacing but {shown(sizes)} mm by its field of view "
            '(0018,1149): it may have been cropped or resampled; check "pixel_spacing_mm".'
        )


def _extent(tags: XrayTags, pitch: Pitch) -> Pitch:
    """(height, width) of the image at the detector in mm."""
    return pitch[0] * tags.dataset.Rows, pitch[1] * tags.dataset.Columns
