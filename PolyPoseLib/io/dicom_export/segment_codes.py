"""What a segment is, in SNOMED CT, from its name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from PolyPoseLib.data.label_names import structure_of

Coded = tuple[str, str, str]
"""Value, scheme and meaning of a code."""

ANATOMY: Coded = ("123037004", "SCT", "Anatomical Structure")
BONE: Coded = ("272673000", "SCT", "Bone")
TISSUE: Coded = ("85756007", "SCT", "Tissue")
SIDES: dict[str, Coded] = {"left": ("7771000", "SCT", "Left"), "right": ("24028007", "SCT", "Right")}

_CONTEXT_GROUPS = {4, 4031, 7151, 7192}
"""Of DICOM's lists of anatomy and segmented structures (PS3.16)."""

_VERTEBRA = re.compile(r"^vertebrae? ([ctl]\d{1,2})$")
_RIB = re.compile(r"^rib \d+$|^\w+ rib$")


@dataclass(frozen=True)
class SegmentCode:
    """What a segment is: a code, and its side where it has one."""

    kind: Coded
    side: Coded | None = None


def segment_code(name: str, is_bone: bool) -> SegmentCode:
    """The code of DICOM's own lists whose meaning is the name; otherwise bone, or tissue.

    Parameters
    ----------
    name
        Of the segment, such as femur_left.
    is_bone
        Whether it belongs to a structure of the study.

    """
    words = re.sub(r"[\s_-]+", " ", name.strip().lower())
    sides = [side for side in SIDES if re.search(rf"\b{side}\b", words)]
    bare = " ".join(each for each in words.split() if each not in SIDES)
    bare = _RIB.sub("rib", _VERTEBRA.sub(r"\1 vertebra", bare))
    known = _meanings().get(bare)
    general = BONE if is_bone or structure_of(name) is not None else TISSUE
    return SegmentCode(known or general, SIDES[sides[0]] if len(sides) == 1 else None)


@lru_cache(maxsize=1)
def _meanings() -> dict[str, Coded]:
    """Codes by their meaning in lower case."""
    from pydicom.sr._concepts_dict import concepts

    return {
        meaning.lower(): (value, "SCT", meaning)
        for by_value in concepts["SCT"].values()
        for value, (meaning, groups) in by_value.items()
        if not _CONTEXT_GROUPS.isdisjoint(groups)
    }
