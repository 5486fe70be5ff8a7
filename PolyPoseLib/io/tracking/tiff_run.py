"""A TIFF file of several pages, read page by page."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.image_run import image_of, require_index
from PolyPoseLib.io.tracking.tiff_pages import Pages
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.plain import read_plain
from PolyPoseLib.io.xray.values import PixelValues, values_of_plain


class TiffRun:
    """The pages of one TIFF file.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors.

    Raises
    ------
    InputError
        No TIFF file, or pages of different sizes.

    """

    warnings: tuple[str, ...] = ()

    def __init__(self, path: Path, where: str) -> None:
        self.where = where
        self._pages = Pages.of(path, where)
        self.count = len(self._pages.places)
        first = self._pages.size(0, image_of(where, 0))
        for index in range(1, self.count):
            size = self._pages.size(index, image_of(where, index))
            if size != first:
                raise other_size(where, index, size, first)

    def tags(self) -> None:
        """TIFF has none of DICOM's attributes."""

    def decided(self, index: int, given: XrayFields, notes: Notes) -> PixelValues:
        """Values of one page with meaning and mask, as of a single X-ray; raises InputError."""
        with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
            return values_of_plain(self._page(index, folder), None, given, notes)

    def values(self, index: int, given: XrayFields) -> np.ndarray:
        """Values of one page (H, W) float32; raises InputError."""
        with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
            return read_plain(self._page(index, folder), image_of(self.where, index))[0]

    def _page(self, index: int, folder: str) -> Path:
        """The page as a file of its own."""
        require_index(index, self.count, self.where)
        page = Path(folder) / "page.tif"
        try:
            self._pages.write(index, page, image_of(self.where, index))
        except OSError as error:
            raise InputError(
                f"{image_of(self.where, index)} cannot be copied to the temporary folder ({error.strerror}); free some "
                "space there."
            ) from error
        return page


def other_size(where: str, index: int, size: tuple[int, ...], first: tuple[int, ...]) -> InputError:
    """The error about an image of another size than the first."""
    found, usual = (f"{each[0]} rows x {each[1]} columns" for each in (size, first))
    return InputError(
        f"{image_of(where, index)} has {found}, but the first image {usual}; give images of one size, all of one "
        "camera."
    )
