"""ThoraxCBCT of Learn2Reg: a planning CT at inhale, registered to X-rays rendered from a cone-beam CT at exhale."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.bodies import anchor_of, bones_of, organs_of
from PolyPoseLib.io.benchmark.named_labels import NamedLabels, matched, read_named_labels, standard_name
from PolyPoseLib.io.benchmark.places import entries, files_below, inside, named_subject, require_root
from PolyPoseLib.io.benchmark.two_scans import TwoScans, render_cases
from PolyPoseLib.io.benchmark.view_sets import view_sets
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import parse_object
from PolyPoseLib.io.volumes import read_ct_with_warnings

DATASET = "thoraxcbct"
JSON = "ThoraxCBCT_dataset.json"
ORGANS = (
    "liver", "heart", "aorta", "trachea", "esophagus", "lung_upper_lobe_left", "lung_lower_lobe_left",
    "lung_upper_lobe_right", "lung_middle_lobe_right", "lung_lower_lobe_right",
)  # fmt: skip
ANCHORS = ("thoracic_spine", "lumbar_spine", "cervical_spine")
WHERE = f"the folder with {JSON} and imagesTr of Learn2Reg's task ThoraxCBCT (learn2reg.grand-challenge.org)"

_IMAGE = re.compile(r"ThoraxCBCT_(\d{4})_(\d{4})\.nii\.gz", re.ASCII)
_PLANNING = "0000"


def subjects(root: Path) -> list[str]:
    """Such as "0000-1": a patient, and the CBCT at the begin (1) or end (2) of therapy; raises InputError."""
    return list(_pairs(require_root(root, WHERE)))


def cases(root: Path, subject: str, views: Sequence[str]) -> Iterator[BenchmarkCase]:
    """One case for every set of views of a pair of scans; raises InputError."""
    sets = view_sets(views, DATASET)
    root = require_root(root, WHERE)
    pair = named_subject(_pairs(root), subject, str(root))
    yield from render_cases(_read(root, pair.name, subject), sets)


def row_names(subject: str, views: str) -> tuple[str, str]:
    """The patient, of whom "0000-1" and "0000-2" are two cases, and the views."""
    return subject.rpartition("-")[0], views


def files(root: Path, subject: str) -> list[Path]:
    """Both scans of a pair and their labels, and what the data set says of them; raises InputError."""
    root = require_root(root, WHERE)
    later = named_subject(_pairs(root), subject, str(root)).name
    places = [
        root / JSON,
        *(root / each / name for name in _scans(later) for each in ("imagesTr", "labelsTr")),
    ]
    return [path for place in places if place.exists() for path in files_below(place, root)]


def _scans(later: str) -> tuple[str, str]:
    """Names of a planning CT and of the CBCT whose name is given."""
    return _IMAGE.sub(rf"ThoraxCBCT_\1_{_PLANNING}.nii.gz", later), later


def _pairs(root: Path) -> dict[str, Path]:
    """{subject: its CBCT}, as the data set's JSON pairs them, else by the images' names; raises InputError."""
    folder = root / "imagesTr"
    if not folder.is_dir():
        raise InputError(f"{root}: there is no folder imagesTr: give {WHERE}.")
    there = [name for name in entries(inside(folder, root)) if _IMAGE.fullmatch(name)]
    listed = _listed(root)
    wanted = listed or [name for name in there if not name.endswith(f"_{_PLANNING}.nii.gz")]
    pairs = {}
    for name in sorted(set(wanted)):
        match = _IMAGE.fullmatch(name)
        if match is None or match[2] == _PLANNING:
            continue
        planning = f"ThoraxCBCT_{match[1]}_{_PLANNING}.nii.gz"
        for needed in (name, planning):
            if needed not in there:
                raise InputError(
                    f"{folder}: {needed} is missing, so the copy is not whole: unpack it again from {WHERE}."
                )
        pairs[f"{match[1]}-{int(match[2])}"] = folder / name
    if not pairs:
        raise InputError(
            f"{folder}: it holds no pair of images ThoraxCBCT_0000_0000.nii.gz (planning CT) and "
            f"ThoraxCBCT_0000_0001.nii.gz (CBCT): give {WHERE}."
        )
    return pairs


def _listed(root: Path) -> list[str]:
    """Names of the fixed images that the data set's JSON pairs with their planning CT; raises InputError."""
    record = _record(root)
    names = []
    for key in ("training_paired_images", "registration_val"):
        pairs = record.get(key) or []
        if not isinstance(pairs, list):
            raise InputError(f'{root / JSON}: "{key}" is no list of pairs: unpack the data again.')
        for pair in pairs:
            fixed = pair.get("fixed") if isinstance(pair, dict) else None
            if not isinstance(fixed, str):
                raise InputError(
                    f'{root / JSON}: a pair of "{key}" has no "fixed" image: unpack the data again.'
                )
            # Only the name counts: images lie in imagesTr, and a path could lead anywhere.
            names.append(fixed.replace("\\", "/").rsplit("/", 1)[-1])
    return names


