"""Capital letters and figures as bitmaps of 5 x 7 dots, drawn smoothly at any size and angle."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

_ROWS = {
    "A": "0E 11 11 1F 11 11 11", "B": "1E 11 11 1E 11 11 1E", "C": "0E 11 10 10 10 11 0E",
    "D": "1E 11 11 11 11 11 1E", "E": "1F 10 10 1E 10 10 1F", "F": "1F 10 10 1E 10 10 10",
    "G": "0E 11 10 17 11 11 0F", "H": "11 11 11 1F 11 11 11", "I": "0E 04 04 04 04 04 0E",
    "K": "11 12 14 18 14 12 11", "L": "10 10 10 10 10 10 1F", "M": "11 1B 15 15 11 11 11",
    "N": "11 19 15 13 11 11 11", "O": "0E 11 11 11 11 11 0E", "P": "1E 11 11 1E 10 10 10",
    "R": "1E 11 11 1E 14 12 11", "S": "0F 10 10 0E 01 01 1E", "T": "1F 04 04 04 04 04 04",
    "U": "11 11 11 11 11 11 0E", "V": "11 11 11 11 11 0A 04", "X": "11 11 0A 04 0A 11 11",
    "Y": "11 11 0A 04 04 04 04", "0": "0E 11 13 15 19 11 0E", "1": "04 0C 04 04 04 04 0E",
    "2": "0E 11 01 06 08 10 1F", "3": "0E 11 01 06 01 11 0E", "4": "02 06 0A 12 1F 02 02",
    "5": "1F 10 1E 01 01 11 0E", "6": "06 08 10 1E 11 11 0E", "7": "1F 01 02 04 08 08 08",
    "8": "0E 11 11 0E 11 11 0E", "9": "0E 11 11 0F 01 02 0C", ":": "00 04 04 00 04 04 00",
    ".": "00 00 00 00 00 0C 0C", "-": "00 00 00 1F 00 00 00", " ": "00 00 00 00 00 00 00",
}  # fmt: skip


def text_bitmap(text: str) -> np.ndarray:
    """(7, 6 n - 1) bool of a text's dots; raises KeyError for a sign that has none."""
    glyphs = [_glyph(sign) for sign in text]
    return np.concatenate([np.pad(each, ((0, 0), (0, 1))) for each in glyphs], axis=1)[:, :-1]


def draw_text(
    shape: tuple[int, int], text: str, centre: tuple[float, float], height_px: float, turn_deg: float = 0.0
) -> np.ndarray:
    """Coverage (H, W) from 0 to 1 of a text.

    Parameters
    ----------
    shape : (int, int)
        Of the image, (H, W).
    text : str
        Of the signs that have a bitmap.
    centre : (float, float)
        (row, column) of its middle.
    height_px : float
        Of a letter.
    turn_deg : float
        Counter-clockwise as seen on a screen.

    """
    fine = np.kron(np.pad(text_bitmap(text), 1).astype(float), np.ones((8, 8)))
    fine = np.clip((gaussian_filter(fine, 3.0) - 0.5) * 4 + 0.5, 0, 1)
    scale = 7 * 8 / height_px
    angle = np.radians(turn_deg)
    row, column = np.indices(shape, dtype=float)
    down, right = (row - centre[0]) * scale, (column - centre[1]) * scale
    inside = (
        np.sin(angle) * right + np.cos(angle) * down + (fine.shape[0] - 1) / 2,
        np.cos(angle) * right - np.sin(angle) * down + (fine.shape[1] - 1) / 2,
    )
    smooth = gaussian_filter(fine, 0.4 * scale) if scale > 1 else fine
    return map_coordinates(smooth, inside, order=1, mode="constant")


def _glyph(sign: str) -> np.ndarray:
    """(7, 5) bool."""
    rows = [int(part, 16) for part in _ROWS[sign].split()]
    return np.array([[bool(row >> (4 - column) & 1) for column in range(5)] for row in rows])
