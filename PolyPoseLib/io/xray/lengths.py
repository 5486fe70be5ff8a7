"""Lengths that the study file or DICOM gives: which of the two counts, and whether a detector can have it."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from PolyPoseLib.data.notes import Notes, shown
from PolyPoseLib.data.xray import DISTANCE_RANGE_MM
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.fields import SPACING_RANGE_MM

Length = TypeVar("Length", float, tuple[float, float])

_RANGES = {"source_to_detector_mm": DISTANCE_RANGE_MM, "pixel_spacing_mm": SPACING_RANGE_MM}


def given_or_found(
    name: str, given: Length | None, found: Length | None, origin: str, notes: Notes
) -> Length | None:
    """The user's value or else DICOM's, with a line that says which; None when there is neither.

    Parameters
    ----------
    name
        The field's name.
    given
        Value of the study file, mm; it has been checked.
    found
        Value of DICOM, mm.
    origin
        Tags that `found` comes from.
    notes
        Receives the line.

    Raises
    ------
    InputError
        DICOM's value is used and no detector has it.

    """
    if given is not None:
        also = f" (DICOM {origin} says {shown(found)})" if found is not None else ""
        notes.say(f"{name} {shown(given)} from {notes.entry}{also}")
        return given
    if found is not None:
        require_usual(name, found, f"by DICOM {origin}", notes)
        notes.say(f"{name} {shown(found)} from DICOM {origin}")
    return found


def require_usual(name: str, value: float | tuple[float, float], origin: str, notes: Notes) -> None:
    """Refuse a distance or a pitch in mm that no detector has; raises InputError that names the field to add."""
    least, largest = _RANGES[name]
    if not least <= np.min(value) <= np.max(value) <= largest:
        raise InputError(
            f"{notes.where}: its {name} is {shown(value)} {origin}, not from {least:g} to {largest:g} mm; add the "
            f'right "{name}" to its entry in {notes.entry}.'
        )
