"""Normalised cross-correlation of one masked image with many masked templates at every shift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft


@dataclass(frozen=True)
class Match:
    """score: correlation in [-1, 1]; share: of the template's weight inside the image; row, column: of the template's
    first pixel in the image.
    """

    score: float
    share: float
    row: int
    column: int


class MaskedMatcher:
    """Fourier transforms of an image and its mask, kept for many templates.

    After D. Padfield, "Masked object registration in the Fourier domain", IEEE TIP 21 (2012), with weights.

    image: (H, W); mask: (H, W) bool; largest: (h, w), no template may be larger.
    """

    def __init__(self, image: np.ndarray, mask: np.ndarray, largest: tuple[int, int]) -> None:
        self.shape = tuple(
            fft.next_fast_len(n + m - 1, True) for n, m in zip(image.shape, largest, strict=True)
        )
        self.image_shape = image.shape
        weight = mask.astype(np.float64)
        inside = np.where(mask, image, 0.0).astype(np.float64)
        self.parts = fft.rfft2(np.stack([weight, inside, inside**2]), self.shape)

    def best(
        self, template: np.ndarray, weight: np.ndarray, least_share: float, count: int, apart: int
    ) -> list[Match]:
        """The ``count`` best shifts of a template (h, w) with weights (h, w), at least ``apart`` pixels apart.

        least_share: shifts that leave less of the template's weight inside the image are left out.
        """
        total = float(weight.sum())
        if total <= 0:
            return []
        score, share = self._maps(template, weight, total)
        worth = np.where(share >= least_share, score * np.sqrt(np.minimum(share, 1)), -np.inf)
        found = []
        for _ in range(count):
            row, column = np.unravel_index(int(np.argmax(worth)), worth.shape)
            if not np.isfinite(worth[row, column]):
                break
            rows, columns = (self._signed(n, axis) for axis, n in enumerate((row, column)))
            found.append(Match(float(score[row, column]), float(share[row, column]), rows, columns))
            self._forget(worth, int(row), int(column), apart)
        return found

    def _maps(self, template: np.ndarray, weight: np.ndarray, total: float) -> tuple[np.ndarray, np.ndarray]:
        weighted = weight * template
        moving = np.conj(fft.rfft2(np.stack([weight, weighted, weighted * template]), self.shape))
        mask, image, square = self.parts
        w, wt, wtt = moving
        sums = fft.irfft2(
            np.stack([w * mask, wt * mask, wtt * mask, w * image, w * square, wt * image]), self.shape
        )
        overlap = np.maximum(sums[0], 1e-6 * total)
        product = sums[5] - sums[1] * sums[3] / overlap
        spread = np.maximum(sums[2] - sums[1] ** 2 / overlap, 0) * np.maximum(
            sums[4] - sums[3] ** 2 / overlap, 0
        )
        floor = (1e-3 * total) ** 2
        return product / np.sqrt(spread + floor), sums[0] / total

    def _signed(self, index: int, axis: int) -> int:
        """Shift of a circular index: those past the image are negative."""
        return int(index) if index < self.image_shape[axis] else int(index) - self.shape[axis]

    @staticmethod
    def _forget(worth: np.ndarray, row: int, column: int, apart: int) -> None:
        rows = np.arange(row - apart, row + apart + 1) % worth.shape[0]
        columns = np.arange(column - apart, column + apart + 1) % worth.shape[1]
        worth[np.ix_(rows, columns)] = -np.inf
