"""X-rays and renderings as gray levels for people, and both in one picture."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.viewer.pictures import windowed

LARGEST_SIDE_PX = 1400
"""Pictures are averaged down to it: no screen shows more."""


def gray(image: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """(H, W) uint8, bone bright, with most of the slow variation taken away, as radiography consoles show it.

    The window is that of the pixels in the mask.
    """
    from scipy.ndimage import gaussian_filter

    image = _shrunk(image)
    sharp = image - 0.75 * gaussian_filter(image, max(image.shape) / 12)
    kept = sharp if mask is None else sharp[_shrunk(mask) > 0.5]
    low, high = np.percentile(kept if kept.size else sharp, (1, 99.8))
    return windowed(sharp, low, high)


def compared(xray: np.ndarray, rendering: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """(H, W, 3) uint8: magenta what only the X-ray has, green what only the rendering has, gray what both have.

    Black where the X-ray was not compared.
    """
    from PolyPoseLib.io.report import overlay

    kept = None if mask is None else _shrunk(mask) > 0.5
    return np.rint(255 * overlay(_shrunk(xray), _shrunk(rendering), kept)).astype(np.uint8)


def _shrunk(image: np.ndarray) -> np.ndarray:
    """By block means."""
    image = np.nan_to_num(np.asarray(image, np.float32))
    factor = -(-max(image.shape) // LARGEST_SIDE_PX)
    if factor <= 1:
        return image
    height, width = (n // factor * factor for n in image.shape)
    blocks = image[:height, :width].reshape(height // factor, factor, width // factor, factor)
    return blocks.mean(axis=(1, 3))
