"""The mask that the field "mask" names: an image whose pixels that are not zero are used."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.folder import file_of_field
from PolyPoseLib.io.xray.plain import ending_of, read_plain

_SMALLEST_SHARE = 0.001
"""A mask that uses a smaller share of the image counts as empty."""


def read_mask(mask: str | Path, folder: Path, shape: tuple[int, int], notes: Notes) -> np.ndarray:
    """Read the field "mask", (H, W) bool.

    Parameters
    ----------
    mask
        A text must stay inside the folder; a Path was checked by the caller.
    folder
        Where a relative name starts.
    shape
        (H, W) of the image.
    notes
        Receives how much is removed.

    Raises
    ------
    InputError
        Outside the folder, not an image, another size than the X-ray, or nothing left.

    """
    target = file_of_field(folder, mask, "mask", notes)
    if not target.is_file() or not ending_of(target):
        raise InputError(
            f'{notes.where}: the "mask" is not a PNG, TIFF, NIfTI or NRRD file; correct its path.'
        )
    pixels = read_plain(target, f"{notes.where}: its mask")[0]
    if pixels.shape != shape:
        raise InputError(
            f'{notes.where}: the "mask" has {pixels.shape[0]} x {pixels.shape[1]} pixels and the image {shape[0]} x '
            f"{shape[1]}; give a mask of the image's size."
        )
    used = pixels != 0
    if used.mean() < _SMALLEST_SHARE:
        raise InputError(f'{notes.where}: the "mask" leaves no pixels; mark what is to be used with 1.')
    notes.say(f"mask: as given, removes {1 - used.mean():.1%}")
    return used
