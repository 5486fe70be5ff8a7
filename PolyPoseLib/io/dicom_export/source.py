"""The DICOM series of a CT: the images to which derived objects refer, and the attributes that they take over."""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.straight_grid import straight_grid
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import quiet_pydicom, raw_value, read_dataset
from PolyPoseLib.io.dicom_export.axes import reordered
from PolyPoseLib.io.dicom_series import read_slices
from PolyPoseLib.io.slice_stack import Slice, stack_affine

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

CT_IMAGE = "1.2.840.10008.5.1.4.1.1.2"
"""SOP Class UID of CT Image Storage."""

_SAME = {
    "PatientID": "patients",
    "StudyInstanceUID": "studies",
    "FrameOfReferenceUID": "frames of reference",
    "SOPClassUID": "kinds of image",
}
"""What all slices of a CT have in common."""

_UIDS = ("SOPClassUID", "SOPInstanceUID", "SeriesInstanceUID", "StudyInstanceUID", "FrameOfReferenceUID")
_TAGS = [*_UIDS, "PatientID", "SpecificCharacterSet"]


@dataclass(frozen=True)
class SourceImage:
    """One slice of the CT.

    Attributes
    ----------
    sop_class, sop_instance
        UIDs of its file's object.
    along_mm
        Its place along the slices' normal.
    frame
        Number of the frame from 1 in a multi-frame file, or None.

    """

    sop_class: str
    sop_instance: str
    along_mm: float
    frame: int | None = None


@dataclass(frozen=True)
class SourceSeries:
    """The series of a CT.

    Attributes
    ----------
    header
        Of its first slice, without pixels.
    images
        In ascending order along the normal.
    normal
        (3,) unit vector across the slices, LPS.
    grid
        The grid of the CT as results have it, straight even after gantry tilt; its voxels say nothing.

    """

    header: Dataset
    images: tuple[SourceImage, ...]
    normal: np.ndarray
    grid: Volume

    @property
    def uid(self) -> str:
        """Series Instance UID."""
        return str(self.header.SeriesInstanceUID)

    @property
    def frame_of_reference(self) -> str:
        """Frame of Reference UID."""
        return str(self.header.FrameOfReferenceUID)

    @property
    def number(self) -> int:
        """Series Number, 0 where there is none of use."""
        text = str(raw_value("SeriesNumber", self.header) or "").strip()
        return int(text) if re.fullmatch(r"[0-9]{1,7}", text) else 0

    @property
    def step_mm(self) -> float:
        """Distance of neighbouring slices."""
        along = [each.along_mm for each in self.images]
        return float(np.median(np.diff(along))) if len(along) > 1 else 0.0


def read_source(path: str | Path, series: str | int | None = None) -> SourceSeries:
    """Read the headers of a CT's slices.

    Parameters
    ----------
    path
        Folder of slices, or one multi-frame file.
    series
        Instance UID or number of the series where the folder holds several.

    Raises
    ------
    InputError
        As :func:`PolyPoseLib.io.volumes.read_ct` does, and for slices of several patients, studies or frames of
        reference, or without the identifiers that derived objects need; the sentence names the file and the fix.

    """
    path = Path(path)
    slices = read_slices(path, series)
    stacked = blank(stack_affine(slices, str(path)), (len(slices), *slices[0].size))
    with quiet_pydicom():
        headers = {each: _header(each) for each in dict.fromkeys(each.path for each in slices)}
        _require_one(headers, path)
        images = tuple(_image(each, headers[each.path]) for each in slices)
        whole = _full_header(slices[0].path)
    return SourceSeries(whole, images, slices[0].normal, blank(*straight_grid(stacked)))


