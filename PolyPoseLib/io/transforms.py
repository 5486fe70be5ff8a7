"""ITK transform files that hold one displacement field, and the preview that a run writes."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.disk_space import write_failure
from PolyPoseLib.io.native_output import native_output_logged
from PolyPoseLib.io.transform_reading import read_displacement_field
from PolyPoseLib.io.whole_files import replaced_whole

_LOG = logging.getLogger(__name__)

TRANSFORM_ENDINGS = (".h5", ".hdf5")
"""Of the names of transform files."""


@native_output_logged()
def write_transform(field: DisplacementField, path: str | Path) -> None:
    """Write an ITK transform file (.h5) that Slicer, SimpleITK and ANTs read.

    Raises InputError when the name does not end in .h5 or .hdf5, or the file cannot be written.
    """
    import SimpleITK as sitk

    path = Path(path)
    if path.suffix.lower() not in TRANSFORM_ENDINGS:
        raise InputError(f"{path}: a displacement field is stored as HDF5; let the name end in .h5.")
    try:
        sitk.WriteTransform(field.to_sitk_transform(), str(path))
    except RuntimeError as error:
        raise InputError(write_failure(path, error)) from error


def read_transform(path: str | Path) -> DisplacementField:
    """Read an ITK transform file that holds one displacement field, in bounded time; raises InputError otherwise."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; give a transform written by PolyPose.")
    try:
        return read_displacement_field(path)
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from error


def preview_writer(path: Path) -> Callable[[DisplacementField], str | None]:
    """Replaces the preview file as a whole, so that a reader never sees half of it.

    Raises InputError, before anything is computed, when no transform can be written there.
    """
    if path.suffix.lower() not in TRANSFORM_ENDINGS or not path.parent.is_dir():
        raise InputError(
            f'Option "preview" is "{path}": name a file that ends in .h5, in a folder that exists.'
        )

    failed = False

    def write(field: DisplacementField) -> str | None:
        nonlocal failed
        try:
            with replaced_whole(path) as temporary:
                write_transform(field, temporary)
        except (InputError, OSError) as error:  # no reason to lose the computation
            if not failed:
                _LOG.warning("The preview is not written: %s", error)
            failed = True
            return None
        return str(path)

    return write
