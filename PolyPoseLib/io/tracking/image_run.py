"""What the readers of a camera's images have in common, and the choice of one of them by what the path leads to."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import looks_like_dicom
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.plain import ending_of
from PolyPoseLib.io.xray.tags import XrayTags
from PolyPoseLib.io.xray.values import PixelValues
from PolyPoseLib.io.xray.video import VIDEO_ENDINGS

TIFF_ENDINGS = (".tif", ".tiff")
"""File names of pictures that may have several pages."""


class ImageRun(Protocol):
    """The images of one camera as their files hold them, read one at a time.

    Every method raises InputError, whose sentence begins with the file and the image's number, counted from 0.
    """

    @property
    def count(self) -> int:
        """Number of images."""
        ...

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is odd about the files, without their names."""
        ...

    def tags(self) -> XrayTags | None:
        """Attributes of the first image, where it is DICOM."""
        ...

    def decided(self, index: int, given: XrayFields, notes: Notes) -> PixelValues:
        """Pixel values of one image with their meaning and a mask, as of a single X-ray."""
        ...

    def values(self, index: int, given: XrayFields) -> np.ndarray:
        """The same values (H, W) float32 alone, which is much faster."""
        ...


def open_run(path: Path, where: str) -> ImageRun:
    """Open the images of one camera.

    Parameters
    ----------
    path
        A multi-frame DICOM file, a film, a picture of several pages, a stack, or a folder of images.
    where
        Opening of the sentences of errors.

    Raises
    ------
    InputError
        There are no images, or they cannot be read.

    """
    refuse_special_file(path, where)
    if path.is_dir():
        from PolyPoseLib.io.tracking.folder_run import open_folder

        return open_folder(path, where)
    return open_file(path, where)


def open_file(path: Path, where: str) -> ImageRun:
    """Open a file that holds all images of one camera; raises InputError."""
    name = path.name.lower()
    if name.endswith(VIDEO_ENDINGS):
        from PolyPoseLib.io.tracking.film_run import FilmRun

        return FilmRun(path, where)
    if name.endswith(TIFF_ENDINGS):
        from PolyPoseLib.io.tracking.tiff_run import TiffRun

        return TiffRun(path, where)
    if ending_of(path):
        from PolyPoseLib.io.tracking.stack_run import StackRun

        return StackRun(path, where)
    if not path.is_file() or not looks_like_dicom(path):
        raise InputError(
            f"{where} is none of a folder of images, a multi-frame DICOM file, a multi-page TIFF and a film (AVI, MP4, "
            "MOV); give one of these."
        )
    from PolyPoseLib.io.tracking.dicom_run import DicomRun

    return DicomRun(path, where)


def require_index(index: int, count: int, where: str) -> None:
    """Refuse the number of an image that there is not; raises InputError."""
    if not 0 <= index < count:
        raise InputError(
            f"{where} has {count} image{'s' * (count != 1)}, so number {index} (counted from 0) does not exist; "
            f"give a number below {count}."
        )


def image_of(where: str, index: int) -> str:
    """Opening of sentences about one image of several."""
    return f"{where}: image {index} (counted from 0)"
