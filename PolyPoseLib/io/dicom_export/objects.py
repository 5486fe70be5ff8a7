"""What all objects of one export share: patient, study, equipment, frame of reference, identifiers."""

from __future__ import annotations

import datetime
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib import __version__
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import quiet_pydicom, raw_value
from PolyPoseLib.io.dicom_export.source import SourceSeries, new_uid
from PolyPoseLib.io.dicom_export.taken_over import (
    ACQUISITION,
    PAIRED_PARTS,
    PATIENT,
    REGION,
    REQUIRED,
    SCANNER,
    taken_over,
)

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

MAKER = "PolyPose"

RESEARCH_ONLY = "Computed by PolyPose; research software, not for clinical decisions."

DERIVATION = (
    f"CT resampled into the posture of the patient as X-rayed, bone by bone, by polyrigid 2D/3D registration to X-rays "
    f"({MAKER} {__version__})"
)

_UNICODE = "ISO_IR 192"


@dataclass(frozen=True)
class Series:
    """A series of objects that is new.

    Attributes
    ----------
    modality
        (0008,0060).
    number
        (0020,0011).
    description
        (0008,103E), at most 64 characters.
    uid
        Series Instance UID.

    """

    modality: str
    number: int
    description: str
    uid: str = field(default_factory=new_uid)


@dataclass(frozen=True)
class Export:
    """One export, of whose objects all have the same patient, study, time and new frame of reference.

    Attributes
    ----------
    source
        The CT's series.
    names
        Every text that objects will hold besides the CT's own, which decides how text is encoded.
    note
        What a reader must know, for Image Comments.
    posture_frame
        Frame of Reference UID of the patient as X-rayed.
    made
        When.

    """

    source: SourceSeries
    names: tuple[str, ...] = ()
    note: str = RESEARCH_ONLY
    posture_frame: str = field(default_factory=new_uid)
    made: datetime.datetime = field(default_factory=datetime.datetime.now)

    def series(self, modality: str, number: int, description: str) -> Series:
        """A new series, whose number follows from the CT's as scanners count their derived series: 3 gives 301."""
        return Series(modality, (self.source.number or 90) * 100 + number, text_of(description))

    @cached_property
    def taken(self) -> Dataset:
        """Patient and study of the CT, with the attributes that may not be absent."""
        found = taken_over(self.source.header, PATIENT)
        for keyword in REQUIRED:
            if keyword not in found:
                setattr(found, keyword, "")
        return found

    @cached_property
    def region(self) -> Dataset:
        """Body part; the side is empty where there may be one that is not known, and absent where there is none."""
        found = taken_over(self.source.header, REGION)
        part = str(found.get("BodyPartExamined") or "")
        if "Laterality" not in found and (not part or part in PAIRED_PARTS):
            found.Laterality = ""
        return found

    @cached_property
    def acquisition(self) -> Dataset:
        """How the CT was acquired."""
        return taken_over(self.source.header, ACQUISITION)

    @cached_property
    def scanner(self) -> Dataset:
        """The device that acquired the CT."""
        return taken_over(self.source.header, SCANNER)

    @cached_property
    def character_set(self) -> Any:
        """The CT's own, which the receiver is known to read, where it holds all names; else Unicode."""
        from pydicom.charset import python_encoding

        given = raw_value("SpecificCharacterSet", self.source.header)
        sets = [given] if isinstance(given, str) else [str(each or "") for each in given or [""]]
        if not all(each in python_encoding for each in sets):
            return _UNICODE
        text = "".join(self.names)
        if text.isascii():
            return given
        try:
            text.encode(python_encoding[sets[0]])
        except UnicodeEncodeError:
            return _UNICODE
        return given or _UNICODE

    def new_object(self, sop_class: str, series: Series, number: int, frame: str) -> Dataset:
        """A dataset with everything but what its kind of object adds.

        Parameters
        ----------
        sop_class
            UID.
        series
            To which it belongs.
        number
            Instance Number, from 1.
        frame
            Frame of Reference UID.

        """
        from pydicom.dataset import Dataset, FileMetaDataset
        from pydicom.uid import UID, ExplicitVRLittleEndian

        made = Dataset()
        made.file_meta = FileMetaDataset()
        made.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        if self.character_set is not None:
            made.SpecificCharacterSet = self.character_set
        made.update(self.taken)
        made.update(self.region)
        made.SOPClassUID = made.file_meta.MediaStorageSOPClassUID = UID(sop_class)
        made.SOPInstanceUID = made.file_meta.MediaStorageSOPInstanceUID = UID(new_uid())
        made.InstanceCreationDate, made.InstanceCreationTime = self.date, self.time
        made.Modality = series.modality
        made.SeriesInstanceUID, made.SeriesNumber = series.uid, series.number
        made.SeriesDescription = series.description
        made.SeriesDate, made.SeriesTime = self.date, self.time
        made.InstanceNumber = number
        made.Manufacturer = made.ManufacturerModelName = MAKER
        made.SoftwareVersions = made.DeviceSerialNumber = __version__
        made.FrameOfReferenceUID, made.PositionReferenceIndicator = frame, ""
        if self.scanner.get("Manufacturer"):
            made.ContributingEquipmentSequence = [self._acquired_by()]
        return made

    @property
    def date(self) -> str:
        """When it was made, as DICOM has dates."""
        return self.made.strftime("%Y%m%d")

    @property
    def time(self) -> str:
        """When it was made, as DICOM has times."""
        return self.made.strftime("%H%M%S")

    def _acquired_by(self) -> Dataset:
        """The scanner as an item."""
        from pydicom.dataset import Dataset

        item = Dataset()
        item.update(self.scanner)
        item.PurposeOfReferenceCodeSequence = [coded("109101", "DCM", "Acquisition Equipment")]
        return item


def coded(value: str, scheme: str, meaning: str) -> Dataset:
    """A code as an item (PS3.3 8.8)."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.CodeValue, item.CodingSchemeDesignator, item.CodeMeaning = value, scheme, meaning
    return item


def text_of(text: str, longest: int = 64) -> str:
    """A text without what separates values or breaks lines, cut where it is too long."""
    plain = " ".join("".join(each if each.isprintable() else " " for each in text).replace("\\", "/").split())
    return plain if len(plain) <= longest else plain[: longest - 3].rstrip() + "..."


def decimals(values: Iterable[float]) -> list[str]:
    """Numbers as decimal strings (DS) with as many digits as 16 characters hold."""
    from pydicom.valuerep import format_number_as_ds

    return [format_number_as_ds(float(each) + 0.0) for each in np.ravel(np.asarray(values, np.float64))]


def save_object(made: Dataset, path: Path) -> None:
    """Write an object as a DICOM file; raises InputError for values that cannot be written, and OSError."""
    with quiet_pydicom():
        try:
            made.save_as(path, enforce_file_format=True)
        except OSError:
            raise
        except Exception:  # pydicom raises nearly every kind for values that are none
            raise InputError(
                f"{path}: the CT's header names the patient or the study in a way that DICOM does not allow: export "
                "the CT from the archive again."
            ) from None
