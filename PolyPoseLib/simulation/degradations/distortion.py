"""The image intensifier: pincushion and S-shaped distortion in a round field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import map_coordinates

from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View

ROUND_FIELD = 1.1
"""Radius of the intensifier's picture relative to half of the image: the corners are dark."""


def intensifier(degraded: DegradedCase, rng: np.random.Generator) -> DegradedCase:
    """Straight lines bend outwards by 5 to 7 % at the edge, and turn by 2 to 3 degrees, otherwise in every position."""
    pincushion = rng.uniform(0.05, 0.07)

    def distort(view: View, _: int) -> View:
        turn = np.radians(rng.uniform(2, 3)) * rng.choice([-1, 1])
        rows, columns = undistorted_pixels(view.line.shape, pincushion, turn)
        line, body = (
            map_coordinates(image, (rows, columns), order=1, mode="nearest")
            for image in (view.line, view.body)
        )
        height, width = view.line.shape
        row, column = np.indices((height, width))
        radius = np.hypot(row - (height - 1) / 2, column - (width - 1) / 2) / (min(height, width) / 2)
        leaves = (
            np.ones_like(line)
            if view.leaves is None
            else map_coordinates(view.leaves, (rows, columns), order=1)
        )
        vignetting = 1 - 0.25 * radius**2
        outside = radius > ROUND_FIELD
        blanked = outside if view.blanked is None else view.blanked | outside
        return replace(
            view, line=line, body=body, leaves=leaves * np.where(outside, 2e-3, vignetting), blanked=blanked
        )

    return degraded.with_views(distort)


def undistorted_pixels(
    shape: tuple[int, ...], pincushion: float, turn: float
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (H, W) of an ideal image that appear at each pixel of the distorted one.

    Parameters
    ----------
    shape : (int, int)
        Of the image, (H, W).
    pincushion : float
        Relative displacement outwards at half of the smaller side; it grows with the radius cubed.
    turn : float
        Rotation in rad at half of the smaller side, growing with the radius squared: the S.

    """
    height, width = shape
    half = min(height, width) / 2
    row, column = np.indices((height, width), dtype=float)
    seen = ((column - (width - 1) / 2) + 1j * (row - (height - 1) / 2)) / half
    ideal = seen.copy()
    for _ in range(25):
        square = np.minimum(np.abs(ideal) ** 2, 2.2)
        ideal = seen / (1 + pincushion * square) * np.exp(-1j * turn * square)
    return ideal.imag * half + (height - 1) / 2, ideal.real * half + (width - 1) / 2
