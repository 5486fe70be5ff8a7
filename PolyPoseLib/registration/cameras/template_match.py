"""Normalised cross-correlation of masked images with many masked templates at every shift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

WORKERS = 2
"""Threads of the Fourier transforms."""


@dataclass(frozen=True)
class Peaks:
    """The best shift in each of several images.

    Attributes
    ----------
    correlation : np.ndarray
        (N,) in [-1, 1].
    share : np.ndarray
        (N,) of the template's weight inside the image.
    row, column : np.ndarray
        (N,) pixel of the image on which the template's middle lies.

    """

    correlation: np.ndarray
    share: np.ndarray
    row: np.ndarray
    column: np.ndarray


class MaskedMatcher:
    """Fourier transforms of images and their masks, kept for many templates.

    The template's mean is taken over all of it, also where a part hangs over the edge. Its middle must lie inside the
    image; what hangs over falls into ``half`` rows and columns of zeros, so that nothing wraps around.

    Parameters
    ----------
    images : (N, H, W) ndarray
        Normalised X-rays.
    masks : (N, H, W) ndarray
        bool, True where a pixel counts.
    half : int
        Templates have 2 half + 1 rows and columns.

    References
    ----------
    D. Padfield, "Masked object registration in the Fourier domain", IEEE TIP 21 (2012); here with weights.

    """

    def __init__(self, images: np.ndarray, masks: np.ndarray, half: int) -> None:
        self.half = half
        self.image_shape = images.shape[1:]
        self.shape = tuple(_fast_length(n + half) for n in self.image_shape)
        inside = np.where(masks, images, 0.0).astype(np.float32)
        parts = np.stack([masks.astype(np.float32), inside, inside**2])
        self.parts = np.asarray(fft.rfft2(parts, self.shape, workers=WORKERS))

    def best(self, template: np.ndarray, weight: np.ndarray, least_share: float, which: np.ndarray) -> Peaks:
        """The best shift of a template in each of several images.

        The best has the largest correlation times the root of its share: what lies outside the image is no evidence.

        Parameters
        ----------
        template, weight : (s, s) ndarray
            Values, and weights of the pixels.
        least_share : float
            Shifts that leave less of the template's weight inside the image are left out.
        which : (N,) ndarray
            Numbers of the images.

        Returns
        -------
        Peaks
            Of the N images.

        """
        total = float(weight.sum())
        count = len(which)
        if total <= 0 or count == 0:
            nothing = np.zeros(count)
            return Peaks(nothing, nothing, nothing, nothing)
        correlation, share = self._maps(template.astype(np.float32), weight.astype(np.float32), total, which)
        score = np.where(share >= least_share, correlation * np.sqrt(np.clip(share, 0, 1)), -2.0)
        score = score.reshape(count, -1)
        at = score.argmax(axis=1)
        pick = (np.arange(count), at)
        found = np.where(score[pick] > -2, correlation.reshape(count, -1)[pick], 0.0)
        row, column = np.unravel_index(at, self.image_shape)
        return Peaks(found, share.reshape(count, -1)[pick], row, column)

    def _maps(
        self, template: np.ndarray, weight: np.ndarray, total: float, which: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Correlation and share (N, H, W) with the template's middle on every pixel."""
        centred = template - float((weight * template).sum()) / total
        weighted = weight * centred
        w, wt, wtt = np.conj(self._centred_transform(np.stack([weight, weighted, weighted * centred])))
        mask, image, square = self.parts[:, which]
        products = np.stack([w * mask, wtt * mask, w * image, w * square, wt * image])
        sums = np.asarray(fft.irfft2(products, self.shape, workers=WORKERS))
        overlap, sum_tt, sum_i, sum_ii, sum_ti = sums[:, :, : self.image_shape[0], : self.image_shape[1]]
        variance = np.maximum(sum_ii - sum_i**2 / np.maximum(overlap, 1e-3 * total), 0)
        spread = np.maximum(sum_tt, 0) * variance
        return sum_ti / np.sqrt(spread + (1e-3 * total) ** 2), overlap / total

    def _centred_transform(self, templates: np.ndarray) -> np.ndarray:
        """Transforms of templates (M, s, s) whose middle is moved to the first pixel."""
        rows, columns = self.shape
        padded = np.zeros((len(templates), rows, columns), np.float32)
        side = templates.shape[1]
        row, column = ((np.arange(side) - self.half) % n for n in (rows, columns))
        for image, template in zip(padded, templates, strict=True):
            np.add.at(image, np.ix_(row, column), template)
        return np.asarray(fft.rfft2(padded, workers=WORKERS))


def _fast_length(least: int) -> int:
    """The next length from ``least`` on that Fourier transforms of real numbers are fast for."""
    length = fft.next_fast_len(least, True)
    assert length is not None
    return int(length)
