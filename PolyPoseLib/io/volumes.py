"""Volumes and CTs from image files and DICOM folders, checked."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from PolyPoseLib.data.hounsfield import (
    impossible_hounsfield_values,
    impossible_size,
    odd_hounsfield_values,
)
from PolyPoseLib.data.shear import SHEAR_FIX, SHEAR_TOLERANCE_MM, sideways_drift
from PolyPoseLib.data.straight_grid import resampled_straight, straight_grid
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom_series import read_dicom_volume
from PolyPoseLib.io.images import read_scalar_image, write_image
from PolyPoseLib.io.machine_memory import require_room
from PolyPoseLib.io.nrrd import states_patient_axes

SPACING_RANGE_MM = (0.05, 20.0)
"""Spacings of a CT; others must be in a wrong unit."""

MAX_TILT_DEGREES = 45.0
"""Gantries tilt by 30 degrees at most."""

_DICOM_ENDINGS = (".dcm", ".ima")

_LOG = logging.getLogger(__name__)


def read_volume(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a NIfTI, NRRD or MHA file, or a folder of DICOM slices.

    Parameters
    ----------
    path
        File or folder.
    series
        Instance UID or number of the DICOM series where a folder holds several.

    Raises
    ------
    InputError
        Anything that is not one finite three-dimensional image; the sentence names the file and the fix.

    """
    path = Path(path)
    if is_dicom_place(path):
        volume = read_dicom_volume(path, series)
    else:
        image = read_scalar_image(path)
        try:
            volume = Volume.from_sitk(image)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    _check_finite(volume, path)
    return volume


def is_dicom_place(path: Path) -> bool:
    """Whether a path is read as DICOM: a folder of slices, or a multi-frame file."""
    return path.is_dir() or path.suffix.lower() in _DICOM_ENDINGS


def write_volume(volume: Volume, path: str | Path) -> None:
    """Write a volume to the format that the name's ending asks for; raises InputError when that fails."""
    write_image(volume.to_sitk(), Path(path))


def read_ct(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a CT in Hounsfield units as float32; values below air, such as the padding -2048, become air.

    What is odd but not wrong is logged as a warning; a CT of tilted slices is resampled to a straight grid.

    Parameters
    ----------
    path
        File or folder, as for `read_volume`.
    series
        As for `read_volume`.

    Raises
    ------
    InputError
        As `read_volume`, and when the values cannot be Hounsfield units, or size or spacing are no CT's.

    """
    ct, warnings = read_ct_with_warnings(path, series)
    for warning in warnings:
        _LOG.warning(warning)
    return ct


def read_ct_with_warnings(
    path: str | Path, series: str | int | None = None
) -> tuple[Volume, tuple[str, ...]]:
    """Read a CT as `read_ct` does, and return what is odd about it instead of logging it.

    Parameters
    ----------
    path, series
        As for `read_ct`.

    Returns
    -------
    ct
        Hounsfield units, float32, on a straight grid.
    warnings
        Sentences about "the CT".

    Raises
    ------
    InputError
        As `read_ct`.

    """
    path = Path(path)
    volume = read_volume(path, series)
    fault = impossible_size(volume) or _impossible_spacing(volume) or impossible_hounsfield_values(volume)
    if fault:
        raise InputError(f"{path}: {fault}")
    voxels = volume.voxels.astype(np.float32)
    np.maximum(voxels, np.float32(AIR_HU), out=voxels)
    ct, tilt = without_tilt(Volume(voxels, volume.affine), path, AIR_HU)
    return ct, (*_unknown_axes(path), *tilt, *odd_hounsfield_values(ct, "the CT"))


def _unknown_axes(path: Path) -> tuple[str, ...]:
    """A warning about a file that does not say where the patient's left is."""
    if states_patient_axes(path):
        return ()
    return (
        "The CT's file does not say how its axes lie in the patient; LPS (left, posterior, superior) is assumed: check "
        "in the report that left and right are not exchanged.",
    )


def without_tilt(volume: Volume, path: str | Path, outside: float) -> tuple[Volume, tuple[str, ...]]:
    """A CT of tilted slices on a straight grid, because results could not be saved on a sheared one.

    Parameters
    ----------
    volume
        On any grid.
    path
        Where it is from, for the sentence of an error.
    outside
        Value where no slice reaches.

    Returns
    -------
    straight
        The volume itself when its axes are perpendicular.
    warnings
        One sentence when they were not.

    Raises
    ------
    InputError
        No gantry tilts so far, or the straight grid does not fit in memory.

    """
    drift, degrees = sideways_drift(volume.affine[:3, :3], np.array(volume.shape[::-1]))
    if drift <= SHEAR_TOLERANCE_MM:
        return volume, ()
    if degrees > MAX_TILT_DEGREES:
        raise InputError(
            f"{path}: its axes are sheared by {degrees:.1f} degrees, and no gantry tilts by more than "
            f"{MAX_TILT_DEGREES:g}: {SHEAR_FIX}."
        )
    require_room(2.0 * volume.voxels.itemsize * np.prod(straight_grid(volume)[1], dtype=float), str(path))
    return resampled_straight(volume, outside), (
        f"The CT's slices were tilted by {degrees:.1f} degrees (gantry tilt); it was resampled to a straight grid, on "
        "which the results are, too.",
    )


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


def _impossible_spacing(volume: Volume) -> str | None:
    """Why voxels of this size are no CT's; None when they are."""
    low, high = SPACING_RANGE_MM
    if ((volume.spacing >= low) & (volume.spacing <= high)).all():
        return None
    shown = " x ".join(f"{each:.4g}" for each in volume.spacing)
    return (
        f"its voxels measure {shown} mm, and a CT's from {low:g} to {high:g} mm: its unit is likely "
        "wrong (metres or centimetres, say); save it again in millimetres."
    )
