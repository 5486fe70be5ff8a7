"""Volumes and CTs from image files and DICOM folders, checked."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from PolyPoseLib.data.shear import SHEAR_FIX, SHEAR_TOLERANCE_MM, sideways_drift
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom_series import read_dicom_volume
from PolyPoseLib.io.images import read_scalar_image, write_image

SPACING_RANGE_MM = (0.05, 20.0)
"""Spacings of a CT; others must be in a wrong unit."""

_DICOM_ENDINGS = (".dcm", ".ima")


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
    if path.is_dir() or path.suffix.lower() in _DICOM_ENDINGS:
        volume = read_dicom_volume(path, series)
    else:
        image = read_scalar_image(path)
        try:
            volume = Volume.from_sitk(image)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    _check_finite(volume, path)
    return volume


def write_volume(volume: Volume, path: str | Path) -> None:
    """Write a volume to the format that the name's ending asks for; raises InputError when that fails."""
    write_image(volume.to_sitk(), Path(path))


def read_ct(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a CT in Hounsfield units as float32; values below air, such as the padding -2048, become air.

    Parameters
    ----------
    path
        File or folder, as for `read_volume`.
    series
        As for `read_volume`.

    Raises
    ------
    InputError
        As `read_volume`, and when the values cannot be Hounsfield units, the spacing is no CT's, or the axes are
        sheared.

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
