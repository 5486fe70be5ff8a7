"""A CT as a series of CT Image Storage objects (PS3.3 A.3): the warped one, or one that never was DICOM."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.io.dicom_export.behind import SlicesBehind
from PolyPoseLib.io.dicom_export.objects import (
    DERIVATION,
    Export,
    Series,
    coded,
    decimals,
    save_object,
)
from PolyPoseLib.io.dicom_export.references import references
from PolyPoseLib.io.dicom_export.source import CT_IMAGE

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

_ALMOST_STRAIGHT = 1e-6
"""Cosines no farther from 0 or 1 are so: files of single precision round them."""


def write_warped(
    export: Export, volume: Volume, series: Series, behind: SlicesBehind, folder: Path
) -> list[Dataset]:
    """Write the CT in the posture of the X-rays, in the frame of reference of that posture.

    Parameters
    ----------
    export
        Patient, study and time.
    volume
        Hounsfield units on the CT's grid, whose slices ascend along their normal.
    series
        The new series.
    behind
        From which slices of the CT each slice comes.
    folder
        Which is there and empty.

    Returns
    -------
    list of Dataset
        Every slice without its pixels, in the order of k.

    """

    def complete(made: Dataset, k: int) -> None:
        made.ImageType = ["DERIVED", "SECONDARY", "AXIAL"]
        made.DerivationDescription = DERIVATION
        made.DerivationCodeSequence = [coded("113085", "DCM", "Spatial resampling")]
        made.SourceImageSequence = references(behind(k))
        for item in made.SourceImageSequence:
            item.SpatialLocationsPreserved = "NO"
            item.PurposeOfReferenceCodeSequence = [
                coded("121322", "DCM", "Source image for image processing operation")
            ]
        if not made.SourceImageSequence:
            del made.SourceImageSequence

    return _write(export, volume, series, folder, (export.posture_frame, complete))


def write_converted(export: Export, volume: Volume, series: Series, folder: Path) -> list[Dataset]:
    """Write a CT that never was DICOM, as the series that the export calls its source; as ``write_warped``."""
    from pydicom.uid import UID

    def complete(made: Dataset, k: int) -> None:
        image = export.source.images[k]
        made.SOPInstanceUID = made.file_meta.MediaStorageSOPInstanceUID = UID(image.sop_instance)
        made.ImageType = ["DERIVED", "SECONDARY", "AXIAL"]
        made.DerivationDescription = "Converted from a file that names no patient"

    return _write(export, volume, series, folder, (export.source.frame_of_reference, complete))


def _write(
    export: Export,
    volume: Volume,
    series: Series,
    folder: Path,
    kind: tuple[str, Callable[[Dataset, int], None]],
) -> list[Dataset]:
    """Write every slice; kind: the frame of reference, and what completes a slice of number k."""
    from pydicom.dataset import Dataset

    frame, complete = kind
    shared, origin = _shared(export, volume), volume.affine[:3, 3]
    rows, columns = _cosines(volume.affine)
    normal = np.cross(rows, columns)
    headers = []
    for k, section in enumerate(volume.voxels):
        made = export.new_object(CT_IMAGE, series, k + 1, frame)
        made.update(shared)
        complete(made, k)
        position = origin + k * volume.affine[:3, 2]
        made.ImagePositionPatient = decimals(np.round(position, 6))
        made.SliceLocation = decimals([float(position @ normal)])[0]
        header = Dataset()
        header.update(made)
        headers.append(header)
        made.PixelData = _stored(section)
        made["PixelData"].VR = "OW"
        save_object(made, folder / f"{k + 1:04d}.dcm")
    return headers


def _stored(section: np.ndarray) -> bytes:
    """Hounsfield units (j, i) as 16-bit integers, the nearest where they are beyond."""
    whole = np.rint(np.nan_to_num(section, nan=AIR_HU))
    return np.clip(whole, -32768, 32767).astype("<i2").tobytes()


def _shared(export: Export, volume: Volume) -> Dataset:
    """What all slices have in common: Image Plane, Image Pixel and CT Image modules (PS3.3 C.7.6.2 and .3, C.8.2.1)."""
    from pydicom.dataset import Dataset

    shared = Dataset()
    shared.AcquisitionNumber = shared.KVP = None
    shared.PatientPosition = ""
    shared.update(export.acquisition)
    shared.ContentDate, shared.ContentTime = export.date, export.time
    shared.ImageComments = export.note
    spacing = np.round(volume.spacing, 6)
    shared.ImageOrientationPatient = decimals(np.concatenate(_cosines(volume.affine)))
    shared.PixelSpacing = decimals(spacing[[1, 0]])
    shared.SliceThickness = shared.SpacingBetweenSlices = decimals(spacing[2:])[0]
    shared.Rows, shared.Columns = volume.shape[1:]
    shared.SamplesPerPixel, shared.PhotometricInterpretation = 1, "MONOCHROME2"
    shared.BitsAllocated, shared.BitsStored, shared.HighBit, shared.PixelRepresentation = 16, 16, 15, 1
    shared.RescaleIntercept, shared.RescaleSlope, shared.RescaleType = "0", "1", "HU"
    return shared


def _cosines(affine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (3,) along a row and down a column, LPS."""
    axes = affine[:3, :2] / np.linalg.norm(affine[:3, :2], axis=0)
    whole = np.rint(axes)
    axes = np.where(np.abs(axes - whole) < _ALMOST_STRAIGHT, whole, axes)
    return axes[:, 0], axes[:, 1]
