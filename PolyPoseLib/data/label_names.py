"""Names of labels in known tables, and which bones usually move together."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from PolyPoseLib.errors import InputError, unknown_name

TABLES = (
    "totalsegmentator_v1",
    "totalsegmentator_v2",
    "totalsegmentator_v3",
    "totalsegmentator_appendicular_bones",
    "totalsegmentator_vertebrae_body",
    "totalsegmentator_vertebrae_pp",
    "totalsegmentator_teeth",
    "totalsegmentator_craniofacial_structures",
    "totalsegmentator_headneck_bones_vessels",
)
"""Known tables: the task "total" of TotalSegmentator, release 1, releases 2.0 to 2.x, and its v3 model (L6 for S1);
then its other tasks with bones, as of release 2.18."""

DETAILS = ("regions", "bones")
"""How finely bones are proposed: vertebrae by region and ribs by side, or every one by itself."""

Label = TypeVar("Label", int, str)

_VERTEBRA = re.compile(r"^(?:vertebrae?[ _])?([ctls])(\d{1,2})(?:[ _]vertebrae?)?$")
_RIB = re.compile(r"\brib\b")
_ORDINALS = (
    "first", "second", "third", "fourth", "fifth", "sixth",
    "seventh", "eighth", "ninth", "tenth", "eleventh", "twelfth",
)  # fmt: skip
"""How SNOMED CT counts ribs: Fourth rib."""
_JAW = re.compile(r"^(upper|lower) (?:jaw|jawbone|teeth|.*fdi\d+)$|^teeth (upper|lower)$")
_REGION = {"c": "cervical_spine", "t": "thoracic_spine", "l": "lumbar_spine"}
_PELVIS = ("hip", "hip bone", "sacrum", "coccyx", "pelvis", "ilium", "ischium", "pubis")
_SINGLE = {
    "skull": "skull",
    "cranium": "skull",
    "zygomatic arch": "skull",
    "styloid process": "skull",
    "mandible": "mandible",
    "hyoid": "hyoid",
    "hyoid bone": "hyoid",
    "vertebrae body": "spine",
    "sternum": "sternum",
    "femur": "femur",
    "patella": "patella",
    "tibia": "lower_leg",
    "fibula": "lower_leg",
    "humerus": "humerus",
    "radius": "forearm",
    "ulna": "forearm",
    "scapula": "scapula",
    "clavicle": "clavicle",
    "clavicula": "clavicle",
    "carpal": "hand",
    "metacarpal": "hand",
    "phalanges hand": "hand",
    "tarsal": "foot",
    "metatarsal": "foot",
    "phalanges feet": "foot",
}
_MIDLINE = ("skull", "mandible", "hyoid", "sternum", "spine")
_ORDER = [
    "pelvis",
    "femur",
    "lower_leg",
    "patella",
    "foot",
    "lumbar_spine",
    "thoracic_spine",
    "cervical_spine",
    "spine",
    "vertebra",
    "ribs",
    "rib",
    "sternum",
    "scapula",
    "clavicle",
    "humerus",
    "forearm",
    "hand",
    "skull",
    "mandible",
    "hyoid",
]
_ANCHORS = ("pelvis", "thoracic_spine", "lumbar_spine", "skull", "cervical_spine", "spine")


@lru_cache(maxsize=1)
def _tables() -> dict[str, dict[int, str]]:
    """Every known table, {name: {id: label's name}}."""
    stored = json.loads(Path(__file__).with_name("label_tables.json").read_text(encoding="utf-8"))
    return {
        table: {number: name for number, name in enumerate(names, start=1) if name}
        for table, names in stored.items()
    }


def label_table(table: str) -> dict[int, str]:
    """{id: name} of a known table; raises InputError for any other."""
    if table not in TABLES:
        raise InputError(unknown_name("label table", str(table), TABLES))
    return dict(_tables()[table])


def structure_of(name: str, detail: str = "regions") -> str | None:
    """The structure in which a bone usually moves, or None when the name is of no bone.

    Parameters
    ----------
    name
        TotalSegmentator's (hip_left, vertebrae_L5), Slicer's standard name (left hip, L5 vertebra, left rib 4), or
        that of SNOMED CT (Fourth rib).
    detail
        One of `DETAILS`.

    """
    words = name.strip().lower().replace("_", " ").replace("-", " ")
    sides = [side for side in ("left", "right") if re.search(rf"\b{side}\b", words)]
    side = f"_{sides[0]}" if len(sides) == 1 else ""
    bare = " ".join(word for word in words.split() if word not in ("left", "right"))
    vertebra = _VERTEBRA.match(bare)
    if vertebra:
        region, number = vertebra[1], int(vertebra[2])
        if region == "s":
            return "pelvis"
        return _REGION[region] if detail == "regions" else f"vertebra_{region.upper()}{number}"
    if _RIB.search(bare):
        number = _rib_number(bare)
        return f"ribs{side}" if detail == "regions" or not number else f"rib{side}_{number}"
    if bare in _PELVIS:
        return "pelvis"
    jaw = _JAW.match(words)
    if jaw:
        return "mandible" if "lower" in jaw.groups() else "skull"
    found = _SINGLE.get(bare)
    return found if found is None or found in _MIDLINE else found + side


def _rib_number(words: str) -> str:
    """A rib's number, which is a number or an ordinal among its words; empty without one."""
    number = re.search(r"\d+", words)
    if number:
        return number[0]
    return next((str(n) for n, word in enumerate(_ORDINALS, start=1) if word in words.split()), "")


def propose_structures(
    labels: Iterable[Label], table: str | None = None, detail: str = "regions"
) -> dict[str, list[Label]]:
    """Group labels into structures that usually move as one rigid body.

    Parameters
    ----------
    labels
        Numbers of a label map, or names of segments.
    table
        Whose numbers they are; required for numbers.
    detail
        One of `DETAILS`.

    Returns
    -------
    dict
        {structure: labels of the kind given}; labels that are no bones are left out.

    Raises
    ------
    InputError
        An unknown table or detail, and numbers without a table.

    """
    if detail not in DETAILS:
        raise InputError(unknown_name("detail", detail, DETAILS))
    names = label_table(table) if table else {}
    groups: dict[str, list[Label]] = {}
    for label in labels:
        if not isinstance(label, str) and not table:
            raise InputError(
                f"Label {label} is a number, whose meaning depends on the table: choose one of "
                f"{', '.join(TABLES)}."
            )
        name = label if isinstance(label, str) else names.get(int(label), "")
        structure = structure_of(name, detail)
        if structure:
            groups.setdefault(structure, []).append(label if isinstance(label, str) else int(label))
    return dict(sorted(groups.items(), key=lambda group: _rank(group[0])))


def propose_anchor(structures: Sequence[str]) -> str | None:
    """The structure by which cameras are best found: the pelvis, else a region of the spine, else the first."""
    for name in _ANCHORS:
        if name in structures:
            return name
    return structures[0] if structures else None


def _rank(structure: str) -> tuple[int, list[int | str]]:
    """Order of structures in a proposal: by body region, then by name with numbers as numbers."""
    known = [n for n, stem in enumerate(_ORDER) if structure == stem or structure.startswith(stem + "_")]
    parts = [f"{int(part):04d}" if part.isdigit() else part for part in re.split(r"(\d+)", structure)]
    return (known[-1] if known else len(_ORDER), parts)
