"""Whether an X-ray may bear the distortion of an image intensifier, which shows in its round field.

The intensifier's curved entrance bends straight lines outwards, by 5 to 7 % at the edge of the field, and the earth's
magnetic field into an S (S. Rudin, D. Bednarek and R. Wong, "Accurate characterization of image intensifier
distortion", Medical Physics 18, 1991). The bones themselves do not show it: a camera that is a little off explains
most of it.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.io.xray.calibrated import Calibrated
from PolyPoseLib.io.xray.tags import XrayTags

ROUNDNESS = 0.02
"""Distance of nine tenths of the field's border from a circle at most, relative to its radius."""

RADIUS = (0.35, 0.75)
"""Of a round field, relative to the image's shorter side: beyond, its corners hardly show."""

LEAST_ARC = 3
"""Quadrants in which the border of a round field shows at least."""


def maybe_distorted(tags: XrayTags | None, mask: np.ndarray, calibrated: Calibrated, notes: Notes) -> bool:
    """Whether nothing says that an intensifier's distortion was corrected.

    Parameters
    ----------
    tags : XrayTags or None
        The frame's attributes, where it is DICOM.
    mask : (H, W) ndarray
        bool, True within the field.
    calibrated : Calibrated
        The entry, and whether it has a calibration.
    notes : Notes
        Receives a warning.

    Returns
    -------
    bool
        False for flat detectors, calibrated X-rays and known cameras, and where the study says so.

    """
    given = calibrated.fields
    if given.distortion_corrected is not None:
        return not given.distortion_corrected
    if given.calibration is not None or given.camera == "known":
        return False
    shape = "" if tags is None else tags.text("FieldOfViewShape")
    if shape == "RECTANGLE" or not (shape == "ROUND" or is_round(mask)):
        return False
    notes.warn(
        "its field is round, as an image intensifier's: unless its distortion was corrected, bones may be several "
        'millimetres off, as their intervals say; if it was corrected, add "distortion_corrected": true.'
    )
    return True


def is_round(mask: np.ndarray) -> bool:
    """Whether a field (H, W) bool is bounded by a circle, of which the image's sides may cut off parts."""
    inner = np.asarray(binary_erosion(mask, border_value=1), dtype=bool)
    border = np.argwhere(mask & ~inner)
    side = min(mask.shape)
    if len(border) < side / 4:
        return False
    # Least squares for the circle x^2 + y^2 = 2 a x + 2 b y + c, from the image's middle.
    place = border - (np.array(mask.shape) - 1) / 2
    square = (place**2).sum(axis=1)
    solution, *_ = np.linalg.lstsq(np.c_[2 * place, np.ones(len(place))], square, rcond=None)
    centre = solution[:2]
    radius = np.sqrt(max(solution[2] + centre @ centre, 0.0))
    if not RADIUS[0] * side < radius < RADIUS[1] * side:
        return False
    off = np.abs(np.linalg.norm(place - centre, axis=1) / radius - 1)
    on = (place - centre)[off <= ROUNDNESS]
    quadrants = {(bool(row), bool(column)) for row, column in on > 0}
    return len(on) >= 0.9 * len(place) and len(quadrants) >= LEAST_ARC
