"""What a track was made from, as digests: by them a later run knows whether it has the same sequence before it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.sequence import Sequence

LOOKED_AT = 9
"""Images of a camera that stand for all of them: reading every one takes minutes."""

PLACE_MM = 1e-6
"""Places of the CT's voxels count to this."""


@dataclass(frozen=True)
class TrackInputs:
    """Digests (SHA-256, 64 hexadecimal digits) of a sequence's arrays, and its range as the options had it.

    Parameters
    ----------
    ct : str
        Of the CT's voxels and their places.
    labels : str
        Of the structures.
    images : mapping of str to str
        Of some images of every camera, by the camera's name.
    first : int
        The option "first".
    last : int or None
        The option "last"; None for the end.

    """

    ct: str
    labels: str
    images: Mapping[str, str]
    first: int
    last: int | None


def inputs_of(sequence: Sequence) -> TrackInputs:
    """The digests of a sequence; raises InputError for an image that cannot be read."""
    options = sequence.options
    images = {}
    for view in sequence.views:
        digest = hashlib.sha256()
        for number in spread(sequence.frames):
            image, mask = view.images.read(view.first + number)
            digest.update(image.tobytes())
            digest.update(np.packbits(mask).tobytes())
        images[view.name] = digest.hexdigest()
    return TrackInputs(
        ct=_digest(_steps(sequence.ct.affine), sequence.ct.voxels),
        labels=_digest(sequence.structures.labels),
        images=images,
        first=options.first,
        last=options.last,
    )


def spread(numbers: range, most: int = LOOKED_AT) -> list[int]:
    """At most so many numbers of a range, evenly spread, its first and last among them."""
    places = np.linspace(0, len(numbers) - 1, min(most, len(numbers))).round().astype(int)
    return [numbers[place] for place in dict.fromkeys(places.tolist())]


def _steps(affine: np.ndarray) -> np.ndarray:
    """An affine (4, 4), mm, in whole steps: whoever saves and opens a CT again takes its axes' lengths out and in.

    Numbers that people and devices write lie amid a step, and not where the last bit decides between two.
    """
    return np.floor(np.asarray(affine, dtype=np.float64) / PLACE_MM + 1 / np.pi)


def _digest(*arrays: np.ndarray) -> str:
    """Of the arrays' kinds, shapes and values."""
    digest = hashlib.sha256()
    for each in arrays:
        digest.update(f"{each.dtype.str}{each.shape}".encode())
        digest.update(np.ascontiguousarray(each).data)
    return digest.hexdigest()
