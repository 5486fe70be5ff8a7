"""How large the numbers of a simulation may be: beyond it memory runs out, or nothing of the CT is left in view."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.data.xray import DISTANCE_RANGE_MM
from PolyPoseLib.errors import InputError, shown, unknown_name

VIEWS = (1, 500)
"""X-rays of one case."""

PIXELS = (1, 4096)
"""Rows and columns of one X-ray."""

MOST_PIXELS = 1 << 27
"""Of all X-rays together: each takes eight bytes while a case is made."""

OPTIONS: dict[str, tuple[float, float]] = {
    "node_mm": (0.5, 100.0),
    "pad_mm": (0.0, 200.0),
    "slide_mm": (0.0, 100.0),
    "motion_scale": (0.0, 100.0),
    "rotation_deg": (0.0, 180.0),
    "translation_mm": (0.0, 1000.0),
}
"""Least and largest values of the simulation's options."""

DRAWN = "drawn"
"""The motion in which every bone turns about its joint at random."""


@dataclass(frozen=True)
class Amplitude:
    """How far a named motion goes.

    Attributes
    ----------
    unit, meaning : str
        What the number says.
    usual : float
        When none is given.
    largest : float
        The least is 0, which is rest.

    """

    unit: str
    meaning: str
    usual: float
    largest: float


AMPLITUDES = {
    "breathing": Amplitude("mm", "by which the right half of the diaphragm descends", 20.0, 60.0),
    "gait": Amplitude("degrees", "of flexion of the leading hip", 30.0, 60.0),
    "flexion": Amplitude("degrees", "at the hips, else the knees, else the elbows", 45.0, 120.0),
    "jaw": Amplitude("degrees", "by which the mouth opens", 15.0, 40.0),
}
"""Named motions."""

ARC_DEG = (-360.0, 360.0)


def require_in_range(value: float, limits: tuple[float, float], name: str, kind: str = "number") -> None:
    """Raise InputError, with the name at the start of its sentence, unless a value is within the limits; NaN is not."""
    least, largest = limits
    if not least <= value <= largest:
        raise InputError(f"{name} is {shown(value)}: give a {kind} from {least:g} to {largest:g}.")


def require_motion(
    motion: str, amplitude: float | None, names: tuple[str, str] = ("motion", "amplitude")
) -> None:
    """Raise InputError unless a motion is drawn or named, and its amplitude within limits; names: of the two."""
    if motion not in (DRAWN, *AMPLITUDES):
        raise InputError(unknown_name("motion", motion, (DRAWN, *AMPLITUDES)))
    if amplitude is None:
        return
    if motion == DRAWN:
        raise InputError(f"{names[1]} is that of a named motion: give {names[0]} as well, or leave it out.")
    limits = AMPLITUDES[motion]
    require_in_range(amplitude, (0.0, limits.largest), names[1], f"number of {limits.unit}")


def require_few_pixels(views: int, pixels: int, names: tuple[str, str] = ("views", "pixels")) -> None:
    """Raise InputError unless so many square X-rays of so many rows can be made; names: of the two numbers."""
    require_in_range(views, VIEWS, names[0], "whole number")
    require_in_range(pixels, PIXELS, names[1], "whole number")
    if views * pixels**2 > MOST_PIXELS:
        raise InputError(
            f"{names[0]} is {views} and {names[1]} {pixels}, together more than {MOST_PIXELS // 10**6} million pixels: "
            "give fewer views or smaller ones."
        )


def require_distances(to_detector: float, to_isocenter: float, names: tuple[str, str]) -> None:
    """Raise InputError unless distances in mm from the source fit each other; names: of the two numbers."""
    require_in_range(to_detector, DISTANCE_RANGE_MM, names[0])
    if not 0 < to_isocenter < to_detector:
        raise InputError(
            f"{names[1]} is {shown(to_isocenter)}: give a number above 0 and below {names[0]} "
            f"({to_detector:g})."
        )
