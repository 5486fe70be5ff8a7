"""DICOM objects of a radiotherapy plan that are carried: RT Dose and RT Structure Set."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.data.carried import Frame
from PolyPoseLib.data.result import Result
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import looks_like_dicom, quiet_pydicom, read_dataset
from PolyPoseLib.io.dicom_items import refuse_many_items

if TYPE_CHECKING:
    from pydicom.dataelem import DataElement
    from pydicom.dataset import Dataset

MAX_BYTES = 1 << 30

SERIES_STEP = 9000
"""Added to the source's series number."""

_FRAME_NAMES = ("FrameOfReferenceUID", "ReferencedFrameOfReferenceUID", "RelatedFrameOfReferenceUID")

WHERE = {"xray": "as X-rayed", "ct": "in the CT"}


def carry_dicom(result: Result, source: Path, target: Path, to: Frame) -> str:
    """Carry an RT Dose or an RT Structure Set; returns what to say of it, and raises InputError for anything else."""
    from PolyPoseLib.io.carried.rt_dose import carry_dose
    from PolyPoseLib.io.carried.rt_structures import carry_structures

    dataset = read_plan_object(source)
    with quiet_pydicom():
        kind = str(dataset.get("Modality") or "").strip().upper()
    if kind not in ("RTDOSE", "RTSTRUCT"):
        raise InputError(
            f"{source}: this DICOM file is neither an RT Dose nor an RT Structure Set: give one of these; images as "
            "NIfTI."
        )
    carry = carry_dose if kind == "RTDOSE" else carry_structures
    with quiet_pydicom():
        try:
            said = carry(result, source, dataset, to)
            if result.distrust:
                _mark_distrust(dataset)
            dataset.save_as(target, enforce_file_format=True)
        except InputError:
            raise
        except (AttributeError, KeyError, NotImplementedError, TypeError, ValueError):
            raise InputError(
                f"{source}: the file is damaged: some of its values are missing or are none of their kind; export it "
                "again."
            ) from None
    return said


def read_plan_object(path: Path) -> Dataset:
    """The whole dataset of a file; raises InputError for what is damaged or no DICOM."""
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: a file of {path.stat().st_size >> 20} MiB is too large to be carried.")
    if not looks_like_dicom(path):
        raise InputError(f"{path}: the file does not begin like DICOM; give an RT Dose or RT Structure Set.")
    refuse_many_items(path)
    with quiet_pydicom():
        try:
            return read_dataset(path, force=True)
        except InputError as error:
            raise InputError(f"{path} {error}") from None
        except Exception:  # pydicom raises nearly every kind for values that are none
            raise InputError(f"{path}: the file is damaged or cut short: copy it again.") from None


def _mark_distrust(dataset: Dataset) -> None:
    """Put the warning in front of every description that planning systems show."""
    for name, length in (("SeriesDescription", 64), ("StructureSetDescription", 1024), ("DoseComment", 64)):
        if name in dataset:
            setattr(dataset, name, f"NOT TO BE TRUSTED: {dataset[name].value}"[:length])


def make_derived(dataset: Dataset, description: str) -> None:
    """Give a dataset that was changed its own identity: a new instance in a new series of the same study.

    Its frame of reference is new, too: what was carried must not be laid over the images from which it came as if it
    still belonged to them.
    """
    from pydicom.uid import ExplicitVRLittleEndian, generate_uid

    from PolyPoseLib.io.dicom import complete_meta

    dataset.SOPInstanceUID = generate_uid()
    dataset.SeriesInstanceUID = generate_uid()
    dataset.SeriesNumber = _new_number(dataset.get("SeriesNumber"))
    dataset.SeriesDescription = description[:64]
    _replace_frames(dataset, generate_uid())
    complete_meta(dataset)
    dataset.file_meta.MediaStorageSOPClassUID = dataset.SOPClassUID
    dataset.file_meta.MediaStorageSOPInstanceUID = dataset.SOPInstanceUID
    if dataset.file_meta.TransferSyntaxUID.is_compressed:
        dataset.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian


def _new_number(earlier: object) -> int:
    """A series number that is not the source's, and rarely another's of the same study."""
    try:
        number = int(str(earlier)) + SERIES_STEP
    except ValueError:
        return SERIES_STEP
    return number if 0 < number < 1 << 31 else SERIES_STEP


def _replace_frames(dataset: Dataset, frame: str) -> None:
    """Put one frame of reference in the place of every one that the dataset names, at any depth."""
    if "FrameOfReferenceRelationshipSequence" in dataset:
        del dataset.FrameOfReferenceRelationshipSequence  # says how the source's frame lies to others
    if dataset.get("Modality") == "RTDOSE" or "FrameOfReferenceUID" in dataset:
        dataset.FrameOfReferenceUID = frame
    frames = dataset.get("ReferencedFrameOfReferenceSequence")
    if frames:
        dataset.ReferencedFrameOfReferenceSequence = frames[:1]  # all the same one now

    def replace(_: Dataset, element: DataElement) -> None:
        if element.keyword in _FRAME_NAMES:
            element.value = frame

    dataset.walk(replace)
