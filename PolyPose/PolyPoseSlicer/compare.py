"""One picture from an X-ray and a rendering: arrays in, RGB out."""

from __future__ import annotations

import enum

import numpy as np

_TINT = np.array([1.0, 0.62, 0.15], np.float32)
"""Colour of the rendering over the grey X-ray."""

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


def shrunk(image: np.ndarray, factor: int) -> np.ndarray:
    """Block means of an image (H, W); rows and columns that fill no block are dropped."""
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
    grey = normalized(xray)
    if rendering is None or mode is Mode.XRAY or (mode is Mode.FLICKER and not phase):
        return _rgb(grey[..., None] * np.ones(3, np.float32))
    drawn = normalized(resized(rendering, *xray.shape))
    if mode in (Mode.RENDERING, Mode.FLICKER):
        return _rgb(drawn[..., None] * np.ones(3, np.float32))
    if mode is Mode.CHECKERBOARD:
        return _rgb(np.where(_squares(grey.shape, amount), drawn, grey)[..., None] * np.ones(3, np.float32))
    if mode is Mode.EDGES:
        edges = edges_of(drawn)[..., None] * min(1.0, 2 * amount)
        return _rgb(grey[..., None] * (1 - edges) + edges * _TINT)
    return _rgb((1 - amount) * grey[..., None] + amount * drawn[..., None] * _TINT)


def edges_of(image: np.ndarray) -> np.ndarray:
    """Strength 0 to 1 of the edges of an image (H, W)."""
    smooth = _smoothed(_smoothed(image))
    down, across = np.gradient(smooth)
    strength = np.hypot(down, across)
    top = np.percentile(strength, 97)
    if not top > 0:
        return np.zeros_like(image)
    return np.clip((strength / top - 0.35) / 0.65, 0, 1).astype(np.float32)


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
