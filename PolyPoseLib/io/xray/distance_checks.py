"""A DICOM file's distances against each other and against what stands and detectors can have."""

from __future__ import annotations

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.tags import XrayTags

LEAST_DISTANCE_MM = 250.0
"""From a source to its detector: the smallest C-arms, for hands, have 350 mm. Less is another unit."""

USUAL_DISTANCE_MM = (350.0, 3500.0)
"""From hand-held C-arms to radiographs of whole spines and legs, taken from 3 m."""

SOURCE_TO_PATIENT = ("DistanceSourceToIsocenter", "DistanceSourceToPatient")
"""Keywords of a C-arm's or radiograph's distance to the isocentre, the better one first."""

SAME_DISTANCE = 0.01
"""Share by which two distances that are meant to be the same may differ."""

LARGEST_MAGNIFICATION = 4.0
"""Of a patient on a detector."""

MAGNIFICATION_TOLERANCE = 0.1
"""Share by which a stated magnification may differ from that of the distances: one is often that of another plane."""


def warn_of_distance(distance: float, from_dicom: bool, notes: Notes) -> None:
    """Refuse or flag a distance from the source to the detector, mm, that no stand has.

    Parameters
    ----------
    distance
        In mm.
    from_dicom
        Whether the file states it; what a person typed is only flagged.
    notes
        Receives the warning.

    Raises
    ------
    InputError
        DICOM's distance is below `LEAST_DISTANCE_MM`.

    """
    if from_dicom and distance < LEAST_DISTANCE_MM:
        raise InputError(
            f"{notes.where}: DICOM says that the source is {shown(distance)} mm from the detector, but no stand is so "
            f'short; the number may be in centimetres: add the right "source_to_detector_mm" to its entry in '
            f"{notes.entry}."
        )
    least, largest = USUAL_DISTANCE_MM
    if not least <= distance <= largest:
        notes.warn(
            f"the source is {shown(distance)} mm from the detector, outside of the usual {least:g} to {largest:g} mm; "
            'check "source_to_detector_mm".'
        )


def usable_source_distance(
    stated: list[tuple[float | None, str]], source_to_detector_mm: float, notes: Notes
) -> tuple[float | None, str]:
    """DICOM's distance from the source to the isocentre or patient, mm, with its keyword; (None, "") without one.

    Parameters
    ----------
    stated
        Distances in the order of preference, each with its keyword.
    source_to_detector_mm
        Distance to the detector.
    notes
        Receives a warning about one that cannot be used.

    Raises
    ------
    InputError
        The patient would be behind the detector.

    """
    for value, keyword in stated:
        if value is None:
            continue
        share = value / source_to_detector_mm
        if share > 1 + SAME_DISTANCE:
            raise InputError(
                f"{notes.where}: the patient is {shown(value)} mm from the source by DICOM {keyword}, behind the "
                f'detector at {shown(source_to_detector_mm)} mm; add the right "source_to_detector_mm", or '
                f'"source_to_isocenter_mm", to its entry in {notes.entry}.'
            )
        if share > 1 - SAME_DISTANCE or share < 1 / LARGEST_MAGNIFICATION:
            notes.warn(
                f"DICOM {keyword} says that the patient is {shown(value)} mm from the source and the detector "
                f"{shown(source_to_detector_mm)} mm, which cannot both be right; the patient's distance was ignored: "
                'check "source_to_detector_mm", and add "source_to_isocenter_mm" if you know it.'
            )
            continue
        return value, keyword
    return None, ""


def magnification_of(tags: XrayTags) -> tuple[float, str] | None:
    """Magnification of the patient by the file's distances, or else as it is stated, with its origin."""
    far, near = tags.positive("DistanceSourceToDetector"), tags.positive("DistanceSourceToPatient")
    if far and near and 1 < far / near <= LARGEST_MAGNIFICATION:
        return far / near, "(0018,1110) over (0018,1111)"
    factor = tags.positive("EstimatedRadiographicMagnificationFactor")
    return (factor, "(0018,1114)") if factor and 1 < factor <= LARGEST_MAGNIFICATION else None


def warn_of_magnification(tags: XrayTags, notes: Notes) -> None:
    """Flag a magnification (0018,1114) that is not that of the file's distances; exactly 1 is an empty field."""
    factor, found = tags.positive("EstimatedRadiographicMagnificationFactor"), magnification_of(tags)
    if factor is None or found is None or factor == 1:
        return
    if abs(factor / found[0] - 1) > MAGNIFICATION_TOLERANCE:
        notes.warn(
            f"the file states a magnification of {factor:.4g} (0018,1114), but its distances make it {found[0]:.4g}; "
            'one is wrong: check "source_to_detector_mm" and "source_to_isocenter_mm".'
        )
