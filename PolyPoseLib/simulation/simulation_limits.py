"""How large the numbers of a simulation may be: beyond it memory runs out, or nothing of the CT is left in view."""

from __future__ import annotations

from PolyPoseLib.data.xray import DISTANCE_RANGE_MM
from PolyPoseLib.errors import InputError, shown

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

ARC_DEG = (-360.0, 360.0)


def require_in_range(value: float, limits: tuple[float, float], name: str, kind: str = "number") -> None:
    """Raise InputError, with the name at the start of its sentence, unless a value is within the limits; NaN is not."""
    least, largest = limits
    if not least <= value <= largest:
        raise InputError(f"{name} is {shown(value)}: give a {kind} from {least:g} to {largest:g}.")


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
