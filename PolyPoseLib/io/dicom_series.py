"""A CT from DICOM files: which series, and where its slices are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.io.dicom import looks_like_dicom, quiet_pydicom, raw_value, read_dataset
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.slice_pixels import stack_pixels, whole_file
from PolyPoseLib.io.slice_stack import Slice, sorted_slices, stack_affine

MAX_FILES = 20_000
"""A folder with more files than this is not opened: it is more than a CT."""

_DICOM_ENDINGS = (".dcm", ".ima", ".dicom")
"""Of names that only DICOM files have."""

_PLACE_GROUPS = {
    "ImagePositionPatient": "PlanePositionSequence",
    "ImageOrientationPatient": "PlaneOrientationSequence",
    "PixelSpacing": "PixelMeasuresSequence",
}
"""Functional groups of a multi-frame file that say where a frame is."""

_TAGS = [
    "SOPClassUID", "SeriesInstanceUID", "SeriesNumber", "Modality", "ImageType", "Rows",
    "Columns", "NumberOfFrames", "PixelSpacing", "ImagePositionPatient", "ImageOrientationPatient",
    "SamplesPerPixel", "TransferSyntaxUID",
]  # fmt: skip
"""Attributes that are read of every file of a folder."""


def read_dicom_volume(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a folder of DICOM slices, or one multi-frame file, as Hounsfield units where they are a CT.

    Slices of a tilted gantry give a sheared affine.

    Parameters
    ----------
    path
        Folder or file.
    series
        Instance UID or number of the series where the folder holds several.

    Raises
    ------
    InputError
        No images, several series, one slice, missing or uneven slices, or damaged files.

    """
    path = Path(path)
    with _quiet():
        slices = read_slices(path, series)
        affine = stack_affine(slices, str(path))
        return Volume(stack_pixels(slices, path), affine)


def read_slices(path: Path, series: str | int | None = None) -> list[Slice]:
    """The slices of a series in ascending order along their normal, without pixels.

    Parameters
    ----------
    path, series
        As for `read_dicom_volume`.

    Raises
    ------
    InputError
        No images, several series, or headers that do not say where their slice is.

    """
    with _quiet():
        chosen = _choose_series(path, _headers(path), series)
        slices = _enhanced_slices(*chosen[0]) if _is_multiframe(chosen) else _plain_slices(path, chosen)
        return sorted_slices(slices)


def _headers(path: Path) -> list[tuple[Path, Any]]:
    """(file, header) of every DICOM image under a folder, in the order of their names."""
    refuse_special_file(path)
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    if len(files) > MAX_FILES:
        raise InputError(
            f"{path}: the folder holds {len(files)} files: put the slices into a folder of their own."
        )
    headers, others = [], []
    for file in files:
        header = _header(file)
        if header is not None and "Rows" in header and "SeriesInstanceUID" in header:
            headers.append((file, header))
        else:
            others.append((file, header))
    names = {_shape(file) for file, _ in headers}
    for file, header in others:
        if _shape(file) in names or file.suffix.lower() in _DICOM_ENDINGS or looks_like_dicom(file):
            _refuse_damaged(file, header)
    if not headers:
        raise InputError(f"{path}: there is no DICOM image here: give a folder of CT slices.")
    return headers


def _header(file: Path) -> Any:
    """The attributes of a DICOM file that are needed first; None when it is none, or damaged."""
    try:
        # Without a preamble, only a file that begins like one without it: others would be read as if they were DICOM.
        return read_dataset(file, stop_before_pixels=True, specific_tags=_TAGS, force=looks_like_dicom(file))
    except InputError as error:
        raise InputError(f"{file} {error}") from None
    except MemoryError as error:
        raise memory_ran_out(str(file)) from error
    except Exception:  # pydicom raises nearly every kind
        return None


def _shape(file: Path) -> str:
    """The name of a file with every number alike, as the slices of a series have it."""
    return re.sub(r"[0-9]+", "0", file.name.lower())


def _refuse_damaged(file: Path, header: Any) -> None:
    """Refuse a file that should be a slice but cannot be read as one; raises InputError that names it.

    Sound files of other kinds lie beside slices: an index, structure sets, reports.
    """
    from pydicom.uid import UID

    kind = ""
    if header is not None:
        stored = raw_value("MediaStorageSOPClassUID", getattr(header, "file_meta", None) or {})
        kind = str(stored or raw_value("SOPClassUID", header) or "")
    if kind and "Image Storage" not in UID(kind).name:
        return
    raise InputError(
        f"{file}: this slice is damaged or cut short: its DICOM header cannot be read whole: copy the series again, or "
        "remove the file if it is none of the slices."
    )


def _choose_series(
    path: Path, headers: list[tuple[Path, Any]], wanted: str | int | None
) -> list[tuple[Path, Any]]:
    """The files of the wanted series, or of the only one; localizers are left aside."""
    groups: dict[str, list[tuple[Path, Any]]] = {}
    for file, header in headers:
        if not _is_localizer(header):
            groups.setdefault(_text(header, "SeriesInstanceUID"), []).append((file, header))
    if wanted is not None:
        found = [
            files
            for uid, files in groups.items()
            if uid == str(wanted) or _text(files[0][1], "SeriesNumber") == str(wanted)
        ]
        if len(found) != 1:
            how = "no series has" if not found else f"{len(found)} series have"
            raise InputError(
                f'{path}: {how} the number or UID {wanted}: set "ct_series" to one of {_listing(groups)}.'
            )
        return found[0]
    scans = {uid: files for uid, files in groups.items() if _text(files[0][1], "Modality", "CT") == "CT"}
    if not scans:
        kinds = ", ".join(sorted({_kind(header) for _, header in headers}))
        raise InputError(f"{path}: there is no CT series here (found: {kinds}): give a folder of CT slices.")
    if len(scans) > 1:
        raise InputError(
            f'{path}: there are {len(scans)} CT series: set "ct_series" to one of {_listing(scans)}.'
        )
    return next(iter(scans.values()))


