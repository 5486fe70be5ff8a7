"""One picture from an X-ray and a rendering: arrays in, RGB out."""

from __future__ import annotations

import enum

import numpy as np

_TINT = np.array([1.0, 0.62, 0.15], np.float32)
"""Colour of the rendering's edges over the grey X-ray."""

_SQUARES = (24, 3)
"""Squares along the shorter side of a checkerboard, from amount 0 to 1."""


class Mode(enum.Enum):
    """How two images are compared, in the order of the panel's list."""

    BLEND = 0
    CHECKERBOARD = 1
    FLICKER = 2
    EDGES = 3
    XRAY = 4
    RENDERING = 5


def normalized(image: np.ndarray) -> np.ndarray:
    """An image (H, W) as float32 from 0 to 1, between its 1st and 99th percentile; a flat one is 0."""
    sample = image[:: max(1, image.shape[0] // 128), :: max(1, image.shape[1] // 128)]
    low, high = np.percentile(sample, (1, 99))
    if not high > low:
        return np.zeros(image.shape, np.float32)
    return np.clip((image.astype(np.float32) - low) / (high - low), 0, 1)


def enhanced(image: np.ndarray) -> np.ndarray:
    """An image (H, W) as float32 from 0 to 1 in which bones stand out: half as it is, half by local contrast."""
    plain = normalized(image)
    return np.clip(0.45 * plain + 0.55 * (0.5 + 0.22 * local_contrast(plain)), 0, 1)


def local_contrast(image: np.ndarray) -> np.ndarray:
    """How far each pixel lies from its neighbourhood's mean, in standard deviations (H, W)."""
    radius = max(2, min(image.shape) // 16)
    image = image.astype(np.float64)
    mean = _box_mean(image, radius)
    variance = np.maximum(_box_mean(image**2, radius) - mean**2, 0)
    return ((image - mean) / (np.sqrt(variance) + 0.04)).astype(np.float32)


def _box_mean(image: np.ndarray, radius: int) -> np.ndarray:
    """Mean over squares of 2 radius + 1 pixels; the edge pixels are repeated."""
    side = 2 * radius + 1
    padded = np.pad(image, ((radius + 1, radius), (radius + 1, radius)), mode="edge")
    sums = padded.cumsum(axis=0).cumsum(axis=1)
    return (sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]) / side**2


def shrunk(image: np.ndarray, factor: int) -> np.ndarray:
    """Block means of an image (H, W); rows and columns that do not fill a block are dropped."""
    height, width = (size // factor for size in image.shape)
    blocks = image[: height * factor, : width * factor].reshape(height, factor, width, factor)
    return blocks.mean(axis=(1, 3), dtype=np.float32)


def resized(image: np.ndarray, height: int, width: int) -> np.ndarray:
    """The nearest pixels of an image at another size."""
    if image.shape == (height, width):
        return image
    rows = np.minimum((np.arange(height) + 0.5) * image.shape[0] / height, image.shape[0] - 1).astype(int)
    columns = np.minimum((np.arange(width) + 0.5) * image.shape[1] / width, image.shape[1] - 1).astype(int)
    return image[np.ix_(rows, columns)]


def compared(
    xray: np.ndarray, rendering: np.ndarray | None, mode: Mode, amount: float, phase: bool = False
) -> np.ndarray:
    """A picture (H, W, 3) uint8 of an X-ray (H, W) and a rendering of it.

    amount: 0 to 1: share of the rendering, size of the squares, or strength of the edges. phase: which of the
    two a flicker shows. Without a rendering the X-ray is shown alone.
    """
    grey = enhanced(xray)
    if rendering is None or mode is Mode.XRAY or (mode is Mode.FLICKER and not phase):
        return _rgb(grey[..., None] * np.ones(3, np.float32))
    drawn = enhanced(resized(rendering, *xray.shape))
    if mode in (Mode.RENDERING, Mode.FLICKER):
        return _rgb(drawn[..., None] * np.ones(3, np.float32))
    if mode is Mode.CHECKERBOARD:
        return _rgb(np.where(_squares(grey.shape, amount), drawn, grey)[..., None] * np.ones(3, np.float32))
    if mode is Mode.EDGES:
        edges = edges_of(local_contrast(drawn))[..., None] * min(1.0, 2 * amount)
        return _rgb(grey[..., None] * (1 - edges) + edges * _TINT)
    # Grey where both agree; orange where only the rendering is bright, blue where only the X-ray is.
    share = np.array([min(1.0, 2 * amount), amount, max(0.0, 2 * amount - 1)], np.float32)
    return _rgb((1 - share) * grey[..., None] + share * drawn[..., None])


def edges_of(image: np.ndarray) -> np.ndarray:
    """Strength 0 to 1 of the edges of an image (H, W)."""
    down, across = np.gradient(_smoothed(_smoothed(image)))
    strength = np.hypot(down, across)
    top = np.percentile(strength, 99)
    if not top > 0:
        return np.zeros_like(image)
    return np.clip((strength / top - 0.3) / 0.5, 0, 1).astype(np.float32)


def _smoothed(image: np.ndarray) -> np.ndarray:
    """A 3 x 3 mean."""
    padded = np.pad(image, 1, mode="edge")
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    return (rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9


def _squares(shape: tuple[int, int], amount: float) -> np.ndarray:
    count = _SQUARES[0] + (_SQUARES[1] - _SQUARES[0]) * amount
    side = max(2, round(min(shape) / count))
    rows, columns = np.indices(shape) // side
    return (rows + columns) % 2 == 1


def _rgb(picture: np.ndarray) -> np.ndarray:
    return np.clip(picture * 255, 0, 255).astype(np.uint8)
