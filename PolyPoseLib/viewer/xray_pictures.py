"""X-rays and renderings as gray levels for people, and both in one picture, as the report has them."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.io.report.pictures import grey, overlay, shrunk

LARGEST_SIDE_PX = 1400
"""Pictures are averaged down to it: no screen shows more."""


def gray(image: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """(H, W) uint8, bone bright; the window is that of the pixels in the mask."""
    return grey(shrunk(image, LARGEST_SIDE_PX)[0], _kept(mask))


def compared(xray: np.ndarray, rendering: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """(H, W, 3) uint8: magenta what only the X-ray has, green what only the rendering has, gray what both have.

    Black where the X-ray was not compared.
    """
    both = overlay(shrunk(xray, LARGEST_SIDE_PX)[0], shrunk(rendering, LARGEST_SIDE_PX)[0], _kept(mask))
    return np.rint(255 * both).astype(np.uint8)


def _kept(mask: np.ndarray | None) -> np.ndarray | None:
    return None if mask is None else shrunk(mask, LARGEST_SIDE_PX)[0] > 0.5
