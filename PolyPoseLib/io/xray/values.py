"""Pixel values of one X-ray file with their meaning and first mask, before they become line integrals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import XrayTags
from PolyPoseLib.io.xray import intensity as xray_intensity
from PolyPoseLib.io.xray import mask as xray_mask
from PolyPoseLib.io.xray import pixels as xray_pixels
from PolyPoseLib.io.xray import plain as xray_plain
from PolyPoseLib.io.xray.fields import XrayFields

SMALLEST_SIDE = 16
"""An image with fewer rows or columns shows nothing that could be registered."""


@dataclass(frozen=True)
class PixelValues:
    """Values of one image, in the file's arrangement.

    Attributes:
        values: (H, W) float32.
        mask: (H, W) bool, True inside shutters, collimators and borders.
        meaning: what a value means, see xray_intensity.
        unattenuated: value of the direct beam, None to estimate it.
        step: difference between neighbouring stored values, 0 for real numbers.
        largest: the largest value that could be stored, None to take the largest there is.

    """

    values: np.ndarray
    mask: np.ndarray
    meaning: str
    unattenuated: float | None = None
    step: float = 0.0
    largest: float | None = None

    def line_integrals(self, mask: np.ndarray, notes: Notes) -> np.ndarray:
        """Convert to line integrals (H, W) float32, looking at the pixels of a mask (H, W) only."""
        return xray_intensity.line_integrals(
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
    stored = xray_pixels.stored_pixels(tags, notes)
    mask = xray_mask.tagged_mask(tags, stored.shape, stored, notes)
    calibration = xray_intensity.own_calibration(tags) if given.intensity is None else {}
    if "slope" in calibration:
        notes.say("intensity: line integrals, scaled as the simulation that wrote the file says")
        lines = stored * calibration["slope"] + calibration.get("intercept", 0.0)
        return PixelValues(lines.astype(np.float32), mask, "line_integral")
    values, order = xray_pixels.apply_modality(stored, tags, notes)
    meaning = _given_meaning(given, notes) or xray_intensity.intensity_of_tags(tags, order, notes)
    if "unattenuated" not in calibration:
        mask &= _border(values, meaning, notes)
    direct = calibration.get("unattenuated") if given.unattenuated is None else given.unattenuated
    step = abs(tags.number("RescaleSlope") or 1.0)
    return PixelValues(values, mask, meaning, direct, step, _largest(tags))


def _largest(tags: XrayTags) -> float | None:
    """Largest value after the rescaling that the bits stored allow; None when a Modality LUT hides it."""
    if XrayTags.raw("ModalityLUTSequence", tags.dataset):
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
    values, whole = xray_plain.read_plain(path, notes.where, frame)
    refuse_small(values.shape, notes)
    meaning = _given_meaning(given, notes) or xray_plain.default_intensity(path, values, whole, notes)
    mask = np.ones(values.shape, dtype=bool)
    if meaning != "line_integral" and np.ptp(values) > 0:
        mask = _border(values, meaning, notes)
    return PixelValues(values, mask, meaning, given.unattenuated, 1.0 if whole else 0.0)


def _given_meaning(given: XrayFields, notes: Notes) -> str | None:
    """Meaning that the study file gives."""
    if given.intensity is not None:
        notes.say(f"intensity: {given.intensity} from {notes.entry}")
    return given.intensity


def _border(values: np.ndarray, meaning: str, notes: Notes) -> np.ndarray:
    """Mask of plain borders for values of this meaning; everything for line integrals."""
    if meaning == "line_integral":
        return np.ones(values.shape, dtype=bool)
    blocked = "low" if meaning in ("transmission", "log_transmission") else "high"
    return xray_mask.border_mask(values, blocked, meaning in ("attenuation", "log_transmission"), notes)


def study_folder(path: Path, fields: Mapping[str, Any]) -> Path:
    """Folder that the field "image" starts from when the path ends as the field says, else the image's
    folder.
    """
    named = Path(str(fields.get("image") or path.name))
    parts = named.parts
    if not named.is_absolute() and ".." not in parts and path.parts[-len(parts) :] == parts:
        return path.parents[len(parts) - 1]
    return path.parent


def read_mask(mask: str | Path, folder: str | Path, shape: tuple[int, ...], notes: Notes) -> np.ndarray:
    """Read the field "mask", (H, W) bool.

    Args:
        mask: a text must stay inside the folder; a Path was checked by the caller.
        folder: where a relative name starts.
        shape: (H, W) of the image.
        notes: receives how much is removed.

    Raises:
        InputError: outside the folder, not an image, or another size than the image.

    """
    target = Path(folder) / mask
    if isinstance(mask, str) and not target.resolve().is_relative_to(Path(folder).resolve()):
        raise InputError(
            f'{notes.where}: the "mask" lies outside the study\'s folder; move it into the folder.'
        )
    if not target.is_file() or not xray_plain.ending_of(target):
        raise InputError(
            f'{notes.where}: the "mask" is not a PNG, TIFF, NIfTI or NRRD file; correct its path.'
        )
    pixels = xray_plain.read_plain(target, f"{notes.where}: its mask")[0]
    return xray_mask.given_mask(pixels, shape, notes)
