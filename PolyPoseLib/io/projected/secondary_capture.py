"""A drawn X-ray as DICOM: a Secondary Capture of the same patient and study that refers to the X-ray."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib import __version__
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import quiet_pydicom, read_dataset
from PolyPoseLib.io.dicom_export.objects import MAKER, coded, new_uid, save_object, text_of
from PolyPoseLib.io.dicom_export.taken_over import PAIRED_PARTS, PATIENT, REGION, REQUIRED, taken_over

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

SECONDARY_CAPTURE = "1.2.840.10008.5.1.4.1.1.7"

SERIES_NUMBER = 9101
"""Far above what scanners count to."""

_OF_THE_IMAGE = ("PatientOrientation", "LossyImageCompression", "LossyImageCompressionRatio")
_UNICODE = "ISO_IR 192"


class CaptureSeries:
    """The series of one projection, one capture for every X-ray that was DICOM."""

    def __init__(self) -> None:
        self._series: dict[str, str] = {}
        self._now = datetime.datetime.now()

    def write(self, picture: np.ndarray, number: int, source: Path, path: Path) -> None:
        """Write one drawn X-ray.

        Parameters
        ----------
        picture : (H, W, 3) array of uint8
            As it is shown.
        number : int
            Of the X-ray, from 1.
        source : Path
            The X-ray's DICOM file.
        path : Path
            To write.

        Raises
        ------
        InputError
            The X-ray's file says nothing of its study or its own identity.

        """
        with quiet_pydicom():
            header = read_dataset(source, force=True, stop_before_pixels=True)
            study = str(header.get("StudyInstanceUID") or "")
            identity = [str(header.get(each) or "") for each in ("SOPClassUID", "SOPInstanceUID")]
        if not study or not all(identity):
            raise InputError(
                f"{source}: the X-ray has no Study or SOP Instance UID, to which a capture would refer: leave out "
                "--study for pictures alone."
            )
        made = self._new(header, study, number)
        _refer(made, *identity)
        _fill(made, picture)
        save_object(made, path)

    def _new(self, header: Dataset, study: str, number: int) -> Dataset:
        """Everything but references and pixels; X-rays of one study share a series."""
        from pydicom.dataset import Dataset, FileMetaDataset
        from pydicom.uid import UID, ExplicitVRLittleEndian

        made = Dataset()
        made.file_meta = FileMetaDataset()
        made.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        made.SpecificCharacterSet = _UNICODE
        made.update(taken_over(header, (*PATIENT, *REGION, *_OF_THE_IMAGE), "The X-ray"))
        for keyword in (*REQUIRED, "PatientOrientation"):
            if keyword not in made:
                setattr(made, keyword, "")
        part = str(made.get("BodyPartExamined") or "")
        if "Laterality" not in made and (not part or part in PAIRED_PARTS):
            made.Laterality = ""
        date, time = self._now.strftime("%Y%m%d"), self._now.strftime("%H%M%S")
        made.SOPClassUID = made.file_meta.MediaStorageSOPClassUID = UID(SECONDARY_CAPTURE)
        made.SOPInstanceUID = made.file_meta.MediaStorageSOPInstanceUID = UID(new_uid())
        made.InstanceCreationDate, made.InstanceCreationTime = date, time
        made.ContentDate, made.ContentTime = date, time
        made.Modality, made.ConversionType = "OT", "WSD"
        made.SeriesInstanceUID = self._series.setdefault(study, new_uid())
        made.SeriesNumber, made.InstanceNumber = SERIES_NUMBER, number
        made.SeriesDate, made.SeriesTime = date, time
        made.SeriesDescription = "Plan of the CT on the X-rays (PolyPose)"
        made.Manufacturer = made.ManufacturerModelName = MAKER
        made.SoftwareVersions = __version__
        made.SecondaryCaptureDeviceManufacturer = MAKER
        made.ImageType = ["DERIVED", "SECONDARY"]
        with quiet_pydicom():
            identifies = str(header.get("BurnedInAnnotation") or "").strip().upper() == "YES"
        made.BurnedInAnnotation = "YES" if identifies else "NO"
        return made


def _refer(made: Dataset, sop_class: str, sop_instance: str) -> None:
    """Say from which image it was made, and how."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.ReferencedSOPClassUID, item.ReferencedSOPInstanceUID = sop_class, sop_instance
    item.PurposeOfReferenceCodeSequence = [
        coded("121322", "DCM", "Source image for image processing operation")
    ]
    made.SourceImageSequence = [item]
    made.DerivationDescription = text_of(
        f"A plan made on the CT, carried to the patient as X-rayed and projected, burned in. {MAKER} {__version__}. "
        "Research software, not for clinical decisions.",
        1024,
    )


def _fill(made: Dataset, picture: np.ndarray) -> None:
    """The pixels in colour."""
    made.Rows, made.Columns = picture.shape[:2]
    made.SamplesPerPixel, made.PhotometricInterpretation, made.PlanarConfiguration = 3, "RGB", 0
    made.BitsAllocated, made.BitsStored, made.HighBit, made.PixelRepresentation = 8, 8, 7, 0
    pixels = np.ascontiguousarray(picture, dtype=np.uint8).tobytes()
    made.PixelData = pixels + b"\0" * (len(pixels) % 2)
    made["PixelData"].VR = "OB"
