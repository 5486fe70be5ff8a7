"""Views of the data sets whose X-rays are rendered: "2x30" is two views over an arc of 30 degrees."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from PolyPoseLib.errors import InputError, shown

PAPER_VIEWS = ("2x180", "3x180", "4x180", "5x180", "6x180", "7x180", "8x180", "9x180", "2x30")
"""Sparse views, two to nine over half a turn, and a limited angle, as in the paper."""

HELD_OUT_DEGREES = (10.0, 56.0, 85.0, 124.0, 170.0)
"""The same for all sets, so that scores against the number of views are of one and the same pictures. Each lies 4
degrees or more from every view of the paper's sets."""

_NEAREST_DEGREES = 2.0
"""A held-out view nearer than this to a given one, or to its opposite, would be no test."""

_MOST_VIEWS = 60
_SET = re.compile(r"([0-9]{1,3})x([0-9]{1,3}(?:\.[0-9]{1,3})?)", re.ASCII)


@dataclass(frozen=True)
class ViewSet:
    """Views spread evenly over an arc about the cranio-caudal axis, starting antero-posterior.

    Attributes
    ----------
    name
        "2x30".
    angles_deg
        0 has the source in front; positive takes it to the patient's left. A half or whole turn leaves out its end,
        which shows the first view's mirror image or the first view again: 2x180 is 0 and 90, 2x30 is 0 and 30.

    """

    name: str
    angles_deg: tuple[float, ...]

    @property
    def held_out_deg(self) -> tuple[float, ...]:
        """Angles of the views that are kept for scores."""
        return tuple(
            angle
            for angle in HELD_OUT_DEGREES
            if all(_apart(angle, given) >= _NEAREST_DEGREES for given in self.angles_deg)
        )


def view_sets(names: Sequence[str], where: str) -> list[ViewSet]:
    """The sets that names like "2x30" stand for, PAPER_VIEWS for none; raises InputError that opens with `where`."""
    return [_view_set(name, where) for name in names or PAPER_VIEWS]


def view_name(name: str, where: str) -> str:
    """The one spelling of a set's name, "2x30" of "02x30.0"; raises InputError that opens with `where`."""
    return _view_set(name, where).name


def _view_set(name: str, where: str) -> ViewSet:
    """One set; raises InputError."""
    match = _SET.fullmatch(name) if isinstance(name, str) else None
    count, arc = (int(match[1]), float(match[2])) if match else (0, 0.0)
    if match is None or not 1 <= count <= _MOST_VIEWS or not (0 < arc <= 360 or (count == 1 and arc == 0)):
        raise InputError(
            f"{where}: the views {shown(name)} are none: give a number of views from 1 to {_MOST_VIEWS} and an arc of "
            'up to 360 degrees, such as "2x30".'
        )
    closed = arc in (180.0, 360.0)
    gaps = count if closed else max(count - 1, 1)
    return ViewSet(f"{count}x{arc:g}", tuple(arc * number / gaps for number in range(count)))


def _apart(first: float, second: float) -> float:
    """Degrees between two views that are 0 when one shows the other's mirror image, too."""
    difference = abs(first - second) % 180.0
    return min(difference, 180.0 - difference)
