"""Write a simulated X-ray as DICOM X-Ray Angiographic Image (PS3.3 A.14) with its full geometry.

The patient is anonymous, the identifiers are made up from the content, and ImageType says DERIVED. An XA
file assumes that the central ray meets the image's centre; a principal point elsewhere belongs into the
study file.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import focal_length_px
from PolyPoseLib.geometry.carm import PATIENT_POSITIONS, carm_angles, carm_extrinsic
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.xray.intensity import PRIVATE_CREATOR, PRIVATE_GROUP

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

_XA_STORAGE = "1.2.840.10008.5.1.4.1.1.12.1"
_EXPLICIT_LITTLE_ENDIAN = "1.2.840.10008.1.2.1"
_AXES = (("L", "R"), ("P", "A"), ("H", "F"))


def write_xray_dicom(
    path: str | Path,
    line_integrals: ArrayLike,
    *,
    source_to_detector_mm: float,
    pixel_spacing_mm: tuple[float, float],
    source_to_isocenter_mm: float | None = None,
    primary_deg: float | None = None,
    secondary_deg: float | None = None,
    extrinsic: ArrayLike | None = None,
    bits: int = 12,
    encoding: str = "linear",
    saturation: float = 0.0,
    photons: float | None = None,
    seed: int = 0,
    display: str = "source",
    patient_position: str = "HFS",
    description: str = "simulated",
    study: str = "",
) -> Path:
    """Write line integrals as an XA file that `read_xray` turns back into them within quantisation.

    Args:
        path: file to write, replaced if it exists.
        line_integrals: (H, W) one image or (F, H, W) a run, unitless, as seen from the source.
        source_to_detector_mm: distance from the source to the detector (0018,1110).
        pixel_spacing_mm: at the detector, (between rows, between columns) (0018,1164).
        source_to_isocenter_mm: distance from the source to the isocentre (0018,1111), left out when None.
        primary_deg: positioner primary angle, positive toward LAO (0018,1510).
        secondary_deg: positioner secondary angle, positive toward CRA (0018,1511).
        extrinsic: (4, 4) world LPS to camera; gives the angles that are None, and Patient Orientation
            (0020,0020).
        bits: bits stored, 8 to 16.
        encoding: "linear": proportional to the beam (LIN); "log": linear in the line integral (LOG).
        saturation: line integrals below this are burnt out to it.
        photons: count of an unattenuated pixel, for Poisson noise; no noise when None.
        seed: of the noise.
        display: "source": stored as seen from the source; "detector": columns reversed, as C-arms show it.
        patient_position: (0018,5100).
        description: series description.
        study: files with the same text share their Study Instance UID.

    Returns:
        The path.

    Raises:
        InputError: values or settings that cannot be stored.

    """
    lines = _checked(line_integrals, bits, encoding, saturation, photons, display)
    focal_length_px(source_to_detector_mm, pixel_spacing_mm)
    if patient_position not in PATIENT_POSITIONS:
        raise InputError(
            f"patient_position is {patient_position!r}; give one of {', '.join(PATIENT_POSITIONS)}."
        )
    if photons is not None:
        counts = np.random.default_rng(seed).poisson(photons * np.exp(-lines))
        lines = -np.log(np.maximum(counts, 0.5) / photons)
    stored, calibration = _encoded(np.maximum(lines, saturation), bits, encoding, saturation)
    if display == "detector":
        stored = stored[..., ::-1]
    dataset = _identified(stored, description, study)
    _put_image(dataset, stored, bits, encoding, calibration)
    _put_geometry(
        dataset,
        source_to_detector_mm,
        source_to_isocenter_mm,
        pixel_spacing_mm,
        patient_position,
        lines.ndim == 3,
    )
    _put_orientation(dataset, primary_deg, secondary_deg, extrinsic, display)
    block = dataset.private_block(PRIVATE_GROUP, PRIVATE_CREATOR, create=True)
    for offset, value in calibration.items():
        block.add_new(offset, "FD", value)
    path = Path(path)
    try:
        dataset.save_as(path, enforce_file_format=True)
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror}); choose another folder.") from None
    return path


def _checked(line_integrals, bits, encoding, saturation, photons, display) -> np.ndarray:
    """Line integrals in float64, all settings in range."""
    lines = np.asarray(line_integrals, dtype=np.float64)
    if lines.ndim not in (2, 3) or not lines.size or not np.isfinite(lines).all():
        raise InputError("Line integrals to write must be finite and of shape (H, W) or (F, H, W).")
    if isinstance(bits, bool) or not isinstance(bits, int | np.integer) or not 8 <= bits <= 16:
        raise InputError(f"bits is {bits}; give a whole number from 8 to 16.")
    if encoding not in ("linear", "log"):
        raise InputError(f'encoding is {encoding!r}; give "linear" or "log".')
    if display not in ("source", "detector"):
        raise InputError(f'display is {display!r}; give "source" or "detector".')
    if not (np.isfinite(saturation) and saturation >= 0):
        raise InputError(f"saturation is {saturation}; give a line integral of 0 or more.")
    if photons is not None and not (np.isfinite(photons) and photons > 0):
        raise InputError(f"photons is {photons}; give a count above 0.")
    return lines


def _encoded(
    lines: np.ndarray, bits: int, encoding: str, saturation: float
) -> tuple[np.ndarray, dict[int, float]]:
    """Stored values, and the private elements that lead back: {1: I0} or {2: slope, 3: intercept}."""
    levels = 2**bits - 1
    if encoding == "linear":
        direct = levels * float(np.exp(saturation))
        stored = np.clip(np.rint(direct * np.exp(-lines)), 1, levels)
        calibration = {1: direct}
    else:
        top = max(float(lines.max()), saturation + 1e-6)
        step = (top - saturation) / levels
        stored = np.clip(np.rint((top - lines) / step), 0, levels)
        calibration = {2: -step, 3: top}
    return stored.astype(np.uint8 if bits == 8 else np.uint16), calibration


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


def _put_image(
    dataset: Dataset, stored: np.ndarray, bits: int, encoding: str, calibration: dict[int, float]
) -> None:
    """Image Pixel, Multi-frame, X-Ray Image and Modality LUT modules (PS3.3 C.7.6.3, C.8.7.1, C.11.1)."""
    dataset.SamplesPerPixel = 1
    dataset.PhotometricInterpretation = "MONOCHROME2"
    dataset.Rows, dataset.Columns = stored.shape[-2:]
    dataset.BitsAllocated = 8 * stored.itemsize
    dataset.BitsStored, dataset.HighBit, dataset.PixelRepresentation = bits, bits - 1, 0
    dataset.PixelIntensityRelationship = "LIN" if encoding == "linear" else "LOG"
    dataset.LossyImageCompression = "00"
    if stored.ndim == 3:
        dataset.NumberOfFrames = len(stored)
        dataset.FrameTime = "100"
        dataset.FrameIncrementPointer = 0x00181063
    if encoding == "log":
        dataset.ModalityLUTSequence = [_linear_lut(bits, calibration)]
    raw = np.ascontiguousarray(stored, dtype=stored.dtype.newbyteorder("<")).tobytes()
    dataset.add_new("PixelData", "OB" if stored.itemsize == 1 else "OW", raw + b"\0" * (len(raw) % 2))


def _linear_lut(bits: int, calibration: dict[int, float]) -> Dataset:
    """Modality LUT from logarithmic stored values to 16-bit values proportional to the beam."""
    from pydicom.dataset import Dataset

    entries = 2**bits
    lines = calibration[2] * np.arange(entries) + calibration[3]
    linear = np.rint(65535 * np.exp(lines.min() - lines)).astype("<u2")
    item = Dataset()
    item.add_new("LUTDescriptor", "US", [entries % 65536, 0, 16])
    item.ModalityLUTType = "US"
    item.add_new("LUTData", "OW", linear.tobytes())
    return item


def _put_geometry(
    dataset, source_to_detector, source_to_isocenter, spacing, patient_position, run: bool
) -> None:
    """X-Ray Acquisition and XA Positioner modules, distances only (PS3.3 C.8.7.2, C.8.7.5)."""
    dataset.KVP = dataset.XRayTubeCurrent = dataset.ExposureTime = None
    dataset.RadiationSetting = "GR"
    dataset.ImagerPixelSpacing = [_decimal(part) for part in spacing]
    dataset.DistanceSourceToDetector = _decimal(source_to_detector)
    dataset.PatientPosition = patient_position
    dataset.PositionerType = "CARM"
    if run:
        dataset.PositionerMotion = "STATIC"
    if source_to_isocenter is not None:
        if not 0 < source_to_isocenter < source_to_detector:
            raise InputError(
                f"source_to_isocenter_mm is {source_to_isocenter}; give a number between 0 and the detector's distance."
            )
        dataset.DistanceSourceToPatient = _decimal(source_to_isocenter)
        dataset.EstimatedRadiographicMagnificationFactor = _decimal(source_to_detector / source_to_isocenter)


def _put_orientation(dataset, primary_deg, secondary_deg, extrinsic, display: str) -> None:
    """Positioner angles and Patient Orientation (PS3.3 C.8.7.5.1.2, C.7.6.1.1.1)."""
    dataset.PositionerPrimaryAngle = dataset.PositionerSecondaryAngle = dataset.PatientOrientation = None
    if extrinsic is not None:
        rotation = require_rigid(extrinsic)[:3, :3]
        angles = carm_angles(extrinsic)
        primary_deg = angles.primary_deg if primary_deg is None else primary_deg
        secondary_deg = angles.secondary_deg if secondary_deg is None else secondary_deg
    elif primary_deg is not None and secondary_deg is not None:
        rotation = carm_extrinsic(primary_deg, secondary_deg, 1.0)[:3, :3]
    else:
        return
    dataset.PositionerPrimaryAngle, dataset.PositionerSecondaryAngle = (
        _decimal(primary_deg),
        _decimal(secondary_deg),
    )
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
