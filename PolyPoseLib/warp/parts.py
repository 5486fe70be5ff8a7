"""Connected parts of structures, each in its own small box: ribs are one structure but many small boxes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.geometry.grid import connected_components, grown_box

MAX_PARTS = 200
"""A structure in more connected parts than this is handled as a whole."""


@dataclass(frozen=True)
class Part:
    """One connected part of a structure: its label n, a box of slices (k, j, i), and where it is in the box."""

    label: int
    box: tuple[slice, ...]
    mask: np.ndarray


def connected_parts(labels: np.ndarray, border: ArrayLike) -> Iterator[Part]:
    """Parts of all labels, connected by faces, edges or corners.

    Parameters
    ----------
    labels : (k, j, i) array of integers
        0 is background.
    border : array_like
        Voxels along (k, j, i), or one number, by which each box is wider than its part, as far as the array
        reaches.

    Yields
    ------
    Part
        One part after another, ordered by label.

    """
    from scipy.ndimage import find_objects

    for n, tight in enumerate(find_objects(labels), start=1):
        if tight is None:
            continue
        parts, count = connected_components(labels[tight] == n, np.ones((3, 3, 3)))
        if count > MAX_PARTS:
            parts = (parts > 0).astype(np.int32)
        for m, inner in enumerate(find_objects(parts), start=1):
            exact = tuple(
                slice(t.start + s.start, t.start + s.stop) for t, s in zip(tight, inner, strict=True)
            )
            box = grown_box(exact, border, labels.shape)
            mask = np.zeros([s.stop - s.start for s in box], dtype=bool)
            place = tuple(slice(e.start - b.start, e.stop - b.start) for e, b in zip(exact, box, strict=True))
            mask[place] = parts[inner] == m
            yield Part(n, box, mask)
