"""A patient's folder of DICOM as an archive delivers it: which CTs it holds, in which order, with which structures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.places import entries, inside
from PolyPoseLib.io.dicom import looks_like_dicom, quiet_pydicom, raw_value, read_dataset

FEWEST_SLICES = 10
"""Of a CT; localizers have one to three."""

_DEEPEST = 4
"""Folders below the patient's."""

_MOST_FILES = 20_000
_TAGS = [
    "Modality", "SeriesInstanceUID", "StudyInstanceUID", "StudyDate", "StudyTime", "SeriesDate", "SeriesTime",
    "SeriesNumber", "PixelSpacing", "ReferencedFrameOfReferenceSequence", "PatientID",
]  # fmt: skip


@dataclass
class DicomScan:
    """One CT series of a patient.

    Attributes
    ----------
    folder
        That holds its slices.
    uid, study
        Of the series and its study.
    when
        Date and time as DICOM writes them, sortable; either is empty when it is absent.
    slices
        How many files it has.
    folders
        All that hold some of them.
    structure_set
        The RTSTRUCT drawn on it, or None.
    number
        SeriesNumber, as its first file has it; empty without one.
    pixel_mm
        Pitch of its pixels, inf where it is unknown.
    warnings
        That it was chosen among others.

    """

    folder: Path
    uid: str
    study: str
    when: tuple[str, str]
    slices: int = 0
    structure_set: Path | None = None
    folders: set[Path] = field(default_factory=set)
    number: str = ""
    pixel_mm: float = math.inf
    warnings: tuple[str, ...] = ()


@dataclass
class _StructureSet:
    path: Path
    study: str
    series: set[str] = field(default_factory=set)


def dicom_scans(patient: Path, root: Path) -> list[DicomScan]:
    """A patient's CTs from the earliest to the latest, one a study.

    Of several series in one study the one that structures were drawn on is taken, else the one with most slices, with
    the smallest pixels, and the lowest number; a warning says which.

    Raises
    ------
    InputError
        Links out of the root, too many files, files of two patients, a CT in several folders, or CTs whose order no
        date tells; not when there are none.

    """
    scans: dict[str, DicomScan] = {}
    drawn: list[_StructureSet] = []
    patients: set[str] = set()
    with quiet_pydicom():
        for path in _files(patient, root, _DEEPEST):
            header = _header(path)
            modality = _text(header, "Modality").upper()
            if modality in ("CT", "RTSTRUCT"):
                patients.add(_text(header, "PatientID"))
            if modality == "CT":
                uid = _text(header, "SeriesInstanceUID")
                scan = scans.setdefault(uid, _new_scan(path.parent, uid, header))
                scan.slices += 1
                scan.folders.add(path.parent)
            elif modality == "RTSTRUCT":
                drawn.append(_StructureSet(path, _text(header, "StudyInstanceUID"), _drawn_on(header)))
    _require_one_patient(patients, patient)
    whole = [scan for scan in scans.values() if scan.slices >= FEWEST_SLICES]
    _give_structures(whole, drawn)
    studies: dict[str, list[DicomScan]] = {}
    for scan in whole:
        studies.setdefault(scan.study or scan.uid, []).append(scan)
    chosen = [_chosen(group) for group in studies.values()]
    for scan in chosen:
        if len(scan.folders) > 1:  # a part of its slices would make a shorter CT, which nobody would notice
            raise InputError(
                f"{patient}: the slices of one CT lie in {len(scan.folders)} folders, {scan.folder} the first of them: "
                "move them into one folder, each slice once."
            )
    chosen.sort(key=lambda scan: scan.when)
    if not all(_is_before(first.when, second.when) for first, second in pairwise(chosen)):
        raise InputError(
            f"{patient}: no dates tell which of its {len(chosen)} CTs is the earliest: save them as ct_1.nii.gz, "
            "ct_2.nii.gz, ... in this folder."
        )
    return chosen


def _new_scan(folder: Path, uid: str, header: Any) -> DicomScan:
    """A series of which one file is known."""
    scan = DicomScan(folder, uid, _text(header, "StudyInstanceUID"), _when(header))
    scan.number = _text(header, "SeriesNumber")
    try:
        spacing = max(float(each) for each in header.get("PixelSpacing") or ())
    except (TypeError, ValueError):
        return scan
    if math.isfinite(spacing) and spacing > 0:
        scan.pixel_mm = spacing
    return scan


