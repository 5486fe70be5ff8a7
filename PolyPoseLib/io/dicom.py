"""Open DICOM files safely: quietly, with a known transfer syntax, and no larger than an image can be."""

from __future__ import annotations

import io
import logging
import re
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
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


_DEFLATED = "1.2.840.10008.1.2.1.99"
"""Transfer syntax whose places are those of the inflated bytes."""


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


def _require_dicom(path: Path, where: str) -> None:
    """Raise InputError where a file does not begin as DICOM does."""
    if not looks_like_dicom(path):
        raise InputError(
            f"{where} does not begin like a DICOM file; give the X-ray as DICOM, or as NIfTI, NRRD, PNG or TIFF with "
            "the usual ending."
        )


def open_dicom(path: Path, where: str) -> Dataset:
    """Read one DICOM file, its preamble and file meta information being optional.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors.

    Raises
    ------
    InputError
        Not DICOM, cut short, without pixels, or not an X-ray.

    """
    _require_dicom(path, where)
    with quiet_pydicom():
        try:
            dataset = read_dataset(path, force=True)
            has_pixels = any(
                key in dataset for key in ("PixelData", "FloatPixelData", "DoubleFloatPixelData")
            )
            modality = _completed(dataset)
        except InputError as error:
            raise InputError(f"{where} {error}") from None
        except Exception:
            raise InputError(_unreadable(where)) from None
    _check_image(dataset, modality, has_pixels, where)
    return dataset


@dataclass(frozen=True)
class PixelPlace:
    """Where the value of Pixel Data (7FE0,0010) lies in a file.

    Attributes
    ----------
    start
        Its first byte.
    length
        In bytes, as the element states it; 0xFFFFFFFF for encapsulated frames.
    vr
        Its value representation.

    """

    start: int
    length: int
    vr: str


def open_dicom_header(path: Path, where: str) -> tuple[Dataset, PixelPlace | None]:
    """Read one DICOM file without its pixels, which stay where they are.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors.

    Returns
    -------
    tuple[Dataset, PixelPlace | None]
        The other attributes, and where the pixels are; None where they were read, too: those of deflated files have no
        place, and real numbers are another element.

    Raises
    ------
    InputError
        As `open_dicom`.

    """
    _require_dicom(path, where)
    with quiet_pydicom():
        try:
            with BoundedFile(io.FileIO(path)) as stream:
                dataset, place = _header_and_place(stream)
            modality = _completed(dataset)
        except InputError as error:
            raise InputError(f"{where} {error}") from None
        except Exception:
            raise InputError(_unreadable(where)) from None
    if place is None or dataset.file_meta.TransferSyntaxUID == _DEFLATED:
        return open_dicom(path, where), None
    _check_image(dataset, modality, True, where)
    return dataset, place


def _header_and_place(stream: io.BufferedReader) -> tuple[Dataset, PixelPlace | None]:
    """All attributes before the pixels, and the place of Pixel Data, where that is what follows."""
    import pydicom

    dataset = pydicom.dcmread(stream, force=True, stop_before_pixels=True)
    implicit, little = dataset.original_encoding
    order = "<" if little else ">"
    head = stream.read(12)
    if len(head) < 12 or struct.unpack(order + "HH", head[:4]) != (0x7FE0, 0x0010):
        return dataset, None
    end = stream.tell()
    if implicit:
        return dataset, PixelPlace(end - 4, struct.unpack(order + "I", head[4:8])[0], "OW")
    vr = head[4:6].decode("ascii")
    if vr not in ("OB", "OW", "UN"):
        return dataset, None
    return dataset, PixelPlace(end, struct.unpack(order + "I", head[8:])[0], vr)


def _completed(dataset: Dataset) -> str:
    """The modality of a dataset, whose file meta information is completed; raises nearly every kind of error."""
    complete_meta(dataset)
    return str(dataset.get("Modality") or "").strip().upper()


def _unreadable(where: str) -> str:
    """The sentence about a file that pydicom does not read."""
    return f"{where} is damaged or cut short: its DICOM header cannot be read; copy the file again."


def _check_image(dataset: Dataset, modality: str, has_pixels: bool, where: str) -> None:
    """Refuse what is no X-ray, has no pixels, or a size that no detector has; raises InputError."""
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
    with quiet_pydicom():
        try:
            rows, columns = dataset.get("Rows"), dataset.get("Columns")
        except Exception:
            raise InputError(_unreadable(where)) from None
    _check_size(rows, columns, where)


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
