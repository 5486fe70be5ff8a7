"""Write a simulated X-ray as DICOM X-Ray Angiographic Image (PS3.3 A.14) with its full geometry.

The patient is anonymous, the identifiers are made up from the content, and ImageType says DERIVED. An XA
file assumes that the central ray meets the image's centre; a principal point elsewhere belongs into the
study file.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import focal_length_px
from PolyPoseLib.geometry.carm import PATIENT_POSITIONS, carm_angles, carm_extrinsic
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.xray.storage import Storage, put_scale

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

_XA_STORAGE = "1.2.840.10008.5.1.4.1.1.12.1"
_EXPLICIT_LITTLE_ENDIAN = "1.2.840.10008.1.2.1"
_AXES = (("L", "R"), ("P", "A"), ("H", "F"))


@dataclass(frozen=True, kw_only=True)
class Stand:
    """Where the X-ray was taken from, as its file states it; one that exists is valid.

    Attributes
    ----------
    source_to_detector_mm
        Distance from the source to the detector (0018,1110).
    pixel_spacing_mm
        At the detector, (between rows, between columns) (0018,1164).
    source_to_isocenter_mm
        Distance from the source to the isocentre (0018,1111), left out when None.
    primary_deg
        Positioner primary angle, positive toward LAO (0018,1510).
    secondary_deg
        Positioner secondary angle, positive toward CRA (0018,1511).
    extrinsic
        (4, 4) world LPS to camera; gives the angles that are None, and Patient Orientation (0020,0020).
    patient_position
        (0018,5100).

    Raises
    ------
    InputError
        From the constructor, for distances, spacings and positions that no stand has.

    """

    source_to_detector_mm: float
    pixel_spacing_mm: tuple[float, float]
    source_to_isocenter_mm: float | None = None
    primary_deg: float | None = None
    secondary_deg: float | None = None
    extrinsic: ArrayLike | None = None
    patient_position: str = "HFS"

    def __post_init__(self) -> None:
        """Validate."""
        focal_length_px(self.source_to_detector_mm, self.pixel_spacing_mm)
        if self.patient_position not in PATIENT_POSITIONS:
            raise InputError(
                f"patient_position is {self.patient_position!r}; give one of {', '.join(PATIENT_POSITIONS)}."
            )
        near = self.source_to_isocenter_mm
        if near is not None and not 0 < near < self.source_to_detector_mm:
            raise InputError(
                f"source_to_isocenter_mm is {near}; give a number between 0 and the detector's distance."
            )
        if self.extrinsic is not None:
            require_rigid(self.extrinsic)

    def view(self) -> tuple[np.ndarray, float, float] | None:
        """Rotation (3, 3) world to camera, primary and secondary angle in degrees; None when nothing gives them."""
        if self.extrinsic is not None:
            angles = carm_angles(self.extrinsic)
            primary = angles.primary_deg if self.primary_deg is None else self.primary_deg
            secondary = angles.secondary_deg if self.secondary_deg is None else self.secondary_deg
            return require_rigid(self.extrinsic)[:3, :3], primary, secondary
        if self.primary_deg is None or self.secondary_deg is None:
            return None
        rotation = carm_extrinsic(self.primary_deg, self.secondary_deg, 1.0)[:3, :3]
        return rotation, self.primary_deg, self.secondary_deg


def write_xray_dicom(
    path: str | Path,
    line_integrals: ArrayLike,
    stand: Stand,
    storage: Storage | None = None,
    *,
    description: str = "simulated",
    study: str = "",
    frame_ms: float = 100.0,
) -> Path:
    """Write line integrals as an XA file that `read_xray` turns back into them within quantisation.

    Parameters
    ----------
    path
        File to write, replaced if it exists.
    line_integrals
        (H, W) one image or (F, H, W) a run, unitless, as seen from the source.
    stand
        Distances, spacing and angles.
    storage
        Bits, encoding and noise; `Storage()` when None.
    description
        Series description.
    study
        Files with the same text share their Study Instance UID.
    frame_ms
        Time between the frames of a run.

    Returns
    -------
    Path
        The path.

    Raises
    ------
    InputError
        Values that cannot be stored, or a path that cannot be written.

    """
    storage = storage or Storage()
    stored, scale = storage.stored(line_integrals)
    dataset = _identified(stored, description, study)
    _put_image(dataset, stored, storage, scale)
    if stored.ndim == 3:
        dataset.FrameTime = _decimal(frame_ms)
    _put_geometry(dataset, stand, run=stored.ndim == 3)
    _put_orientation(dataset, stand, storage.display)
    put_scale(dataset, scale)
    path = Path(path)
    try:
        dataset.save_as(path, enforce_file_format=True)
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror}); choose another folder.") from None
    return path


def _identified(stored: np.ndarray, description: str, study: str) -> Dataset:
    """Dataset with file meta information, an anonymous patient, and identifiers made from the content."""
    from pydicom.dataset import Dataset, FileMetaDataset
    from pydicom.uid import UID, generate_uid

    digest = hashlib.sha256(stored.tobytes() + description.encode()).hexdigest()
    dataset = Dataset()
    dataset.file_meta = FileMetaDataset()
    dataset.file_meta.MediaStorageSOPClassUID = UID(_XA_STORAGE)
    dataset.file_meta.TransferSyntaxUID = UID(_EXPLICIT_LITTLE_ENDIAN)
    dataset.SOPClassUID = _XA_STORAGE
    dataset.SOPInstanceUID = generate_uid(entropy_srcs=["image", digest])
    dataset.file_meta.MediaStorageSOPInstanceUID = dataset.SOPInstanceUID
    dataset.StudyInstanceUID = generate_uid(entropy_srcs=["study", study or digest])
    dataset.SeriesInstanceUID = generate_uid(entropy_srcs=["series", digest])
    dataset.SpecificCharacterSet = "ISO_IR 192"
    dataset.ImageType = ["DERIVED", "PRIMARY", "SINGLE PLANE"]
    dataset.Modality = "XA"
    dataset.Manufacturer = "PolyPose"
    dataset.SeriesDescription = description[:64]
    dataset.DerivationDescription = "Simulated X-ray, not a patient's"
    dataset.PatientName = "ANONYMOUS"
    dataset.PatientID = "SIMULATED"
    dataset.PatientIdentityRemoved = "YES"
    dataset.DeidentificationMethod = "simulated"
    for empty in (
        "PatientBirthDate",
        "PatientSex",
        "StudyDate",
        "StudyTime",
        "ReferringPhysicianName",
        "StudyID",
    ):
        setattr(dataset, empty, "")
    dataset.AccessionNumber = ""
    dataset.SeriesNumber = dataset.InstanceNumber = 1
    return dataset


def _put_image(dataset: Dataset, stored: np.ndarray, storage: Storage, scale: dict[str, float]) -> None:
    """Image Pixel, Multi-frame, X-Ray Image and Modality LUT modules (PS3.3 C.7.6.3, C.8.7.1, C.11.1)."""
    dataset.SamplesPerPixel = 1
    dataset.PhotometricInterpretation = "MONOCHROME2"
    dataset.Rows, dataset.Columns = stored.shape[-2:]
    dataset.BitsAllocated = 8 * stored.itemsize
    dataset.BitsStored, dataset.HighBit, dataset.PixelRepresentation = storage.bits, storage.bits - 1, 0
    dataset.PixelIntensityRelationship = "LIN" if storage.encoding == "linear" else "LOG"
    dataset.LossyImageCompression = "00"
    if stored.ndim == 3:
        dataset.NumberOfFrames = len(stored)
        dataset.FrameIncrementPointer = 0x00181063
    if storage.encoding == "log":
        dataset.ModalityLUTSequence = [_linear_lut(storage.bits, scale)]
    raw = np.ascontiguousarray(stored, dtype=stored.dtype.newbyteorder("<")).tobytes()
    dataset.add_new("PixelData", "OB" if stored.itemsize == 1 else "OW", raw + b"\0" * (len(raw) % 2))


def _linear_lut(bits: int, scale: dict[str, float]) -> Dataset:
    """Modality LUT from logarithmic stored values to 16-bit values proportional to the beam."""
    from pydicom.dataset import Dataset

    entries = 2**bits
    lines = scale["slope"] * np.arange(entries) + scale["intercept"]
    linear = np.rint(65535 * np.exp(lines.min() - lines)).astype("<u2")
    item = Dataset()
    item.add_new("LUTDescriptor", "US", [entries % 65536, 0, 16])
    item.ModalityLUTType = "US"
    item.add_new("LUTData", "OW", linear.tobytes())
    return item


def _put_geometry(dataset: Dataset, stand: Stand, *, run: bool) -> None:
    """X-Ray Acquisition and XA Positioner modules, distances only (PS3.3 C.8.7.2, C.8.7.5)."""
    dataset.KVP = dataset.XRayTubeCurrent = dataset.ExposureTime = None
    dataset.RadiationSetting = "GR"
    dataset.ImagerPixelSpacing = [_decimal(part) for part in stand.pixel_spacing_mm]
    dataset.DistanceSourceToDetector = _decimal(stand.source_to_detector_mm)
    dataset.PatientPosition = stand.patient_position
    dataset.PositionerType = "CARM"
    if run:
        dataset.PositionerMotion = "STATIC"
    near = stand.source_to_isocenter_mm
    if near is not None:
        dataset.DistanceSourceToPatient = _decimal(near)
        dataset.EstimatedRadiographicMagnificationFactor = _decimal(stand.source_to_detector_mm / near)


def _put_orientation(dataset: Dataset, stand: Stand, display: str) -> None:
    """Positioner angles and Patient Orientation (PS3.3 C.8.7.5.1.2, C.7.6.1.1.1)."""
    dataset.PositionerPrimaryAngle = dataset.PositionerSecondaryAngle = dataset.PatientOrientation = None
    view = stand.view()
    if view is None:
        return
    rotation, primary, secondary = view
    dataset.PositionerPrimaryAngle = _decimal(primary)
    dataset.PositionerSecondaryAngle = _decimal(secondary)
    columns = -rotation[0] if display == "detector" else rotation[0]
    dataset.PatientOrientation = [_letters(columns), _letters(rotation[1])]


def _letters(direction: np.ndarray) -> str:
    """Anatomical letters of a direction (3,) in LPS, the largest part first."""
    order = np.argsort(-np.abs(direction), kind="stable")
    return "".join(_AXES[axis][int(direction[axis] < 0)] for axis in order if abs(direction[axis]) > 0.2)


def _decimal(value: float) -> str:
    """A decimal string (DS) of at most 16 characters that keeps the most digits."""
    value = float(value)
    for digits in range(15, 3, -1):
        text = f"{value:.{digits}g}"
        if len(text) <= 16:
            return text
    return f"{value:.6g}"
