"""Image files through SimpleITK, with every failure as one sentence."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.shear import SHEAR_FIX, SHEAR_TOLERANCE_MM, sideways_drift
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.detached_data import HEADER_ENDINGS, refuse_special_data
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.nifti import check_nifti, check_nifti_grid, pair_of
from PolyPoseLib.io.readers import NIFTI_ENDINGS, reader_for

if TYPE_CHECKING:
    import SimpleITK as sitk

MAX_VOXELS = 2_000_000_000
"""Volumes with more voxels than this are refused before they are read."""

SPACING_RANGE_MM = (0.05, 20.0)
"""Spacings of a CT outside it are taken for a wrong unit."""


ENDINGS = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".hdr", ".img", ".img.gz")
"""Endings of the volume files that are read; DICOM is read by dicom_series."""

_NEGATIVE_SPACING = re.compile(
    rb"^[ \t]*(?:Element(?:Spacing|Size)[ \t]*[=:]|spacings:)(?:[^\n]*[ \t])?-[0-9.]",
    re.IGNORECASE | re.MULTILINE,
)
_HEADER_END = re.compile(rb"\n\r?\n|ElementDataFile")

_SHEAR = re.compile(r"orthonormal|shear|skew", re.IGNORECASE)


def read_image(path: str | Path) -> sitk.Image:
    """Read an image of any dimension, scalar or vector; raises InputError naming the file and the mend."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: there is no such file; check the name and the folder.")
    if not path.name.lower().endswith(ENDINGS):
        raise InputError(
            f"{path}: this kind of file is not read as a volume; give NIfTI, NRRD, MHA or a DICOM folder."
        )
    reader = reader_for(path)
    refuse_special_data(path)
    for half in pair_of(path):
        refuse_special_file(half)
    try:
        reader.ReadImageInformation()
        size = reader.GetSize()
        if np.prod([float(n) for n in size]) * reader.GetNumberOfComponents() > MAX_VOXELS:
            raise InputError(
                f"{path}: {'x'.join(map(str, size))} voxels are too many to hold in memory; resample the "
                "image to a coarser grid or crop it."
            )
        if path.name.lower().endswith(NIFTI_ENDINGS):
            check_nifti(path)
            check_nifti_grid(path)
        _refuse_negative_spacing(path)
        return reader.Execute()
    except (RuntimeError, MemoryError) as error:
        raise InputError(_read_failure(path, str(error))) from error


def _refuse_negative_spacing(path: Path) -> None:
    """Refuse MetaImage and NRRD files that count an axis backward; raises InputError.

    The toolkit turns the axis round, and whoever wrote the sign may have meant the same or the mirror image.
    """
    if not path.name.lower().endswith(HEADER_ENDINGS):
        return
    with path.open("rb") as stream:
        head = _HEADER_END.split(stream.read(1 << 16), maxsplit=1)[0]
    if _NEGATIVE_SPACING.search(head):
        raise InputError(
            f"{path}: its voxel spacing is negative, so left and right are not certain; save it again with spacings "
            "above 0 and the axes' directions."
        )


def read_scalar_image(path: str | Path) -> sitk.Image:
    """Read a three-dimensional image with one value per voxel; a trailing dimension of length one is
    dropped.
    """
    image = read_image(path)
    while image.GetDimension() > 3 and image.GetSize()[-1] == 1:
        image = _first_of_last_axis(image)
    dimension, components = image.GetDimension(), image.GetNumberOfComponentsPerPixel()
    if dimension == 2:
        raise InputError(
            f"{path}: the image has 2 dimensions, a volume needs 3; give the whole stack of slices."
        )
    if dimension != 3:
        raise InputError(
            f"{path}: the image has {dimension} dimensions ({'x'.join(map(str, image.GetSize()))}), a volume "
            "needs 3; save one time point as its own file."
        )
    if components != 1:
        raise InputError(
            f"{path}: the image has {components} values per voxel (colours, vectors or layers), a volume "
            "needs one; save one component as its own file."
        )
    if "complex" in image.GetPixelIDTypeAsString():
        raise InputError(f"{path}: the image holds complex numbers; save its real part as its own file.")
    return image


def write_image(image: sitk.Image, path: Path) -> None:
    """Write an image, compressed, and make sure that all of it arrived; raises InputError otherwise."""
    import SimpleITK as sitk

    try:
        sitk.WriteImage(image, str(path), True)
        arrived = path.stat().st_size > 0
        if path.name.endswith(".gz"):
            _read_through(path)
    except (RuntimeError, OSError, EOFError) as error:
        raise InputError(_write_failure(path, error)) from error
    if not arrived:
        raise InputError(f"{path}: nothing could be written; check the free space and the permissions.")


def _read_through(path: Path) -> None:
    """Decompress a file to its end: a full disk can go unnoticed by the writer, but not by the checksum."""
    import gzip

    with gzip.open(path) as stream:
        while stream.read(1 << 22):
            pass


def _first_of_last_axis(image: sitk.Image) -> sitk.Image:
    """The image without its last axis."""
    import SimpleITK as sitk

    return sitk.Extract(image, [*image.GetSize()[:-1], 0])