def _chosen(series: list[DicomScan]) -> DicomScan:
    """One of a study's whole series, with a warning where there are others."""
    first = min(series, key=_rank)
    if len(series) > 1:
        called = (
            f"series {first.number}"
            if first.number.isalnum() and len(first.number) < 13
            else "a series without a number"
        )
        first.warnings = (
            f"{first.folder}: {called} was taken, one of {len(series)} whole CT series of its study: to take another "
            "one, save it as ct_1.nii.gz or ct_2.nii.gz, or move this one out of the patient's folder.",
        )
    return first


def _rank(scan: DicomScan) -> tuple:
    """Smaller for the better of two series: the same one whatever their order and the folders' names."""
    return (
        scan.structure_set is None,
        -scan.slices,
        scan.pixel_mm,  # the narrower field of view is the sharper one, and scanners widen it beyond what they measure
        _in_numeric_order(scan.number),
        _in_numeric_order(scan.uid),
    )


def _in_numeric_order(text: str) -> tuple[tuple[int, str], ...]:
    """Numbers with points between them, so that 1.2.9 comes before 1.2.10."""
    return tuple((len(part), part) for part in text.split("."))


def _require_one_patient(identifiers: set[str], folder: Path) -> None:
    """Raise InputError for files of two patients in a subject's folder; what was anonymised tells no patient."""
    count = len(identifiers - {""})
    if count > 1:  # which they are is not said: tables and logs are published
        raise InputError(
            f"{folder}: its DICOM files are of {count} patients by their PatientID: give each patient a folder of its "
            "own, and the folder that holds these."
        )


def _when(header: Any) -> tuple[str, str]:
    """Date and time of a study, or of a series where its study has no date; ("", "") without a date.

    A time alone tells no order: the later scan may have been taken earlier in the day.
    """
    for level in ("Study", "Series"):
        if date := _text(header, f"{level}Date"):
            return date, _text(header, f"{level}Time")
    return "", ""


def _is_before(first: tuple[str, str], second: tuple[str, str]) -> bool:
    """Whether two dates with times tell that one scan is the earlier: on one day both need a time."""
    return bool(first[0]) and first < second and (first[0] != second[0] or bool(first[1]))


def _files(folder: Path, root: Path, deepest: int) -> Iterator[Path]:
    """All DICOM files in a folder and below, none of them outside of the root; raises InputError."""
    count = 0
    waiting = [(folder, 0)]
    while waiting:
        place, depth = waiting.pop()
        for name in entries(place):
            path = place / name
            if path.is_symlink():
                inside(path, root)
            if path.is_dir():
                if depth < deepest:
                    waiting.append((path, depth + 1))
                continue
            count += 1
            if count > _MOST_FILES:
                raise InputError(
                    f"{folder}: it holds more than {_MOST_FILES} files: give one folder a patient."
                )
            if path.is_file() and _is_dicom(path):
                yield path


def _is_dicom(path: Path) -> bool:
    """Whether a file begins as DICOM does; one that cannot be read is left to whoever needs it."""
    try:
        return looks_like_dicom(path)
    except OSError:
        return False


def _header(path: Path) -> Any:
    """Some attributes of a file; empty for one that cannot be read, which its series' reader will name."""
    try:
        return read_dataset(path, stop_before_pixels=True, specific_tags=_TAGS, force=True)
    except Exception:  # pydicom raises nearly every kind for values that are none
        return {}


def _text(header: Any, keyword: str) -> str:
    """A value as text, empty where there is none."""
    try:
        return str(raw_value(keyword, header) or "").strip()
    except Exception:
        return ""


def _drawn_on(header: Any) -> set[str]:
    """The series that a structure set refers to."""
    found = set()
    try:
        for frame in header.get("ReferencedFrameOfReferenceSequence") or []:
            for study in frame.get("RTReferencedStudySequence") or []:
                for series in study.get("RTReferencedSeriesSequence") or []:
                    found.add(str(series.SeriesInstanceUID))
    except Exception:  # a damaged item refers to nothing
        return found
    return found


def _give_structures(scans: list[DicomScan], drawn: list[_StructureSet]) -> None:
    """Put every structure set to the CT that it refers to, else to that of its study; the first in name's order."""
    for each in sorted(drawn, key=lambda one: one.path):
        for scan in scans:
            if scan.uid in each.series or (not each.series and scan.study == each.study):
                scan.structure_set = scan.structure_set or each.path
