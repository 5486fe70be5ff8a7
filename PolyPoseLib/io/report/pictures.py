"""The images of a report: X-rays and renderings as people look at them, 8 bits, no larger than they are shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

MIDDLE = 0.42
"""Median of a shown picture, of 1."""

PLAIN = 0.2
"""Range of an image's values, of the widest among several, below which it is blank."""


def shrunk(image: np.ndarray, largest_side: int) -> tuple[np.ndarray, int]:
    """An image (H, W) by block means, so that no side has more pixels, and the blocks' size in pixels."""
    image = np.nan_to_num(np.asarray(image, dtype=np.float32))
    factor = min(-(-max(image.shape) // largest_side), *image.shape)
    if factor <= 1:
        return image, 1
    height, width = (n // factor * factor for n in image.shape)
    blocks = image[:height, :width].reshape(height // factor, factor, width // factor, factor)
    return blocks.mean(axis=(1, 3)), factor


def grey(image: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """An image (H, W) as uint8, bone bright: most of its slow variation taken away, as radiography consoles show it.

    mask: (H, W) bool, by which the window is chosen.
    """
    flat = _without_slow_variation(image)
    return GreyScale._of_flat(flat, mask)._shown(flat)


@dataclass(frozen=True)
class GreyScale:
    """The window by which one image is shown in grey, and others of the same kind without flicker.

    low, high: values, once slow variation is taken away, that become black and white; gamma: exponent between them.
    """

    low: float
    high: float
    gamma: float

    @classmethod
    def of(cls, image: np.ndarray, mask: np.ndarray | None = None) -> GreyScale:
        """Choose it by an image (H, W) where a mask (H, W) bool holds."""
        return cls._of_flat(_without_slow_variation(image), mask)

    @classmethod
    def of_several(cls, images: Sequence[tuple[np.ndarray, np.ndarray]]) -> GreyScale:
        """Choose it by images with their masks, some of which may be blank; all are then shown alike."""
        scales = [cls.of(*each) for each in images]
        least = PLAIN * max(each.high - each.low for each in scales)
        shown = [each for each in scales if each.high - each.low >= least]
        return cls(*np.median([[each.low, each.high, each.gamma] for each in shown], axis=0).tolist())

    @classmethod
    def _of_flat(cls, flat: np.ndarray, mask: np.ndarray | None) -> GreyScale:
        kept = flat[mask] if mask is not None and mask.any() else flat
        low, high = np.percentile(kept, (1, 99.8))
        share = np.clip((flat - low) / max(high - low, 1e-6), 0, 1)
        return cls(float(low), float(high), _gamma(share if mask is None else share[mask]))

    def __call__(self, image: np.ndarray) -> np.ndarray:
        """Show an image (H, W) as uint8."""
        return self._shown(_without_slow_variation(image))

    def _shown(self, flat: np.ndarray) -> np.ndarray:
        share = np.clip((flat - self.low) / max(self.high - self.low, 1e-6), 0, 1)
        return (255 * share**self.gamma).astype(np.uint8)


def _without_slow_variation(image: np.ndarray) -> np.ndarray:
    return image - 0.75 * gaussian_filter(image, max(image.shape) / 12)


def _gamma(shares: np.ndarray) -> float:
    """The exponent by which the median of values in [0, 1] becomes a middle grey, on which coloured lines show."""
    median = float(np.median(shares)) if shares.size else 0.5
    return float(np.clip(np.log(MIDDLE) / np.log(np.clip(median, 1e-3, 0.999)), 0.7, 4.0))


def window(image: np.ndarray) -> tuple[float, float]:
    """Slope and offset, for values in [0, 1], by which a part of a shown image (uint8) uses the whole scale."""
    low, high = np.percentile(image, (1, 99)) / 255
    slope = float(np.clip(0.9 / max(high - low, 1e-3), 1.0, 6.0))
    return slope, float(0.45 - slope * (low + high) / 2)


def overlay(xray: np.ndarray, rendering: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """RGB (H, W, 3) in [0, 1]: the X-ray in magenta, the rendering in green; grey where both agree.

    Both are flattened first (local mean removed, local contrast made equal), so that edges of bones show whatever
    the exposure was.
    """
    return Overlays(xray, mask)(rendering)


class Overlays:
    """One X-ray with one rendering after another over it, as ``overlay`` makes them; the X-ray is flattened once."""

    def __init__(self, xray: np.ndarray, mask: np.ndarray | None = None) -> None:
        """xray: (H, W); mask: (H, W) bool, outside which nothing is shown."""
        self._flattened = Flattening(xray.shape, mask)
        self._xray = self._flattened(xray)

    def __call__(self, rendering: np.ndarray) -> np.ndarray:
        """RGB (H, W, 3) in [0, 1] with a rendering (H, W)."""
        return np.stack([self._xray, self._flattened(rendering), self._xray], axis=-1)


class Flattening:
    """Takes the slow variation out of images of one shape, and gives them equal contrast everywhere."""

    def __init__(self, shape: tuple[int, ...], mask: np.ndarray | None = None) -> None:
        """shape: (H, W); mask: (H, W) bool, outside which the images are not looked at."""
        self._inside = np.ones(shape, np.float32) if mask is None else np.asarray(mask, np.float32)
        self._scale = max(shape) / 20
        self._near = gaussian_filter(self._inside, self._scale) + 1e-6
        self._far = gaussian_filter(self._inside, 2 * self._scale) + 1e-6

    def __call__(self, image: np.ndarray) -> np.ndarray:
        """An image (H, W), in [0, 1]; 0 outside the mask."""
        image = np.nan_to_num(np.asarray(image, dtype=np.float32))
        detail = (image - gaussian_filter(image * self._inside, self._scale) / self._near) * self._inside
        contrast = np.sqrt(gaussian_filter(detail**2, 2 * self._scale) / self._far)
        floor = 0.15 * float(contrast.max()) + 1e-9
        return np.clip(0.42 + 0.28 * detail / (contrast + floor), 0, 1) * (self._inside > 0)
