"""The image toolkit's reader for a file, chosen by the file's name alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.image_headers import refuse_hostile_header
from PolyPoseLib.io.nifti import NIFTI_ENDINGS

if TYPE_CHECKING:
    import SimpleITK as sitk

_FORMATS = {
    "NiftiImageIO": NIFTI_ENDINGS,
    "NrrdImageIO": (".nrrd", ".nhdr"),
    "MetaImageIO": (".mha", ".mhd"),
    "PNGImageIO": (".png",),
    "TIFFImageIO": (".tif", ".tiff"),
    "JPEGImageIO": (".jpg", ".jpeg"),
}


def reader_for(path: Path, where: str | None = None) -> sitk.ImageFileReader:
    """A reader of the format that the name's ending stands for, for a file whose header the toolkit survives.

    Left to itself, the toolkit inspects the content, and reads for example HDF5 under every name: a format that takes
    voxels from other files, which nobody has checked.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors, the path when None.

    Raises
    ------
    InputError
        A pipe or device, or a header that would end the process.

    """
    refuse_special_file(path, where)
    refuse_hostile_header(path, where or str(path))
    import SimpleITK as sitk

    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    name = path.name.lower()
    reader.SetImageIO(next((kind for kind, endings in _FORMATS.items() if name.endswith(endings)), ""))
    return reader
