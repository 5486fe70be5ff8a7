"""Head&Neck: the CTs of one patient before, during and after radiotherapy, by DICOM or NIfTI.

The earliest is registered to X-rays that are rendered from the latest.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.bodies import anchor_of, bones_of, organs_of
from PolyPoseLib.io.benchmark.dicom_patient import dicom_scans
from PolyPoseLib.io.benchmark.named_labels import NamedLabels, is_bone, matched, read_named_labels
from PolyPoseLib.io.benchmark.places import (
    entries,
    files_below,
    folders,
    image_named,
    inside,
    named_subject,
    require_root,
    subject_name,
)
from PolyPoseLib.io.benchmark.two_scans import TwoScans, render_cases
from PolyPoseLib.io.benchmark.view_sets import view_sets
from PolyPoseLib.io.volumes import read_ct_with_warnings

DATASET = "headneck"
ORGANS = ("brain", "spinal_cord", "thyroid_gland", "trachea", "esophagus")
"""TotalSegmentator's of the region; a structure set's, where it draws them."""

ANCHORS = ("skull", "vertebra_C4", "vertebra_C5")
"""The skull is whole in these scans and has the most to align by."""

WHERE = (
    "the folder of HNSCC-3DCT-RT, which The Cancer Imaging Archive gives away (doi.org/10.7937/K9/TCIA.2018.13upr2xf), "
    "with one folder a patient"
)

_OWN_NAME = r"HN_P\d{3}"
"""The archive's for a patient's folder."""

_KNOWN = rf"{_OWN_NAME}|(?:patient|subject|case)[-_]?\d{{1,4}}"
_DEEPEST_COLLECTION = 3
"""Folders below the one that was given in which the archive's own may lie: manifest-.../HNSCC-3DCT-RT has two."""

_MOST_SCANS = 99
_SEGMENT = (
    "segment every CT by TotalSegmentator (task total, --ml) and save the label maps as labels_1.nii.gz, "
    "labels_2.nii.gz, ... in the order of the CTs"
)


@dataclass(frozen=True)
class _Scan:
    """Where one CT and its labels lie, and what was odd about finding them."""

    ct: Path
    series: str | None
    labels: Path | None
    number: int
    warnings: tuple[str, ...] = ()


def subjects(root: Path) -> list[str]:
    """The patients' names, or hashes of them; raises InputError for a folder that is no copy of the data."""
    return list(_patients(require_root(root, WHERE)))


def cases(root: Path, subject: str, views: Sequence[str]) -> Iterator[BenchmarkCase]:
    """One case for every set of views of a patient; raises InputError."""
    sets = view_sets(views, DATASET)
    root = require_root(root, WHERE)
    folder = named_subject(_patients(root), subject, str(root))
    yield from render_cases(_read(folder, root, subject), sets)


def files(root: Path, subject: str) -> list[Path]:
    """Those in a patient's folder; raises InputError."""
    root = require_root(root, WHERE)
    return list(files_below(named_subject(_patients(root), subject, str(root)), root))


def _patients(root: Path) -> dict[str, Path]:
    """{name: folder}, sorted; raises InputError when there is none, or patients lie deeper."""
    places = folders(root)
    _refuse_collections_in([each for each in places if not re.fullmatch(_KNOWN, each.name, re.ASCII)], root)
    found = {subject_name(each, _KNOWN): each for each in places if _may_be_patient(each)}
    if not found:
        raise InputError(
            f"{root}: none of its folders holds a CT (ct_1.nii.gz, ..., or folders of DICOM): give {WHERE}."
        )
    return dict(sorted(found.items()))


def _refuse_collections_in(places: list[Path], root: Path) -> None:
    """Raise InputError where a folder that would be taken for a patient's holds the archive's own patients."""
    for _ in range(_DEEPEST_COLLECTION):
        deeper: list[Path] = []
        for place in places:
            within = _real_folders(place)
            if any(re.fullmatch(_OWN_NAME, each.name, re.ASCII) for each in within):
                raise InputError(
                    f"{root}: the patients' folders (HN_P001, ...) lie in {place.relative_to(root)}, deeper than they "
                    f"should: give {place}."
                )
            deeper += within
        places = deeper


