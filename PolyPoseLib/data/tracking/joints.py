"""Joints: which bone's motion is reported relative to which, and by what convention."""

from __future__ import annotations

import re
from dataclasses import dataclass

from PolyPoseLib.errors import InputError, unknown_name

CONVENTIONS = (
    "grood_suntay",
    "isb_hip",
    "isb_ankle",
    "isb_spine",
    "isb_shoulder",
    "isb_elbow",
    "isb_wrist",
    "generic",
)
"""How the motion of a joint is described; see :mod:`PolyPoseLib.kinematics.conventions`."""

SIDES = ("left", "right", "none")
"""Of the body; "none" for joints of the midline, such as those of the spine."""

LONGEST_NAME = 100
"""Characters of a joint's name: files are named after it."""


@dataclass(frozen=True)
class Joint:
    """Two bones, one of which is described as it moves relative to the other.

    Parameters
    ----------
    name : str
        Of the joint, in tables and plots.
    proximal : str
        The structure that counts as standing still.
    distal : str
        The structure that moves.
    convention : str
        One of CONVENTIONS.
    side : {"left", "right", "none"}
        Of the body: by it, angles and translations have the same sign on both sides.

    Raises
    ------
    InputError
        An empty or long name, a convention or side that is not known, or one bone twice.

    """

    name: str
    proximal: str
    distal: str
    convention: str = "generic"
    side: str = "none"

    def __post_init__(self) -> None:
        """Check the values; raises InputError."""
        if not self.name.strip() or len(self.name) > LONGEST_NAME:
            raise InputError(f'A joint needs a "name" of 1 to {LONGEST_NAME} characters.')
        if self.convention not in CONVENTIONS:
            raise InputError(
                f'joint "{self.name}": ' + unknown_name("convention", self.convention, CONVENTIONS)
            )
        if self.side not in SIDES:
            raise InputError(f'joint "{self.name}": ' + unknown_name("side", self.side, SIDES))
        if self.proximal == self.distal:
            raise InputError(
                f'joint "{self.name}": "proximal" and "distal" are both "{self.distal}": name two structures.'
            )


def joints_to(reference: str, names: tuple[str, ...]) -> tuple[Joint, ...]:
    """A generic joint between every other structure and the reference, the side taken from the structure's name."""
    return tuple(
        Joint(name, reference, name, "generic", side_of(name)) for name in names if name != reference
    )


def side_of(name: str) -> str:
    """The side that a structure's name says, as "femur_left" does; "none" where it says none, or both."""
    words = set(re.split(r"[^a-z]+", name.lower()))
    left, right = "left" in words, "right" in words
    return "none" if left == right else "left" if left else "right"