def _record(root: Path) -> Mapping:
    """The data set's JSON, empty without one; raises InputError when it is damaged."""
    path = root / JSON
    if not path.exists():
        return {}
    text = read_text(inside(path, root), f"{JSON} of the data set")
    try:
        return parse_object(text, str(path), allow_nan=False)
    except InputError as error:
        raise InputError(
            f"{path}: the data set's description is damaged, unpack it again: {error}"
        ) from error


def _label_names(root: Path) -> dict[int, str]:
    """Names of the labels that the data set's JSON gives; empty where it leaves them out, as in the first releases."""
    labels = _record(root).get("labels") or {}
    if isinstance(labels, dict) and isinstance(labels.get("0"), dict):
        labels = labels["0"]
    if not isinstance(labels, dict):
        return {}
    return {
        int(number): standard_name(name)
        for number, name in labels.items()
        if isinstance(name, str)
        and number.isascii()
        and number.isdigit()
        and 0 < len(number) < 6
        and int(number)
    }


def _read(root: Path, later: str, pair: str) -> TwoScans:
    """Both scans with their labels; raises InputError."""
    names = _label_names(root)
    planning, _ = _scans(later)
    (first, first_labels, odd), (second, second_labels, odd_later) = (
        _read_scan(root, name, names) for name in (planning, later)
    )
    second_labels = matched(first_labels, second_labels)
    bones = bones_of(first_labels.names, fused_spine=True)
    if not bones:
        raise InputError(f"{root / 'labelsTr' / planning}: the labels name no bone: {_SEGMENT}.")
    common = bones_of(second_labels.names, fused_spine=True)
    anchor = anchor_of(bones, common, ANCHORS, root / "labelsTr" / later)
    return TwoScans(
        dataset=DATASET,
        subject=row_names(pair, "")[0],
        moving=first,
        fixed=second,
        moving_labels=first_labels.volume,
        fixed_labels=second_labels.volume,
        structures=bones,
        organs=organs_of(first_labels.names, ORGANS),
        anchor=anchor,
        warnings=(*odd, *first_labels.warnings, *(f"CBCT: {each}" for each in odd_later)),
        pair=pair,
    )


_SEGMENT = (
    "the data set has no labels of bones (the labels 1 to 13 of the release ThoraxCBCT_OncoRegRelease_06_12_23 are no "
    "TotalSegmentator's): move or rename the folder labelsTr of the release if there is one, so that nothing of it is "
    "overwritten, segment every image by TotalSegmentator (task total, --ml), and save the label maps in a new folder "
    "labelsTr under the images' names"
)


def _read_scan(
    root: Path, name: str, names: Mapping[int, str]
) -> tuple[Volume, NamedLabels, tuple[str, ...]]:
    """A scan, its labels and what is odd about it; raises InputError."""
    labels = root / "labelsTr" / name
    if not labels.exists():
        raise InputError(f"{labels}: there is no such file: {_SEGMENT}.")
    ct, odd = read_ct_with_warnings(inside(root / "imagesTr" / name, root))
    return ct, read_named_labels(inside(labels, root), ct, names or None), odd
