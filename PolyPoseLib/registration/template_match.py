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

    score: (N,) correlation in [-1, 1]; share: (N,) of the template's weight inside the image; row, column: (N,) of
    the template's first pixel in the image.
    """

    score: np.ndarray
    share: np.ndarray
    row: np.ndarray
    column: np.ndarray


class MaskedMatcher:
    """Fourier transforms of images and their masks, kept for many templates.

    After D. Padfield, "Masked object registration in the Fourier domain", IEEE TIP 21 (2012), with weights.

    images: (N, H, W); masks: (N, H, W) bool; largest: (h, w), no template may be larger.
    """

    def __init__(self, images: np.ndarray, masks: np.ndarray, largest: tuple[int, int]) -> None:
        self.image_shape = images.shape[1:]
        self.shape = tuple(
            fft.next_fast_len(n + m - 1, True) for n, m in zip(self.image_shape, largest, strict=True)
        )
        inside = np.where(masks, images, 0.0).astype(np.float32)
        parts = np.stack([masks.astype(np.float32), inside, inside**2])
        self.parts = fft.rfft2(parts, self.shape, workers=WORKERS)

    def best(self, template: np.ndarray, weight: np.ndarray, least_share: float, which: np.ndarray) -> Peaks:
        """The best shift of a template (h, w) with weights (h, w) in each of the images ``which`` (N,).

        The best has the largest score times the root of its share: what lies outside the image explains nothing.
        least_share: shifts that leave less of the template's weight inside the image are left out.
        """
        total = float(weight.sum())
        count = len(which)
        if total <= 0 or count == 0:
            empty = np.zeros(0)
            return Peaks(empty, empty, empty.astype(int), empty.astype(int))
        score, share = self._maps(template.astype(np.float32), weight.astype(np.float32), total, which)
        worth = np.where(share >= least_share, score * np.sqrt(np.clip(share, 0, 1)), -2.0).reshape(count, -1)
        at = worth.argmax(axis=1)
        row, column = np.unravel_index(at, self.shape)
        pick = (np.arange(count), at)
        found = np.where(worth[pick] > -2, score.reshape(count, -1)[pick], -1.0)
        return Peaks(found, share.reshape(count, -1)[pick], self._signed(row, 0), self._signed(column, 1))

    def _maps(
        self, template: np.ndarray, weight: np.ndarray, total: float, which: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Score and share (N, rows, columns) at every circular shift."""
        weighted = weight * template
        moving = np.stack([weight, weighted, weighted * template])
        w, wt, wtt = np.conj(fft.rfft2(moving, self.shape, workers=WORKERS))
        mask, image, square = self.parts[:, which]
        products = np.stack([w * mask, wt * mask, wtt * mask, w * image, w * square, wt * image])
        overlap, sum_t, sum_tt, sum_i, sum_ii, sum_ti = fft.irfft2(products, self.shape, workers=WORKERS)
        safe = np.maximum(overlap, 1e-3 * total)
        product = sum_ti - sum_t * sum_i / safe
        spread_t = np.maximum(sum_tt - sum_t**2 / safe, 0)
        spread_i = np.maximum(sum_ii - sum_i**2 / safe, 0)
        return product / np.sqrt(spread_t * spread_i + (1e-3 * total) ** 2), overlap / total

    def _signed(self, index: np.ndarray, axis: int) -> np.ndarray:
        """Shifts of circular indices: those past the image are negative."""
        return np.where(index < self.image_shape[axis], index, index - self.shape[axis])
