"""Labels of a scan with their names, and those of two scans numbered alike."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.label_names import label_table, structure_of
from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box
from PolyPoseLib.io.segmentations import read_segmentation

TABLE = "totalsegmentator_v2"
"""Whose numbers a plain label map has, unless the data set says otherwise."""

_OLDER_TABLE = "totalsegmentator_v1"
_ODD_BONES = (
    (("scapula_", "clavicula_"), ("rib_",), "shoulders without a rib"),
    (("hip_", "gluteus_"), ("sacrum",), "hips without a sacrum"),
    (("rib_left_",), ("rib_right_",), "left ribs without right ones"),
    (("vertebrae_C1",), ("skull", "brain"), "the first vertebra without a skull"),
)
"""(some of these, none of those): no whole scan has that, but release 1's numbers read as release 2's do."""

_SAME_ORGAN = {
    "brain_stem": "brainstem",
    "cord": "spinal_cord",
    "spinalcord": "spinal_cord",
    "oesophagus": "esophagus",
    "thyroid": "thyroid_gland",
    "parotid_l": "parotid_gland_left",
    "parotid_r": "parotid_gland_right",
    "parotid_left": "parotid_gland_left",
    "parotid_right": "parotid_gland_right",
    "lt_parotid": "parotid_gland_left",
    "rt_parotid": "parotid_gland_right",
    "left_parotid": "parotid_gland_left",
    "right_parotid": "parotid_gland_right",
}
"""Names of structure sets, which every clinic chooses, and what they are called here."""


@dataclass(frozen=True, eq=False)
class NamedLabels:
    """A label map on its scan's grid.

    Attributes
    ----------
    volume
        Whole numbers, 0 is background.
    names
        {number: name} of those that occur.
    warnings
        What was odd but not wrong.

    """

    volume: Volume
    names: Mapping[int, str]
    warnings: tuple[str, ...] = ()


def read_named_labels(path: Path, ct: Volume, names: Mapping[int, str] | None = None) -> NamedLabels:
    """Read a scan's labels onto its grid.

    Parameters
    ----------
    path
        A label map, a folder of masks, a DICOM SEG or an RTSTRUCT.
    ct
        The scan.
    names
        Of a plain map's numbers; those of TotalSegmentator's release 2 by default, with a warning where they are
        odd and may be of release 1.

    Raises
    ------
    InputError
        As `read_segmentation`; labels that lie outside of the scan; overlapping layers; no label with a name.

    """
    segmentation = read_segmentation(path, ct)
    if segmentation.has_layers:
        raise InputError(f"{path}: its segments overlap in layers: export them as one label map.")
    labels, warnings = on_scan_grid(segmentation.layers[0], ct, path)
    known = _names(segmentation, names)
    present = np.unique(labels.voxels)
    found = {int(number): known[int(number)] for number in present if int(number) in known}
    if not found:
        raise InputError(
            f"{path}: it holds labels {', '.join(map(str, present[present > 0][:10])) or '(none)'}, none of which has "
            f"a known name: give a label map of {TABLE}, or a segmentation with names."
        )
    plain = not segmentation.segments and not names
    older = _perhaps_older(found, int(present.max()), path) if plain else ()
    return NamedLabels(labels, found, (*segmentation.warnings, *warnings, *older))


def matched(first: NamedLabels, second: NamedLabels) -> NamedLabels:
    """The second scan's labels with the numbers that the first has for the same names; others become background.

    A name that the first scan has under several numbers takes the lowest.
    """
    numbers: dict[str, int] = {}
    for number, name in sorted(first.names.items()):
        numbers.setdefault(name, number)
    table = np.zeros(int(second.volume.voxels.max(initial=0)) + 1, dtype=np.int32)
    names = {}
    for number, name in second.names.items():
        if name in numbers:
            table[number] = numbers[name]
            names[numbers[name]] = name
    return NamedLabels(second.volume.with_voxels(table[second.volume.voxels]), names, second.warnings)


def standard_name(name: str) -> str:
    """A segment's name with small letters and underscores, as TotalSegmentator would write it."""
    plain = re.sub(r"[^a-z0-9]+", "_", name.strip().lower()).strip("_")
    vertebra = re.fullmatch(r"(?:vertebrae?_)?([ctls])_?(\d{1,2})(?:_vertebrae?)?", plain, re.ASCII)
    if vertebra:
        return f"vertebrae_{vertebra[1].upper()}{int(vertebra[2])}"
    return _SAME_ORGAN.get(plain, plain)


def is_bone(name: str) -> bool:
    """Whether a label's name is a bone's."""
    return structure_of(name) is not None


def _perhaps_older(found: Mapping[int, str], largest: int, path: Path) -> tuple[str, ...]:
    """A warning about a plain map whose numbers fit release 1, and give odd bodies by release 2."""
    if largest > max(label_table(_OLDER_TABLE)):
        return ()
    for some, none, odd in _ODD_BONES:
        if _any_begins(found, some) and not _any_begins(found, none):
            return (
                f"{path.name}: read as {TABLE}, its numbers give {odd}: if TotalSegmentator's release 1 made it, all "
                "names are wrong; segment again by release 2, or give a folder with one named mask a structure.",
            )
    return ()


def _any_begins(found: Mapping[int, str], beginnings: tuple[str, ...]) -> bool:
    """Whether a name begins like one of these."""
    return any(name.startswith(beginnings) for name in found.values())


def _names(segmentation: Segmentation, names: Mapping[int, str] | None) -> dict[int, str]:
    """{number: name} of a segmentation's one layer."""
    if segmentation.segments:
        return {each.label: standard_name(each.name) for each in segmentation.segments}
    return dict(names) if names else label_table(TABLE)


def on_scan_grid(labels: Volume, ct: Volume, path: Path) -> tuple[Volume, tuple[str, ...]]:
    """Labels on the scan's grid, and a warning where they had another; raises InputError where some would be lost."""
    if labels.same_grid(ct):
        return Volume(labels.voxels, ct.affine), ()
    box = bounding_box(labels.voxels)
    if box is None:
        raise InputError(f"{path}: the label map is empty: segment the scan again.")
    ends = np.array([[side.start, side.stop - 1] for side in reversed(box)], dtype=float)
    corners = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(8, 3)
    index = ct.to_index(labels.to_world(corners))
    farthest = np.array(ct.shape[::-1]) - 0.5
    slack = float(labels.spacing.max()) / ct.spacing + 1e-3
    if (index < -0.5 - slack).any() or (index > farthest + slack).any():
        raise InputError(
            f"{path}: its labels are on another grid and reach beyond the scan ({ct.shape[::-1]} voxels): give the "
            "labels of this scan, on its own grid."
        )
    return resample_labels_onto(labels, ct), (
        f"{path.name} is on another grid than its scan; it was resampled by nearest neighbour.",
    )
