"""A stack in one file that is not read image by image: NIfTI, NRRD, MetaImage, or a single picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.io.tracking.image_run import require_index
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.plain import GRAY_PICTURES, ending_of, read_plain, read_stack
from PolyPoseLib.io.xray.values import PixelValues, meant


class StackRun:
    """All images of one file, which are in memory as they are stored.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors.

    Raises
    ------
    InputError
        It cannot be read, or is larger than any sequence of X-rays that is kept so.

    """

    warnings: tuple[str, ...] = ()

    def __init__(self, path: Path, where: str) -> None:
        self.path, self.where = path, where
        if ending_of(path) in GRAY_PICTURES:
            values, self._whole = read_plain(path, where)
            self._images = values[None]
        else:
            self._images = read_stack(path, where)
            self._whole = self._images.dtype.kind in "ui"
        self.count = len(self._images)

    def tags(self) -> None:
        """There are none of DICOM's attributes."""

    def decided(self, index: int, given: XrayFields, notes: Notes) -> PixelValues:
        """Values of one image with meaning and mask, as of a single X-ray; raises InputError."""
        return meant(self.values(index, given), self._whole, self.path, given, notes)

    def values(self, index: int, given: XrayFields) -> np.ndarray:
        """Values of one image (H, W) float32; raises InputError."""
        require_index(index, self.count, self.where)
        return self._images[index].astype(np.float32)
