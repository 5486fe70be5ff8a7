"""Open DICOM files safely: quietly, with a known transfer syntax, and no larger than an image can be."""

from __future__ import annotations

import io
import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.inflation import BoundedFile, frame_fault

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

XRAY_MODALITIES = ("XA", "RF", "CR", "DX", "MG", "RTIMAGE", "IO", "PX", "RG", "DG", "XC", "OT", "SC")
"""Modalities (0008,0060) that hold projections; OT and SC are taken with a warning."""

MAX_PIXELS = 1 << 26
"""Largest frame that is decoded: 8192 x 8192, more than any detector has."""


@contextmanager
def quiet_pydicom() -> Iterator[None]:
    """Silence pydicom's warnings and log, which repeat values, a patient's name among them."""
    logger = logging.getLogger("pydicom")
    disabled = logger.disabled
    logger.disabled = True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.disabled = disabled


def looks_like_dicom(path: Path) -> bool:
    """Whether the file starts as DICOM does: a preamble with DICM, or an element of group 0002 or 0008."""
    with path.open("rb") as stream:
        head = stream.read(132)
    if head[128:132] == b"DICM":
        return True
    return head[:2] in (b"\x02\x00", b"\x08\x00", b"\x00\x08") and len(head) > 8


def open_dicom(path: Path, where: str, **options: Any) -> Dataset:
    """Read one DICOM file, its preamble and file meta information being optional.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors.
    **options
        Of pydicom.dcmread.

    Raises
    ------
    InputError
        Not DICOM, cut short, without pixels, or not an X-ray.

    """
    if not looks_like_dicom(path):
        raise InputError(
            f"{where} does not begin like a DICOM file; give the X-ray as DICOM, or as NIfTI, NRRD, PNG or TIFF with "
            "the usual ending."
        )
    with quiet_pydicom():
        try:
            dataset = read_dataset(path, force=True, **options)
            complete_meta(dataset)
            rows, columns = dataset.get("Rows"), dataset.get("Columns")
            modality = str(dataset.get("Modality") or "").strip().upper()
            has_pixels = any(
                key in dataset for key in ("PixelData", "FloatPixelData", "DoubleFloatPixelData")
            )
        except InputError as error:
            raise InputError(f"{where} {error}") from None
        except Exception:
            raise InputError(
                f"{where} is damaged or cut short: its DICOM header cannot be read; copy the file again."
            ) from None
    if modality and modality not in XRAY_MODALITIES:
        shown = modality if re.fullmatch(r"[A-Z0-9_]{2,16}", modality) else "unknown"
        raise InputError(
            f"{where} is a DICOM object of modality {shown}, not an X-ray; give an XA, RF, CR, DX, MG or "
            "RTIMAGE file."
        )
    if not has_pixels:
        raise InputError(
            f"{where} holds no pixel data (7FE0,0010): it is only a header or was cut short; give the image's file."
        )
    _check_size(rows, columns, where)
    return dataset


def _check_size(rows: Any, columns: Any, where: str) -> None:
    """Refuse sizes that are absent or that no detector has, before anything is allocated."""
    if not (isinstance(rows, int) and isinstance(columns, int) and rows > 0 and columns > 0):
        raise InputError(f"{where} does not say how many rows and columns it has; export the image again.")
    if rows * columns > MAX_PIXELS:
        raise InputError(
            f"{where} claims {rows} x {columns} pixels, more than the {MAX_PIXELS} that are read; "
            "its header is wrong, export the image again."
        )


def complete_meta(dataset: Dataset) -> None:
    """Give a file without file meta information the transfer syntax that it was read with."""
    from pydicom.dataset import FileMetaDataset
    from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

    if getattr(dataset, "file_meta", None) is None:
        dataset.file_meta = FileMetaDataset()
    if "TransferSyntaxUID" not in dataset.file_meta:
        implicit, little = dataset.original_encoding
        explicit = ExplicitVRLittleEndian if little else ExplicitVRBigEndian
        dataset.file_meta.TransferSyntaxUID = ImplicitVRLittleEndian if implicit else explicit
    str(dataset.file_meta.TransferSyntaxUID)


def read_dataset(path: Path, **options: Any) -> Dataset:
    """Read a DICOM file by pydicom, however it is deflated no larger than an image can be.

    Parameters
    ----------
    path
        The file.
    **options
        Of pydicom.dcmread.

    Raises
    ------
    InputError
        It grows beyond the limit; the text is to follow the file's name.  Other errors are pydicom's own, of nearly
        every kind.

    """
    import pydicom

    with BoundedFile(io.FileIO(path)) as stream:
        return pydicom.dcmread(stream, **options)


def refuse_swollen(dataset: Dataset, where: str) -> None:
    """Refuse compressed pixel data that would grow beyond what the header promises; raises InputError."""
    try:
        fault = frame_fault(dataset)
    except Exception:  # pydicom raises nearly every kind for values that are none
        raise InputError(
            f"{where} is damaged or cut short: its compressed pixels cannot be found; copy the file again."
        ) from None
    if fault:
        raise InputError(f"{where} is damaged: it {fault}; copy the file again or export it uncompressed.")


def refuse_short(dataset: Dataset, where: str) -> None:
    """Compare the length of uncompressed pixel data with what the header promises; raises InputError.

    A toolkit that is not stopped here fills the rest with whatever the memory held.
    """
    try:
        if dataset.file_meta.TransferSyntaxUID.is_encapsulated or "PixelData" not in dataset:
            return
        samples = int(dataset.get("SamplesPerPixel") or 1)
        frames = max(int(dataset.get("NumberOfFrames") or 1), 1)
        expected = dataset.Rows * dataset.Columns * samples * frames * int(dataset.BitsAllocated) // 8
        if dataset.get("PhotometricInterpretation") == "YBR_FULL_422":
            expected = expected * 2 // 3
    except Exception:  # pydicom raises nearly every kind for values that are none
        raise InputError(f"{where} does not say how its pixels are stored; export the image again.") from None
    if len(dataset.PixelData) < expected:
        raise InputError(
            f"{where} is cut short: its header promises {expected} bytes of pixels and it holds "
            f"{len(dataset.PixelData)}; copy the file again."
        )


def raw_value(keyword: str, dataset: Any) -> Any:
    """Value of one attribute of a dataset or a mapping, None when absent, empty or unreadable."""
    with quiet_pydicom():
        try:
            value = dataset.get(keyword)
        except Exception:  # pydicom raises nearly every kind for values that are none
            return None
    return None if value is None or (isinstance(value, str) and not value.strip()) else value
