"""Locally normalised images: the residual that the second-order solver minimises.

An image is compared after subtracting the mean and dividing by the standard deviation of the patch around every
pixel.  The sum of squared differences of two images so normalised is twice their patch-wise normalised
cross-correlation distance, whatever the local gain and offset (exposure, scatter, tissue that the CT lacks).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np
from scipy.ndimage import uniform_filter1d

from PolyPoseLib.geometry.windows import Window


def box_mean(images: np.ndarray, size: int) -> np.ndarray:
    """Mean over size x size patches of (..., H, W), zeros beyond the border."""
    means = uniform_filter1d(images, size, axis=-1, mode="constant")
    return uniform_filter1d(means, size, axis=-2, mode="constant")


class LocalContrast:
    """Local normalisation with a mask.

    Parameters
    ----------
    mask : (H, W) array of bool
        Pixels that count.
    size : int
        Odd patch width in pixels.
    floor : float
        Standard deviation (in line integrals) below which a patch counts as flat, so that noise is not blown up.
    noise : float or (H, W) array
        Standard deviation of the X-ray's noise (in line integrals), which a rendering lacks: its patches are scaled
        as if it had it.

    """

    def __init__(self, mask: np.ndarray, size: int, floor: float, noise: np.ndarray | float = 0.0) -> None:
        self.mask = mask.astype(np.float32)
        self.size = size
        self.floor = floor
        self.noise = noise
        share = box_mean(self.mask, size)
        self.share = np.maximum(share, np.float32(1e-6))
        self.support = (mask & (share > 0.25)).astype(np.float32)

    def cropped(self, rows: slice, columns: slice) -> LocalContrast:
        """The normalisation of a part of the image; it differs only where a patch crosses the part's border."""
        noise = np.broadcast_to(self.noise, self.mask.shape)[rows, columns]
        return LocalContrast(self.mask[rows, columns] > 0, self.size, self.floor, noise)

    def mean(self, images: np.ndarray, rows: slice = slice(None), columns: slice = slice(None)) -> np.ndarray:
        """Patch means of (..., h, w) images that cover the given part of the whole."""
        return box_mean(images * self.mask[rows, columns], self.size) / self.share[rows, columns]

    def normalise(self, image: np.ndarray, noisy: bool = False) -> NormalisedImage:
        """Normalise an image.

        Parameters
        ----------
        image : (H, W) array
            Line integrals.
        noisy : bool
            Whether it is the X-ray itself, which has its noise already.

        Returns
        -------
        NormalisedImage
            The normalised image, with what its derivative needs.

        """
        if image.shape != self.mask.shape:  # compiled loops do not look where they read
            raise ValueError(f"an image of shape {image.shape} for a mask of shape {self.mask.shape}")
        lacking = 0.0 if noisy else self.noise**2
        least_variance = np.empty(self.mask.shape)
        least_variance[:] = self.floor**2 + lacking
        loops = _compiled()
        if loops is None:
            return self._normalised(image, least_variance)
        parts = [np.empty(self.mask.shape, np.float32) for _ in range(4)]
        views = self.mask, self.share, self.support, least_variance
        loops.normalise(np.ascontiguousarray(image, np.float32), *views, self.size, *parts)
        return NormalisedImage(*parts)

    def _normalised(self, image: np.ndarray, least_variance: np.ndarray) -> NormalisedImage:
        """:meth:`normalise` without compiled loops."""
        centred = np.where(self.mask > 0, image, 0).astype(np.float64)
        centred = centred - centred.sum() / max(self.mask.sum(), 1.0)
        mean = self.mean(centred)
        variance = np.maximum(self.mean(centred * centred) - mean * mean, 0)
        deviation = np.sqrt(variance + least_variance)
        values = (centred - mean) / deviation * self.support
        return NormalisedImage(
            values.astype(np.float32),
            centred.astype(np.float32),
            mean.astype(np.float32),
            deviation.astype(np.float32),
        )

    def derivative(
        self, image: NormalisedImage, changes: np.ndarray, window: Window
    ) -> tuple[np.ndarray, Window]:
        """Derivative of a normalised image by changes of the image.

        Parameters
        ----------
        image : NormalisedImage
            As :meth:`normalise` returns it.
        changes : (C, h, w) array
            Changes of the image inside a window, zero elsewhere.
        window : Window
            The window.

        Returns
        -------
        (C, h', w') array
            Changes of the normalised image.
        Window
            The window, grown by the patch, outside of which they are zero.

        """
        height, width = self.mask.shape
        if changes.shape[1:] != (window[1] - window[0], window[3] - window[2]):
            raise ValueError(f"changes of shape {changes.shape} for the window {window}")
        grow = self.size // 2
        row0, row1 = max(window[0] - grow, 0), min(window[1] + grow, height)
        column0, column1 = max(window[2] - grow, 0), min(window[3] + grow, width)
        outer = row0, row1, column0, column1
        loops = _compiled()
        if loops is None:
            return self._derivative(image, changes, window, outer), outer
        changed = np.empty((len(changes), row1 - row0, column1 - column0), np.float32)
        parts = image.values, image.centred, image.mean, image.deviation
        views = self.mask, self.share, self.support
        changes = np.ascontiguousarray(changes, np.float32)
        loops.differentiate(parts, changes, window, *views, self.size, outer, changed)
        return changed, outer

    def _derivative(
        self, image: NormalisedImage, changes: np.ndarray, window: Window, outer: Window
    ) -> np.ndarray:
        """:meth:`derivative` inside a grown window, without compiled loops."""
        row0, row1, column0, column1 = outer
        rows, columns = slice(row0, row1), slice(column0, column1)
        grown = np.zeros((len(changes), row1 - row0, column1 - column0), np.float32)
        grown[:, window[0] - row0 : window[1] - row0, window[2] - column0 : window[3] - column0] = changes
        mean = self.mean(grown, rows, columns)
        product = self.mean(grown * image.centred[rows, columns], rows, columns)
        deviation = image.deviation[rows, columns]
        slope = (product - image.mean[rows, columns] * mean) / deviation**2
        result = (grown - mean) / deviation - image.values[rows, columns] * slope
        return result * self.support[rows, columns]


@cache
def _compiled() -> ModuleType | None:
    """The compiled loops, where numba is installed."""
    try:
        from PolyPoseLib.similarity import local_contrast_kernels
    except ImportError:
        return None
    return local_contrast_kernels


@dataclass(frozen=True)
class NormalisedImage:
    """A normalised image, and what its derivative needs.

    Attributes
    ----------
    values : (H, W) array of float32
        The normalised image.
    centred, mean, deviation : (H, W) array of float32
        The image less its global mean, and its patches' means and standard deviations.

    """

    values: np.ndarray
    centred: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray
