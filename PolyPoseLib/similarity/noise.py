"""The noise of an X-ray, estimated from the X-ray itself."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion, correlate1d

CLASSES = 24
"""Classes of brightness, each with its own noise."""

SECOND_DIFFERENCE = (1.0, -2.0, 1.0)
"""Filter along rows and columns that suppresses anatomy and keeps noise."""

_GAIN = float(np.sum(np.square(SECOND_DIFFERENCE)))
"""Standard deviation of white noise after both differences, over that before."""

_NORMAL_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal number."""

_LEAST_PIXELS = 50
_MOST_PIXELS = 200_000


def noise_map(image: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Standard deviation of the noise at every pixel of an X-ray.

    X-ray noise depends on brightness, so that pixels are sorted into classes of it; in each, the median of the
    second difference along rows and columns gives the noise (edges are few and do not reach the median). Where
    neighbouring pixels share their noise, as after smoothing, the estimate is too small.

    Parameters
    ----------
    image : (H, W) array
        The X-ray, any unit.
    mask : (H, W) array of bool
        Pixels that count; without enough of them the noise is taken to be zero.

    Returns
    -------
    (H, W) array of float32
        In the image's unit.

    References
    ----------
    J. Immerkaer, "Fast noise variance estimation", Comput. Vis. Image Underst. 64, 1996.

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