def _read_failure(path: Path, message: str) -> str:
    """One sentence for the toolkit's several lines."""
    if _SHEAR.search(message):
        return f"{path}: the slices are sheared (gantry tilt) or its axes are not orthonormal; {SHEAR_FIX}."
    if path.stat().st_size == 0:
        return f"{path}: the file is empty; export it again."
    return f"{path}: the file is no readable image (damaged, cut short, another format); export it again."


def _write_failure(path: Path, error: Exception) -> str:
    """One sentence that says why a file could not be written, as far as the system tells."""
    import errno
    import shutil

    if not path.parent.is_dir():
        return f"{path}: the folder {path.parent} does not exist; make it first."
    full = getattr(error, "errno", None) == errno.ENOSPC or shutil.disk_usage(path.parent).free < 1 << 16
    reason = "no space is left on the disk" if full else "the file could not be written whole"
    return f"{path}: {reason}; free some space, check the permissions, or choose another folder."


def read_volume(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a NIfTI, NRRD, MHA file or a folder of DICOM slices.

    series chooses a DICOM series by its instance UID or its number where a folder holds several.
    Raises InputError, with the file and the mend, for anything that is not one finite three-dimensional
    image.
    """
    from PolyPoseLib.io import dicom_series
    from PolyPoseLib.io import volumes as volume_files

    path = Path(path)
    if path.is_dir() or path.suffix.lower() in (".dcm", ".ima"):
        volume = dicom_series.read_dicom_volume(path, series)
    else:
        image = volume_files.read_scalar_image(path)
        try:
            volume = Volume.from_sitk(image)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    _check_finite(volume, path)
    return volume


def write_volume(volume: Volume, path: str | Path) -> None:
    """Write a volume to the format that the name's ending asks for; raises InputError when that fails."""
    from PolyPoseLib.io import volumes as volume_files

    volume_files.write_image(volume.to_sitk(), Path(path))


def read_ct(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a CT in Hounsfield units as float32; values below air, such as the padding -2048, become air.

    Raises InputError when the values cannot be Hounsfield units, the spacing no CT's, or the axes are sheared.
    """
    volume = read_volume(path, series)
    if min(volume.shape) < 2:
        raise InputError(
            f"{path}: the CT has {volume.shape[2]}x{volume.shape[1]}x{volume.shape[0]} voxels, which is one "
            "slice: give the whole stack."
        )
    _check_straight(volume, path)
    _check_spacing(volume, path)
    _check_hounsfield(volume, path)
    voxels = volume.voxels.astype(np.float32)
    np.maximum(voxels, np.float32(AIR_HU), out=voxels)
    return Volume(voxels, volume.affine)


def _check_finite(volume: Volume, path: Path) -> None:
    """Refuse NaN and infinity."""
    if not np.issubdtype(volume.voxels.dtype, np.floating):
        return
    wrong = int(volume.voxels.size - np.count_nonzero(np.isfinite(volume.voxels)))
    if wrong:
        raise InputError(
            f"{path}: {wrong} voxels are NaN or infinite: replace them by -1000 (air) or 0 (no label) and "
            "save again."
        )


def _check_straight(volume: Volume, path: str | Path) -> None:
    """Refuse axes that are not perpendicular, as after gantry tilt: results could not be saved on such a grid."""
    drift, degrees = sideways_drift(volume.affine[:3, :3], np.array(volume.shape[::-1]))
    if drift > SHEAR_TOLERANCE_MM:
        raise InputError(f"{path}: its axes are sheared by {degrees:.1f} degrees (gantry tilt): {SHEAR_FIX}.")


def _check_spacing(volume: Volume, path: str | Path) -> None:
    """Refuse voxels of a size that no CT has."""
    low, high = SPACING_RANGE_MM
    if not ((volume.spacing >= low) & (volume.spacing <= high)).all():
        shown = " x ".join(f"{each:.4g}" for each in volume.spacing)
        raise InputError(
            f"{path}: its voxels measure {shown} mm, and a CT's from {low:g} to {high:g} mm: its unit is likely "
            "wrong (metres or centimetres, say); save it again in millimetres."
        )


def _check_hounsfield(volume: Volume, path: str | Path) -> None:
    """Refuse values that cannot be Hounsfield units."""
    low, high = float(volume.voxels.min()), float(volume.voxels.max())
    if low == high:
        raise InputError(f"{path}: every voxel is {low:g}: give the CT, not an empty image or a mask.")
    if low >= 0:
        hint = (
            "it was rescaled for display; export the original CT"
            if high <= 255
            else "its rescale intercept was not applied; add it (usually -1024) and save again"
        )
        raise InputError(
            f"{path}: its values run from {low:g} to {high:g} and so are not Hounsfield units (air is "
            f"-1000): {hint}."
        )
    if high - low <= 2:
        raise InputError(
            f"{path}: its values run from {low:g} to {high:g} and so are not Hounsfield units: "
            "it was normalised; give the original CT."
        )
