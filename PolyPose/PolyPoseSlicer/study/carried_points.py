"""Points of markups carried by the scene's result, with what moved each and how far it may be off."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.data.carried import DISPLACEMENT_FIELD, CarriedPoints

if TYPE_CHECKING:
    from PolyPoseLib.carrying.points import PointCarrier


@dataclass(frozen=True)
class PointSet:
    """points: (N, 3) LPS mm in the CT. rigid: whether they are the ends of one straight line, such as a screw."""

    points: np.ndarray
    rigid: bool = False

    @property
    def key(self) -> tuple[bytes, bool]:
        """Equal for equal points."""
        return self.points.tobytes(), self.rigid


def carry_sets(carrier: PointCarrier, sets: Mapping[str, PointSet]) -> dict[str, CarriedPoints]:
    """The sets in the patient as X-rayed, by the same names."""
    from PolyPoseLib.carrying.lines import carry_with_lines

    return {
        name: carry_with_lines(carrier, each.points, [(0, 1)] if each.rigid else [], "xray")
        for name, each in sets.items()
    }


def said_of(sets: Mapping[str, CarriedPoints]) -> str:
    """What moved the points and how far they may be off, for people."""
    movers = Counter(mover for each in sets.values() for mover in each.moved_by)
    soft = movers.pop(DISPLACEMENT_FIELD, 0)
    lines = [
        _("Points moved by the bone in which they lie: {count}.").format(count=sum(movers.values())),
        _("Points moved by the displacement field: {count}.").format(count=soft),
    ]
    outside = sum(int(np.count_nonzero(~each.inside)) for each in sets.values())
    if outside:
        lines.append(
            _("Points outside of the result's grid, which are only roughly right: {count}.").format(
                count=outside
            )
        )
    longest = np.concatenate([np.zeros(0), *(each.semi_axes_mm[:, 2] for each in sets.values())])
    known = longest[np.isfinite(longest)]
    if len(known):
        lines.append(
            _("The longest half axes of the 95 % ellipsoids: {least:.1f} to {most:.1f} mm.").format(
                least=known.min(), most=known.max()
            )
        )
    if len(known) < len(longest):
        lines.append(
            _("Points whose uncertainty is not known: {count}.").format(count=len(longest) - len(known))
        )
    return "\n".join(lines)
