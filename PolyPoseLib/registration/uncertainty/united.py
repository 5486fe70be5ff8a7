"""Structures that unite bones which moved against each other, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from PolyPoseLib.errors import listed
from PolyPoseLib.registration.bones.agreement import Agreement, PartAgreement


@dataclass(frozen=True)
class UnitedBones:
    """What the X-rays say of bones that were united in one of K structures.

    Attributes
    ----------
    names : sequence of str
        Of the structures.
    agreement : Agreement
        Of the structures with the X-rays, with their parts.
    resting : int or None
        Index of the structure whose pose is that of the CT, if any.
    magnification : float
        How many times the scene is larger than the patient.
    label_names : mapping of int to str
        Of the segmentation's labels, as far as they are known.

    """

    names: Sequence[str]
    agreement: Agreement
    resting: int | None = None
    magnification: float = 1.0
    label_names: Mapping[int, str] = field(default_factory=dict)

    def warning(self, k: int, when: str = "") -> str:
        """A sentence about a structure of which bones are off; when: the last words of what the X-rays show."""
        return (
            f'"{self.names[k]}" seems to unite bones that moved against each other: {self.clause(k)}{when}. Give '
            "each bone a structure of its own."
        )

    def clause(self, k: int) -> str:
        """Which bones of a structure are not where its pose puts them."""
        off = self.agreement.parts_off(k)
        elsewhere = [part for part in off if part.shows_elsewhere]
        nowhere = [part for part in off if not part.shows_elsewhere]
        there = "where the CT has {}" if k == self.resting else "where the structure's pose puts {}"
        clauses = []
        if elsewhere:
            which, them = self._called(k, elsewhere)
            least = in_mm(min(part.shift_mm for part in elsewhere) / self.magnification)
            clauses.append(f"the X-rays show {which} {least} or more from {there.format(them)}")
        if nowhere:
            which, them = self._called(k, nowhere)
            clauses.append(f"no X-ray shows {which} {there.format(them)}")
        return ", and ".join(clauses)

    def _called(self, k: int, parts: Sequence[PartAgreement]) -> tuple[str, str]:
        """What some parts of a structure are called, and the pronoun for them."""
        labels = sorted({part.label for part in parts if part.label is not None})
        them = "it" if len(labels or parts) == 1 else "them"
        if not labels:
            total = len(self.agreement.parts[k])
            some = f"{'one' if len(parts) == 1 else len(parts)} of its {total} separate parts"
            return "its largest part" if total == 1 else some, them
        names = self.label_names
        return listed([f'"{names[n]}"' if n in names else f"label {n}" for n in labels]), them


def in_mm(length: float) -> str:
    """A length with its unit: of small anatomy to two digits."""
    return f"{length:.0f} mm" if length >= 10 else f"{length:.2g} mm"
