"""How noisy an X-ray is, read off the X-ray itself."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion, correlate1d

CLASSES = 24
"""Levels of brightness that each have a noise of their own."""

SECOND_DIFFERENCE = (1.0, -2.0, 1.0)
"""Along rows and columns: anatomy passes badly, noise well (Immerkaer, Comput Vis Image Underst 64, 1996)."""

_GAIN = float(np.sum(np.square(SECOND_DIFFERENCE)))
"""Standard deviation of white noise after both differences, over that before."""

_NORMAL_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal number."""

_LEAST_PIXELS = 50
_MOST_PIXELS = 200_000


def noise_map(image: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Standard deviation of the noise at every pixel of ``image`` (H, W), float32, in its unit.

    X-ray noise depends on brightness, so that pixels are sorted into classes of it; in each, the median of the
    second difference along rows and columns tells the noise (edges are few and do not reach the median).  Where
    neighbouring pixels share their noise, as after smoothing, it comes out too small.

    mask: (H, W) bool, pixels that count; without enough of them the noise is taken to be zero.
    """
    difference = np.where(mask, image, 0).astype(np.float64)
    for axis in (0, 1):
        difference = correlate1d(difference, SECOND_DIFFERENCE, axis=axis, mode="nearest")
    inner = np.flatnonzero(binary_erosion(mask, np.ones((3, 3), bool)))
    if len(inner) < _LEAST_PIXELS:
        return np.zeros(image.shape, np.float32)
    inner = inner[:: -(-len(inner) // _MOST_PIXELS)]
    values = image.ravel()[inner]
    found = np.abs(difference.ravel()[inner]) / (_NORMAL_MEDIAN * _GAIN)
    count = min(CLASSES, len(values) // _LEAST_PIXELS)
    parts = np.array_split(np.argsort(values, kind="stable"), count)
    middles = np.array([np.median(values[part]) for part in parts])
    deviations = np.array([np.median(found[part]) for part in parts])
    return np.interp(image, middles, deviations).astype(np.float32)
