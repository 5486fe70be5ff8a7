"""The regressor's input from an X-ray: images that do not depend on its scale of intensity."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.registration.cameras.coarse_search import PATCH_MM
from PolyPoseLib.registration.fit.levels import FLAT_LINE_INTEGRAL
from PolyPoseLib.similarity.local_contrast import LocalContrast

CHANNELS = 3
"""Locally normalised, normalised as a whole, mask."""

LARGEST = 4.0
"""Normalised values are clipped to this many standard deviations."""


def network_input(
    image: np.ndarray, mask: np.ndarray, detector: VirtualDetector, distance_mm: float
) -> np.ndarray:
    """The network's input from an image on the virtual detector.

    Parameters
    ----------
    image : (side, side) array
        Line integrals.
    mask : (side, side) array of bool
        Pixels that count.
    detector : VirtualDetector
        The detector of the image.
    distance_mm : float
        Nominal distance from the source to the anchor, where the patches of the local contrast are measured.

    Returns
    -------
    (CHANNELS, side, side) array of float32
        Zero outside the mask.

    """
    counted = image[mask]
    if counted.size == 0:
        return np.zeros((CHANNELS, *image.shape), np.float32)
    deviation = max(float(counted.std()), 1e-3)
    whole = np.where(mask, (image - counted.mean()) / deviation, 0)
    pixel_mm = 2 * detector.half_tangent * distance_mm / detector.side
    patch = 2 * max(1, round(PATCH_MM / pixel_mm / 2)) + 1
    local = LocalContrast(mask, patch, FLAT_LINE_INTEGRAL).normalise(whole.astype(np.float32)).values
    return np.stack([np.clip(local, -LARGEST, LARGEST), np.clip(whole, -LARGEST, LARGEST), mask]).astype(
        np.float32
    )