def _listing(groups: dict[str, list[tuple[Path, Any]]]) -> str:
    """Number, size and UID of each series; its description is free text that may name the patient."""
    numbers = [_text(files[0][1], "SeriesNumber") for files in groups.values()]
    entries = []
    for (uid, files), number in list(zip(groups.items(), numbers, strict=True))[:12]:
        own = number.isdecimal() and numbers.count(number) == 1
        entries.append(
            f'{number} ({len(files)} slices, "{uid}")' if own else f'"{uid}" ({len(files)} slices)'
        )
    return "; ".join(entries) + ("; ..." if len(groups) > 12 else "")


def _text(header: Any, tag: str, absent: str = "") -> str:
    """An attribute as text; absent where it is missing or unreadable."""
    value = raw_value(tag, header)
    return absent if value is None else str(value).strip()


def _kind(header: Any) -> str:
    """Modality (0008,0060) as it may appear in a sentence."""
    kind = _text(header, "Modality")
    return kind if re.fullmatch(r"[A-Z0-9_]{2,16}", kind) else "unknown"


def _whole(file: Path, header: Any, tag: str, absent: int | None = None) -> int:
    """A whole number above 0 from a header; raises InputError when it is invalid, or missing while absent is None."""
    text = _text(header, tag, "" if absent is None else str(absent))
    if not re.fullmatch(r"[0-9]{1,9}", text) or int(text) < 1:
        raise InputError(
            f"{file}: the image has no valid {tag}: remove the file, or export the series again."
        )
    return int(text)


def _is_localizer(header: Any) -> bool:
    """Whether an image is a scout view, by Image Type (0008,0008)."""
    kind = raw_value("ImageType", header) or []
    return "LOCALIZER" in ([kind] if isinstance(kind, str) else list(kind))


def _is_multiframe(chosen: list[tuple[Path, Any]]) -> bool:
    """Whether the series is one file with many frames."""
    return len(chosen) == 1 and _whole(*chosen[0], "NumberOfFrames", 1) > 1


def _plain_slices(path: Path, chosen: list[tuple[Path, Any]]) -> list[Slice]:
    """Slices of single-frame files."""
    return [_slice(file, header, header, None) for file, header in chosen]


def _enhanced_slices(file: Path, header: Any) -> list[Slice]:
    """Slices of an Enhanced CT file, from its functional groups (DICOM C.7.6.16)."""
    import pydicom

    whole = whole_file(file)
    shared = raw_value("SharedFunctionalGroupsSequence", whole) or [pydicom.Dataset()]
    frames = raw_value("PerFrameFunctionalGroupsSequence", whole) or []
    if len(frames) != _whole(file, header, "NumberOfFrames"):
        raise InputError(
            f"{file}: the multi-frame image has no position for each frame: export single slices."
        )
    places = [
        {tag: _grouped(tag, group, (frame, shared[0])) for tag, group in _PLACE_GROUPS.items()}
        for frame in frames
    ]
    return [_slice(file, header, place, number) for number, place in enumerate(places)]


def _grouped(tag: str, group: str, sources: Iterable[Any]) -> Any:
    """An attribute of a functional group, from the first source that has it; None where none does."""
    for source in sources:
        macro = raw_value(group, source)
        if macro and tag in macro[0]:
            return raw_value(tag, macro[0])
    return None


def _slice(file: Path, header: Any, place: Any, frame: int | None) -> Slice:
    """One slice from its header; place holds position, orientation and spacing."""
    wanted = (("ImagePositionPatient", 3), ("ImageOrientationPatient", 6), ("PixelSpacing", 2))
    numbers = {}
    for tag, length in wanted:
        value = raw_value(tag, place)
        try:
            numbers[tag] = np.array([float(each) for each in value], dtype=np.float64)
        except (TypeError, ValueError):
            numbers[tag] = np.empty(0)
        if numbers[tag].shape != (length,) or not np.isfinite(numbers[tag]).all():
            raise InputError(
                f"{file}: the slice has no valid {tag}: remove the file, or export the series again."
            )
    if (numbers["PixelSpacing"] <= 0).any():
        raise InputError(f"{file}: PixelSpacing is zero: export the series again with its spacing.")
    axes = numbers["ImageOrientationPatient"].reshape(2, 3)
    if not np.allclose(axes @ axes.T, np.eye(2), atol=1e-2):
        raise InputError(
            f"{file}: ImageOrientationPatient is not two perpendicular unit vectors: export again."
        )
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    size = (_whole(file, header, "Rows"), _whole(file, header, "Columns"))
    return Slice(file, numbers["ImagePositionPatient"], axes, tuple(numbers["PixelSpacing"]), size, frame)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the toolkits' warnings about headers while reading: users cannot act on them."""
    import SimpleITK as sitk

    shown = sitk.ProcessObject.GetGlobalWarningDisplay()
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        with quiet_pydicom():
            yield
    finally:
        sitk.ProcessObject.SetGlobalWarningDisplay(shown)
