"""Pixel values of one X-ray file with their meaning and first mask, before they become line integrals."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.intensity import line_integrals
from PolyPoseLib.io.xray.intensity_rules import intensity_of_tags
from PolyPoseLib.io.xray.mask import border_mask, field_mask, tagged_mask
from PolyPoseLib.io.xray.orientation import orientation_of
from PolyPoseLib.io.xray.pixels import apply_modality, stored_pixels
from PolyPoseLib.io.xray.plain import GRAY_PICTURES, default_intensity, ending_of, read_plain
from PolyPoseLib.io.xray.storage import own_scale
from PolyPoseLib.io.xray.tags import XrayTags

SMALLEST_SIDE = 16
"""An image with fewer rows or columns shows nothing that could be registered."""


@dataclass(frozen=True)
class PixelValues:
    """Values of one image, in the file's arrangement.

    Attributes
    ----------
    values
        (H, W) float32.
    mask
        (H, W) bool, True inside shutters, collimators and borders.
    meaning
        What a value means, see `PolyPoseLib.io.xray.intensity`.
    unattenuated
        Value of the direct beam, None to estimate it.
    step
        Difference between neighbouring stored values, 0 for real numbers.
    largest
        The largest value that could be stored, None to take the largest there is.

    """

    values: np.ndarray
    mask: np.ndarray
    meaning: str
    unattenuated: float | None = None
    step: float = 0.0
    largest: float | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W)."""
        height, width = self.values.shape
        return height, width

    def line_integrals(self, mask: np.ndarray, notes: Notes) -> np.ndarray:
        """Convert to line integrals (H, W) float32, looking at the pixels of a mask (H, W) only."""
        return line_integrals(
            self.values,
            mask,
            self.meaning,
            notes,
            unattenuated=self.unattenuated,
            step=self.step,
            largest=self.largest,
        )


def refuse_small(shape: tuple[int, ...], notes: Notes) -> None:
    """Raise InputError for images too small to show anything."""
    if min(shape) < SMALLEST_SIDE:
        raise InputError(
            f"{notes.where} has only {shape[0]} x {shape[1]} pixels; give an X-ray of at least {SMALLEST_SIDE} x "
            f"{SMALLEST_SIDE}."
        )


def values_of_dicom(tags: XrayTags, given: XrayFields, notes: Notes) -> PixelValues:
    """Read one frame of a DICOM file; raises InputError when its pixels cannot be read."""
    stored = stored_pixels(tags, notes)
    mask = tagged_mask(tags, stored.shape, stored, notes)
    values, order = rescaled(tags, stored, given, notes)
    if order == 0:
        return PixelValues(values, mask, "line_integral")
    scale = own_scale(tags) if given.intensity is None else {}
    meaning = _given_meaning(given, notes) or intensity_of_tags(tags, order, notes)
    if "unattenuated" not in scale:
        mask &= _border(values, meaning, given, notes)
    direct = scale.get("unattenuated") if given.unattenuated is None else given.unattenuated
    step = abs(tags.number("RescaleSlope") or 1.0)
    return PixelValues(values, mask, meaning, direct, step, _largest(tags))


def rescaled(tags: XrayTags, stored: np.ndarray, given: XrayFields, notes: Notes) -> tuple[np.ndarray, int]:
    """Stored values (H, W) of a DICOM frame on the scale that its file gives them.

    Returns
    -------
    tuple[np.ndarray, int]
        ((H, W) float32; 1 or -1: whether they rise or fall with the stored ones, 0: they are line integrals, as a
        simulation wrote them).

    Raises
    ------
    InputError
        The Modality LUT cannot be read.

    """
    scale = own_scale(tags) if given.intensity is None else {}
    if "slope" not in scale:
        return apply_modality(stored, tags, notes)
    notes.say("intensity: line integrals, scaled as the simulation that wrote the file says")
    return (stored * scale["slope"] + scale.get("intercept", 0.0)).astype(np.float32), 0


def _largest(tags: XrayTags) -> float | None:
    """Largest value after the rescaling that the bits stored allow; None when a Modality LUT hides it."""
    if tags.has("ModalityLUTSequence"):
        return None
    bits = tags.number("BitsStored") or 16
    ends = (
        (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        if tags.number("PixelRepresentation") == 1
        else (0, 2**bits - 1)
    )
    slope, intercept = tags.number("RescaleSlope") or 1.0, tags.number("RescaleIntercept") or 0.0
    return float(max(end * slope + intercept for end in ends))


def values_of_plain(path: Path, frame: int | None, given: XrayFields, notes: Notes) -> PixelValues:
    """Read a file that is not DICOM; raises InputError when it is not one gray image."""
    values, whole = read_plain(path, notes.where, frame)
    if ending_of(path) in GRAY_PICTURES and (orientation := orientation_of(path, frame)) != 1:
        notes.say(f"turned for display, as the picture's orientation {orientation} (EXIF, TIFF) says")
    return meant(values, whole, path, given, notes)


def meant(values: np.ndarray, whole: bool, path: Path, given: XrayFields, notes: Notes) -> PixelValues:
    """Values (H, W) of a file that is not DICOM with what they mean; whole: whether it holds whole numbers.

    Raises InputError for an image that is too small.
    """
    refuse_small(values.shape, notes)
    meaning = _given_meaning(given, notes) or default_intensity(path, values, whole, notes)
    mask = np.ones(values.shape, dtype=bool)
    if meaning != "line_integral" and np.ptp(values) > 0:
        mask = _border(values, meaning, given, notes)
    return PixelValues(values, mask, meaning, given.unattenuated, 1.0 if whole else 0.0)


def _given_meaning(given: XrayFields, notes: Notes) -> str | None:
    """Meaning that the study file gives."""
    if given.intensity is not None:
        notes.say(f"intensity: {given.intensity} from {notes.entry}")
    return given.intensity


def _border(values: np.ndarray, meaning: str, given: XrayFields, notes: Notes) -> np.ndarray:
    """Mask of plain borders and undeclared shutters; everything for line integrals.

    Where the study gives a mask, no shutter is looked for: a person has looked at the picture.
    """
    if meaning == "line_integral":
        return np.ones(values.shape, dtype=bool)
    blocked = "low" if meaning in ("transmission", "log_transmission") else "high"
    border = border_mask(values, blocked, meaning in ("attenuation", "log_transmission"), notes)
    if given.mask is not None:
        return border
    return border & field_mask(values, meaning, border, notes)
