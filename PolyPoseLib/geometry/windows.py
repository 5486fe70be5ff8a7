"""Rectangular parts of an image."""

from __future__ import annotations

Window = tuple[int, int, int, int]
"""Row 0, row 1, column 0, column 1 of a part of an image, ends excluded."""


def slices_of(window: Window) -> tuple[slice, slice]:
    """A window as an index into the whole image."""
    return slice(window[0], window[1]), slice(window[2], window[3])