def _real_folders(place: Path) -> list[Path]:
    """The folders in a folder, links left out; none of one that cannot be listed, which its reader will name."""
    try:
        with os.scandir(place) as found:
            return sorted(Path(each.path) for each in found if each.is_dir(follow_symlinks=False))
    except OSError:
        return []


def _may_be_patient(folder: Path) -> bool:
    """Whether a folder has CTs by their names, or folders and files in which DICOM may lie."""
    names = entries(folder)
    return (
        bool(_numbered(folder))
        or any(name.lower().endswith(".dcm") for name in names)
        or any(not name.startswith("labels_") and (folder / name).is_dir() for name in names)
    )


def _read(folder: Path, root: Path, subject: str) -> TwoScans:
    """Both scans of a patient with their labels; raises InputError."""
    found = _scans(folder, root)
    if len(found) < 2:
        raise InputError(
            f"{folder}: it holds {len(found) or 'no'} CT{'' if len(found) == 1 else 's'}, and two of different days "
            f"are needed: copy the whole patient, of {WHERE}."
        )
    (first, first_labels, odd), (second, second_labels, odd_later) = (
        _read_scan(each, root) for each in (found[0], found[-1])
    )
    second_labels = matched(first_labels, second_labels)
    bones = bones_of(first_labels.names)
    if not any(map(is_bone, first_labels.names.values())):
        raise InputError(f"{folder}: the first CT's labels name no bone: {_SEGMENT}.")
    anchor = anchor_of(bones, bones_of(second_labels.names), ANCHORS, folder)
    return TwoScans(
        dataset=DATASET,
        subject=subject,
        moving=first,
        fixed=second,
        moving_labels=first_labels.volume,
        fixed_labels=second_labels.volume,
        structures=bones,
        organs=organs_of(first_labels.names, (*ORGANS, *_drawn_organs(first_labels))),
        anchor=anchor,
        warnings=(
            *_without_first(found[0]),
            *odd,
            *first_labels.warnings,
            *(f"later scan: {each}" for each in odd_later),
        ),
    )


def _without_first(earliest: _Scan) -> tuple[str, ...]:
    """What to say of a patient whose first CT was not copied."""
    taken = f"there is no ct_1, so that ct_{earliest.number} is taken as the earliest CT: copy it if there is one."
    return (taken,) if earliest.number > 1 else ()


def _drawn_organs(labels: NamedLabels) -> tuple[str, ...]:
    """Organs that only structure sets draw."""
    drawn = ("brainstem", "parotid_gland_left", "parotid_gland_right")
    return tuple(name for name in drawn if name in labels.names.values())


def _numbered(folder: Path) -> list[_Scan]:
    """CTs by their names; one may be missing, and the lowest number is the earliest, the highest the latest."""
    return [
        _Scan(ct, None, image_named(folder, f"labels_{number}"), number)
        for number in range(1, _MOST_SCANS + 1)
        if (ct := image_named(folder, f"ct_{number}")) is not None
    ]


def _scans(folder: Path, root: Path) -> list[_Scan]:
    """A patient's CTs, earliest first, with their labels; raises InputError."""
    if numbered := _numbered(folder):
        return numbered
    return [
        _Scan(
            scan.folder,
            scan.uid,
            image_named(folder, f"labels_{number}") or scan.structure_set,
            number,
            scan.warnings,
        )
        for number, scan in enumerate(dicom_scans(folder, root), start=1)
    ]


def _read_scan(scan: _Scan, root: Path) -> tuple[Volume, NamedLabels, tuple[str, ...]]:
    """A CT, its labels and what is odd about it; raises InputError."""
    if scan.labels is None:
        drawn = "" if scan.series is None else ", nor is there a structure set drawn on it that can be read"
        raise InputError(
            f"{scan.ct}: the CT has no labels (there is no labels_{scan.number}.nii.gz{drawn}): {_SEGMENT}."
        )
    ct, odd = read_ct_with_warnings(inside(scan.ct, root), scan.series)
    labels = read_named_labels(inside(scan.labels, root), ct)
    return ct, labels, (*scan.warnings, *odd)
