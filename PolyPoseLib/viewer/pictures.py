"""Arrays as PNG pictures: gray values through a window, maps through colours."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np

COMPRESSION = 1
"""Of PNG: pictures travel over the loopback, where time counts more than size."""

_SEQUENTIAL = ("#440154", "#414487", "#2a788e", "#22a884", "#7ad151", "#fde725")
_DIVERGING = ("#2166ac", "#67a9cf", "#f7f7f7", "#ef8a62", "#b2182b")
FOLD_COLOUR = "#ff00ff"


@dataclass(frozen=True)
class Scale:
    """Colours for numbers from `low` to `high`.

    Attributes
    ----------
    low, high
        Numbers that get the first and the last colour; beyond them colours stay the same.
    diverging
        From blue over white to red, instead of from dark to bright.
    logarithmic
        Whether ratios, not differences, make the colour.

    """

    low: float
    high: float
    diverging: bool = False
    logarithmic: bool = False

    def colours(self, values: np.ndarray) -> np.ndarray:
        """RGB (..., 3) uint8 of numbers."""
        share = self.shares(values)
        anchors = np.array([rgb(each) for each in self._anchors()], float)
        places = np.linspace(0, 1, len(anchors))
        return (
            np.stack([np.interp(share, places, anchors[:, n]) for n in range(3)], -1).round().astype(np.uint8)
        )

    def shares(self, values: np.ndarray) -> np.ndarray:
        """Where numbers lie between `low` (0) and `high` (1)."""
        ends, values = np.array([self.low, self.high], float), np.asarray(values, float)
        if self.logarithmic:
            ends, values = np.log(ends), np.log(np.maximum(values, 1e-9))
        return np.clip((values - ends[0]) / max(ends[1] - ends[0], 1e-12), 0, 1)

    def opacities(self, values: np.ndarray) -> np.ndarray:
        """uint8: the middle of a diverging scale, where nothing changes, is clear; everything else is opaque."""
        strength = 4 * np.abs(self.shares(values) - 0.5) if self.diverging else np.ones(np.shape(values))
        return np.rint(255 * np.minimum(strength, 1)).astype(np.uint8)

    def css(self) -> str:
        """The colours from left to right, as CSS knows a gradient."""
        anchors = list(self._anchors())
        if self.diverging:
            anchors[len(anchors) // 2] = "transparent"
        return f"linear-gradient(to right, {', '.join(anchors)})"

    def _anchors(self) -> tuple[str, ...]:
        return _DIVERGING if self.diverging else _SEQUENTIAL


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue of a colour "#rrggbb"."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def windowed(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Gray levels uint8 of numbers: black at `low`, white at `high`; NaN is black."""
    share = (np.nan_to_num(np.asarray(values, np.float32), nan=low) - low) * (255 / max(high - low, 1e-9))
    return np.clip(np.rint(share), 0, 255).astype(np.uint8)


def png(pixels: np.ndarray) -> bytes:
    """A PNG file of pixels uint8: (H, W) gray, (H, W, 3) RGB or (H, W, 4) RGBA."""
    pixels = np.ascontiguousarray(pixels, np.uint8)
    height, width = pixels.shape[:2]
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    kind = {1: 0, 3: 2, 4: 6}[channels]
    rows = np.zeros((height, 1 + width * channels), np.uint8)  # every row begins with its filter: none
    rows[:, 1:] = pixels.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), COMPRESSION)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, content) for name, content in parts)


def _chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