def placeholder_source(patient_id: str, ct: Volume) -> SourceSeries:
    """A series for a CT that never was DICOM, of a new study of a patient of whom nothing but the ID is known.

    Parameters
    ----------
    patient_id
        Patient ID, which the receiver takes for the same patient's wherever it is the same.
    ct
        On a straight grid.

    Raises
    ------
    InputError
        An ID that DICOM does not allow.

    """
    from pydicom.dataset import Dataset

    if not 1 <= len(patient_id.strip()) <= 64 or not patient_id.isprintable() or "\\" in patient_id:
        raise InputError("A patient's ID has 1 to 64 characters, none of them a backslash: give another one.")
    header = Dataset()
    if not patient_id.isascii():
        header.SpecificCharacterSet = "ISO_IR 192"
    header.PatientID, header.PatientName = patient_id.strip(), "PLACEHOLDER^POLYPOSE"
    header.StudyDescription = "PolyPose: CT was not DICOM, patient unknown"
    now = datetime.datetime.now()
    header.StudyDate, header.StudyTime, header.StudyID = now.strftime("%Y%m%d"), now.strftime("%H%M%S"), "1"
    header.SOPClassUID = CT_IMAGE
    for keyword in ("StudyInstanceUID", "SeriesInstanceUID", "FrameOfReferenceUID"):
        setattr(header, keyword, new_uid())
    grid = Volume(*reordered(blank(ct.affine, ct.shape).voxels, ct.affine, np.eye(3)))
    normal = grid.affine[:3, 2] / grid.spacing[2]
    places = grid.to_world(np.array([[0, 0, k] for k in range(grid.shape[0])])) @ normal
    images = tuple(SourceImage(CT_IMAGE, new_uid(), float(each)) for each in places)
    return SourceSeries(header, images, normal, grid)


def new_uid() -> str:
    """An identifier that nobody else has: 2.25 and a random number (PS3.5 B.2)."""
    from pydicom.uid import generate_uid

    return str(generate_uid(prefix=None))


def blank(affine: np.ndarray, shape: tuple[int, int, int]) -> Volume:
    """A grid alone, whose voxels take no memory."""
    return Volume(np.broadcast_to(np.int8(0), shape), affine)


def _image(each: Slice, header: Dataset) -> SourceImage:
    """A slice as objects refer to it."""
    along = float(each.position @ each.normal)
    frame = None if each.frame is None else each.frame + 1
    return SourceImage(str(header.SOPClassUID), str(header.SOPInstanceUID), along, frame)


def _header(file: Path) -> Dataset:
    """The identifiers of a slice; raises InputError where one is missing."""
    try:
        header = read_dataset(file, stop_before_pixels=True, specific_tags=_TAGS, force=True)
    except InputError as error:
        raise InputError(f"{file} {error}") from None
    except Exception:  # pydicom raises nearly every kind
        raise _damaged(file) from None
    for keyword in _UIDS:
        if not re.fullmatch(r"[0-9.]{1,64}", str(raw_value(keyword, header) or "").strip()):
            raise InputError(
                f"{file}: the slice has no valid {keyword}, which objects that are derived from it must name: export "
                "the series from the scanner or the archive again."
            )
    return header


def _full_header(file: Path) -> Dataset:
    """Everything of a slice but its pixels."""
    try:
        return read_dataset(file, stop_before_pixels=True, force=True)
    except InputError as error:
        raise InputError(f"{file} {error}") from None
    except Exception:  # pydicom raises nearly every kind
        raise _damaged(file) from None


def _damaged(file: Path) -> InputError:
    """The error about a header that cannot be read."""
    return InputError(
        f"{file}: the slice is damaged: its DICOM header cannot be read: copy the series again."
    )


def _require_one(headers: dict[Path, Dataset], path: Path) -> None:
    """Refuse slices that do not belong together; raises InputError that names no value."""
    for keyword, what in _SAME.items():
        values = {str(raw_value(keyword, each) or "").strip() for each in headers.values()}
        if len(values) > 1:
            raise InputError(
                f"{path}: the slices of the CT are of {len(values)} {what} ({keyword} differs): give the folder of one "
                "scan, as the archive exports it."
            )


def on_slices(source: SourceSeries, volume: Volume, where: str) -> Volume:
    """A volume of a result with its axes as the CT's slices have them, on the very grid of the CT.

    Parameters
    ----------
    source
        The CT's series.
    volume
        On the CT's grid as a file gave it: axes in any order and direction, numbers rounded.
    where
        Opening of the sentence.

    Raises
    ------
    InputError
        It is on another grid: corners differ by more than half a voxel.

    """
    voxels, affine = reordered(volume.voxels, volume.affine, source.grid.affine)
    found = Volume(voxels, affine)
    apart = float(np.linalg.norm(found.corners() - source.grid.corners(), axis=-1).max())
    if apart > 0.5 * float(source.grid.spacing.min()) or found.shape != source.grid.shape:
        raise InputError(
            f"{where}: the CT's slices and the result lie on different grids (their corners differ by {apart:.1f} mm): "
            "give the CT from which the result was computed."
        )
    return Volume(voxels, source.grid.affine)
