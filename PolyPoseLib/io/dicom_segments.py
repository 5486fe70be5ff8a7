"""DICOM objects that hold structures, segmentations and structure sets: which file one is, and its reader."""

from __future__ import annotations

import os
from itertools import islice
from pathlib import Path
from typing import Any

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.io.dicom import looks_like_dicom, quiet_pydicom, raw_value, read_dataset
from PolyPoseLib.io.dicom_items import refuse_many_items
from PolyPoseLib.io.dicom_seg import read_seg
from PolyPoseLib.io.machine_memory import require_room
from PolyPoseLib.io.rtstruct import read_rtstruct

MAX_FILES = 20_000
"""A folder with more entries is not searched for a segmentation."""

_KINDS = {
    "1.2.840.10008.5.1.4.1.1.66.4": "SEG",
    "1.2.840.10008.5.1.4.1.1.66.7": "SEG",
    "1.2.840.10008.5.1.4.1.1.481.3": "RTSTRUCT",
}
"""Storage classes: Segmentation, Label Map Segmentation (DICOM supplement 243), RT Structure Set."""

_MODALITIES = ("SEG", "RTSTRUCT")
_IMAGE_ENDINGS = (
    ".nii",
    ".gz",
    ".nrrd",
    ".nhdr",
    ".mha",
    ".mhd",
    ".hdr",
    ".img",
    ".png",
    ".tif",
    ".tiff",
    ".json",
)


def find_dicom_segmentation(path: Path) -> tuple[Path, str] | None:
    """The file that holds structures, and "SEG" or "RTSTRUCT".

    Parameters
    ----------
    path
        A file, or a folder that holds one such file, beside its CT perhaps.

    Raises
    ------
    InputError
        A folder with several of them, or with too many files.

    """
    if not path.is_dir():
        kind = _kind(path)
        return None if kind is None else (path, kind)
    with os.scandir(path) as entries:
        names = [each.name for each in islice(entries, MAX_FILES + 1)]
    if len(names) > MAX_FILES:
        raise InputError(f"{path}: it holds more than {MAX_FILES} files: give the segmentation's file.")
    found = [
        (path / name, kind)
        for name in sorted(names)
        if not name.startswith(".") and (kind := _kind(path / name)) is not None
    ]
    if len(found) > 1:
        raise InputError(
            f"{path}: the folder holds {len(found)} segmentations or structure sets: give one by its file's name."
        )
    return found[0] if found else None


def read_dicom_segmentation(path: Path, kind: str, reference: Volume | None) -> Segmentation:
    """Read a DICOM segmentation (SEG), or a structure set (RTSTRUCT); names of segments are names of labels.

    Parameters
    ----------
    path
        The file.
    kind
        "SEG" or "RTSTRUCT".
    reference
        The CT, on whose grid contours are filled.

    Raises
    ------
    InputError
        The file is damaged, too large, or of a kind that is not read; the sentence names it and the fix.

    """
    refuse_many_items(path)
    require_room(float(path.stat().st_size), str(path))
    with quiet_pydicom():
        try:
            return read_seg(path) if kind == "SEG" else read_rtstruct(path, reference)
        except InputError:
            raise
        except MemoryError as error:
            raise memory_ran_out(str(path)) from error
        except Exception:  # pydicom raises nearly every kind for values that are none
            raise InputError(
                f"{path}: the segmentation is damaged or cut short: its DICOM header cannot be read; copy or export it "
                "again."
            ) from None


def _kind(file: Path) -> str | None:
    """What a file holds, None where it is no such object or cannot be read."""
    if file.name.lower().endswith(_IMAGE_ENDINGS) or not file.is_file():
        return None
    header: Any = None
    try:
        if looks_like_dicom(file):
            tags = ["SOPClassUID", "Modality"]
            header = read_dataset(file, stop_before_pixels=True, specific_tags=tags, force=True)
    except Exception:  # left to the reader of slices, which says what is wrong
        return None
    if header is None:
        return None
    stored = str(raw_value("SOPClassUID", header) or "").strip()
    modality = str(raw_value("Modality", header) or "").strip().upper()
    return _KINDS.get(stored) or (modality if modality in _MODALITIES else None)
