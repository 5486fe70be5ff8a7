"""Image files through SimpleITK: NIfTI, NRRD, MetaImage and Analyze, with every failure as one sentence."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.shear import SHEAR_FIX
from PolyPoseLib.errors import InputError, is_out_of_memory, memory_ran_out
from PolyPoseLib.io.detached_data import (
    HEADER_ENDINGS,
    data_place,
    is_in_several_files,
    refuse_special_data,
)
from PolyPoseLib.io.disk_space import write_failure
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.guarded import LIST_LIMITS, read_in_child
from PolyPoseLib.io.machine_memory import require_room
from PolyPoseLib.io.native_output import native_output_logged
from PolyPoseLib.io.nifti import NIFTI_ENDINGS, check_nifti, check_nifti_grid, pair_of, sheared_pose
from PolyPoseLib.io.nrrd import NRRD_ENDINGS, in_lps_millimetres, read_frame, readable_copy
from PolyPoseLib.io.readers import reader_for

if TYPE_CHECKING:
    import SimpleITK as sitk

MAX_VOXELS = 2_000_000_000
"""Images with more voxels than this are refused before they are read."""

ENDINGS = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".hdr", ".img", ".img.gz")
"""Endings of the files that are read here; DICOM is read by dicom_series."""

_NEGATIVE_SPACING = re.compile(
    rb"^[ \t]*(?:Element(?:Spacing|Size)[ \t]*[=:]|spacings:)(?:[^\n]*[ \t])?-[0-9.]",
    re.IGNORECASE | re.MULTILINE,
)
_HEADER_END = re.compile(rb"\n\r?\n|ElementDataFile")

_SFORM_VARIABLE = "ITK_NIFTI_SFORM_PERMISSIVE"
"""Environment variable by which the toolkit approximates an sform instead of refusing it."""

_SHEAR = re.compile(r"orthonormal|shear|skew", re.IGNORECASE)


@native_output_logged()
def read_image(path: str | Path) -> sitk.Image:
    """Read an image of any dimension, scalar or vector.

    Raises
    ------
    InputError
        Absent, another kind of file, damaged, too large, or with a grid that is ambiguous; the sentence names the file
        and the fix.

    """
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
    if path.name.lower().endswith(NRRD_ENDINGS):
        return _read_nrrd(path, reader)
    return _read_parts(path) if is_in_several_files(path) else _read_whole(path, reader)


def _read_nrrd(path: Path, reader: sitk.ImageFileReader) -> sitk.Image:
    """Read a NRRD file in LPS mm, whatever frame and unit it has."""
    frame = read_frame(path)
    if frame.to_lps is None:
        image = _read_parts(path) if is_in_several_files(path) else _read_whole(path, reader)
        return image if frame.millimetres == 1 else in_lps_millimetres(image, frame)
    if _has_detached_data(path):
        raise InputError(
            f"{path}: its space is none of LPS, RAS and LAS, and its voxels are in another file: save it again in LPS."
        )
    with readable_copy(path) as copy:
        return in_lps_millimetres(_read_whole(path, reader_for(copy)), frame)


def _has_detached_data(path: Path) -> bool:
    """Whether a header keeps its voxels elsewhere, or cannot be understood."""
    try:
        return data_place(path) is not None
    except InputError:
        return True


def _read_whole(path: Path, reader: sitk.ImageFileReader) -> sitk.Image:
    """Read an image of one file, or of one header and one file, that is checked first; path: for the sentences."""
    pose = sheared_pose(path) if path.name.lower().endswith(NIFTI_ENDINGS) else None
    try:
        with _any_sform() if pose is not None else nullcontext():
            return _placed(_checked(path, reader), pose)
    except (RuntimeError, MemoryError) as error:
        if is_out_of_memory(error):
            raise memory_ran_out(str(path)) from error
        raise InputError(_read_failure(path, str(error))) from error


def _checked(path: Path, reader: sitk.ImageFileReader) -> sitk.Image:
    """Read an image after checks of its size and its bytes; raises the toolkit's errors, too."""
    reader.ReadImageInformation()
    size = reader.GetSize()
    if np.prod([float(n) for n in size]) * reader.GetNumberOfComponents() > MAX_VOXELS:
        raise InputError(
            f"{path}: {'x'.join(map(str, size))} voxels are too many to hold in memory; resample the "
            "image to a coarser grid or crop it."
        )
    require_room(2 * _bytes_of(reader), str(path))
    if path.name.lower().endswith(NIFTI_ENDINGS):
        check_nifti(path)
        check_nifti_grid(path)
    _refuse_negative_spacing(path)
    return reader.Execute()


@contextmanager
def _any_sform() -> Iterator[None]:
    """Let the toolkit read a NIfTI file whose only pose is a sheared sform; what it makes of it is not used."""
    before = os.environ.get(_SFORM_VARIABLE)
    os.environ[_SFORM_VARIABLE] = "ON"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SFORM_VARIABLE]
        else:
            os.environ[_SFORM_VARIABLE] = before


def _placed(image: sitk.Image, pose: tuple[np.ndarray, np.ndarray] | None) -> sitk.Image:
    """The image where a sheared sform puts it: the toolkit reads perpendicular axes in its place."""
    if pose is None or image.GetDimension() < 3:
        return image
    more = image.GetDimension() - 3
    steps = np.linalg.norm(pose[0], axis=0)
    direction = np.eye(3 + more)
    direction[:3, :3] = pose[0] / steps
    image.SetDirection(direction.ravel().tolist())
    image.SetSpacing([*steps.tolist(), *image.GetSpacing()[3:]])
    image.SetOrigin([*pose[1].tolist(), *image.GetOrigin()[3:]])
    return image


def _read_parts(path: Path) -> sitk.Image:
    """Read an image that is kept in several files, in a child: the toolkit does not survive some lists of names."""
    _refuse_negative_spacing(path)
    kind = "MetaImageIO" if path.name.lower().endswith((".mha", ".mhd")) else "NrrdImageIO"
    try:
        return read_in_child(path, kind, LIST_LIMITS)
    except InputError as error:
        raise InputError(_read_failure(path, str(error))) from error


def _bytes_of(reader: sitk.ImageFileReader) -> int:
    """Bytes of the pixels that a header promises."""
    import SimpleITK as sitk

    one = sitk.Image([1] * reader.GetDimension(), reader.GetPixelID(), reader.GetNumberOfComponents())
    return math.prod(reader.GetSize()) * reader.GetNumberOfComponents() * one.GetSizeOfPixelComponent()


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
    """Read a three-dimensional image with one value per voxel; a last dimension of length one is dropped.

    Raises
    ------
    InputError
        As `read_image`, and for any other number of dimensions or values per voxel, or complex numbers.

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


@native_output_logged()
def write_image(image: sitk.Image, path: Path) -> None:
    """Write an image, compressed, and check that all of it arrived; raises InputError otherwise."""
    import SimpleITK as sitk

    try:
        sitk.WriteImage(image, str(path), True)
        arrived = path.stat().st_size > 0
        if path.name.endswith(".gz"):
            _read_through(path)
    except (RuntimeError, OSError, EOFError) as error:
        raise InputError(write_failure(path, error)) from error
    if not arrived:
        raise InputError(write_failure(path, OSError()))


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
