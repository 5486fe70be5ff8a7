"""What a report says: headline, facts, motions, intervals and reasons, as texts with their units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from PolyPoseLib.data.result import Result, StructureResult, total_seconds

CAUTION = "Research software, not for clinical decisions."

BEFORE = (
    "Before: every bone where the CT has it, seen through the cameras that were found. What differs between before and "
    "after is therefore the motion of the bones alone."
)
"""The cameras found and not the initial ones: an anchor that fits shows that the camera is right, and the distance
between a bone's two outlines is what it moved."""

SIMILARITY = (
    "Mean local correlation of X-rays and renderings, 1 is perfect. Each panel is one resolution level and has its own "
    "scale: values compare within a panel only. Pixels are weighted anew on the way, so that small falls may occur."
)

INTERVALS = (
    "Motions are from the CT to the X-rays, of the bone's centroid, relative to the anchor. Intervals are 95 %, along "
    "and across the common viewing direction of the X-rays."
)

ONE_DIRECTION_DEG = 20.0
"""Views that are no farther apart than this count as one direction: depth is hardly seen."""


@dataclass(frozen=True)
class Headline:
    """The verdict in one line; tone is "good", "caution" or "bad"."""

    text: str
    tone: str


@dataclass(frozen=True)
class BoneLine:
    """One bone in words.

    Attributes
    ----------
    name : str
        Of the structure.
    still : bool
        Whether it is the anchor, or has no motion.
    cells : tuple of str
        Rotation (degrees), shift to the left, back and head and distance (mm), numbers without their units.
    intervals : tuple of str
        95 %: position along and across the viewing direction (mm), rotation about and across it (degrees).
    motion, interval : str
        The same as sentences.
    doubts : tuple of str
        Reasons not to rely on it.

    """

    name: str
    still: bool
    cells: tuple[str, ...]
    intervals: tuple[str, ...]
    motion: str
    interval: str
    doubts: tuple[str, ...]


CELLS = (
    "rotation (°)", "to the left (mm)", "to the back (mm)", "to the head (mm)", "distance (mm)",
    "± along (mm)", "± across (mm)", "± about (°)", "± tilt (°)",
)  # fmt: skip
"""Headings of a bone's cells and then of its intervals."""

CELLS_MEAN = (
    "± along and ± across: 95 % interval of the position along and across the common viewing direction; ± about and "
    "± tilt: of the rotation about that direction, and about the axes across it. Negative numbers point the other way."
)

UNKNOWN = "-"


def number(value: float, digits: int = 1, signed: bool = False) -> str:
    """A number with so many decimals, never "-0.0"; a dash when it is not finite."""
    if not math.isfinite(value):
        return UNKNOWN
    rounded = round(float(value), digits) + 0.0
    return f"{rounded:+.{digits}f}" if signed and rounded else f"{rounded:.{digits}f}"


def count(items: int, what: str, plural: str | None = None) -> str:
    """A number of things, such as 1 X-ray or 2 X-rays."""
    return f"{items} {what if items == 1 else plural or what + 's'}"


def headline(result: Result) -> Headline:
    """What a person should know first."""
    if not result.trusted:
        return Headline(f"Not to be trusted: {count(len(result.distrust), 'reason')}, see below.", "bad")
    if depth := depth_caution(result):
        return Headline(depth, "caution")
    doubtful = sum(bool(each.doubts) for each in result.structures.values())
    if doubtful:
        verb = "is" if doubtful == 1 else "are"
        bones = count(len(result.structures), "bone")
        return Headline(f"{doubtful} of {bones} {verb} uncertain; the reasons are below.", "caution")
    warnings = f" {count(len(result.warnings), 'warning')}, see below." if result.warnings else ""
    return Headline(f"No sign of failure; check the outlines yourself.{warnings}", "good")


def depth_caution(result: Result) -> str:
    """A sentence about depth that the X-rays do not show; empty where they were taken from several directions."""
    if len(result.cameras) < 2:
        return "One X-ray only: depth along its beam is hardly known, and nothing contradicts a wrong pose."
    if largest_angle_deg(result) < ONE_DIRECTION_DEG:
        return "All X-rays were taken from about one direction: depth along it is hardly known."
    return ""


def cautions(result: Result) -> list[str]:
    """What to check before a result is used: its warnings, and what they do not tell of depth and of single bones."""
    said = [text for text, tone in notes(result) if tone == "caution"]
    return [text for text in (depth_caution(result), *said) if text]


def largest_angle_deg(result: Result) -> float:
    """Largest angle in degrees, 0 to 90, between the lines of sight of two X-rays; 0 of a single one."""
    axes = [each.camera.axis for each in result.cameras]
    cosines = [abs(float(first @ second)) for first, second in combinations(axes, 2)]
    return math.degrees(math.acos(min(min(cosines, default=1.0), 1.0)))


def facts(result: Result) -> str:
    """How the result came about, in one line."""
    views = count(len(result.cameras), "X-ray")
    if len(result.cameras) > 1:
        views += f" up to {largest_angle_deg(result):.0f}° apart"
    parts = [views, count(len(result.structures), "bone"), f"anchor: {result.anchor or 'not known'}"]
    parts.append(f"{total_seconds(result.seconds):.0f} s on {result.device}")
    version = result.versions.get("polypose", "")
    return ", ".join([*parts, f"PolyPose {version}"] if version else parts)


def bone_lines(result: Result) -> list[BoneLine]:
    """Every bone in words, in the result's order."""
    return [_bone_line(result, name, each) for name, each in result.structures.items()]


def is_still(result: Result, name: str) -> bool:
    """Whether a structure is the anchor; where that is not known, whether its motion is the identity."""
    if result.anchor:
        return name == result.anchor
    return np.array_equal(result.structures[name].fixed_to_moving, np.eye(4))


def notes(result: Result) -> list[tuple[str, str]]:
    """Reasons and warnings with their tone ("bad", "caution"): of the whole result, then of single bones.

    Warnings often repeat a bone's reasons; these are then left to them.
    """
    return [
        *((text, "bad") for text in result.distrust),
        *(
            (f"{name}: {'; '.join(each.doubts)}.", "caution")
            for name, each in result.structures.items()
            if each.doubts and not any('; '.join(each.doubts) in text for text in result.warnings)
        ),
        *((text, "caution") for text in result.warnings),
    ]  # fmt: skip


def _bone_line(result: Result, name: str, bone: StructureResult) -> BoneLine:
    if is_still(result, name):
        why = (
            "The anchor: it defines the cameras and does not move."
            if name == result.anchor
            else "It does not move."
        )
        return BoneLine(name, True, (UNKNOWN,) * 5, (UNKNOWN,) * 4, why, "", bone.doubts)
    shift = np.asarray(bone.translation_mm, dtype=np.float64)
    distance = float(np.linalg.norm(shift))
    cells = (
        number(bone.rotation_deg),
        *(number(float(value), signed=True) for value in shift),
        number(distance),
    )
    parts = ", ".join(
        f"{number(abs(value))} mm {words[int(value < 0)]}"
        for value, words in zip(shift, _DIRECTIONS, strict=True)
        if number(abs(value)) not in ("0.0", UNKNOWN)
    )
    motion = f"Rotated by {cells[0]}° and moved by {cells[4]} mm" + (f" ({parts})." if parts else ".")
    intervals = _interval_cells(bone.uncertainty)
    return BoneLine(name, False, cells, intervals, motion, _interval_words(intervals), bone.doubts)


_DIRECTIONS = (
    ("to the left", "to the right"),
    ("to the back", "to the front"),
    ("to the head", "to the feet"),
)


def _interval_cells(uncertainty: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Half widths of a bone's 95 % intervals."""
    fields = uncertainty or {}
    names = ("along_mm", "across_mm", "rotation_about_view_deg", "rotation_across_deg")
    return tuple(number(float(np.max(fields[name]))) if name in fields else UNKNOWN for name in names)


def _interval_words(cells: tuple[str, ...]) -> str:
    along, across, about, tilt = cells
    position = rotation = ""
    if along != UNKNOWN and across != UNKNOWN:
        position = f"position ± {along} mm along the viewing direction and ± {across} mm across it"
    if about != UNKNOWN and tilt != UNKNOWN:
        rotation = f"rotation ± {about}° about that direction and ± {tilt}° about the axes across it"
    known = "; ".join(each for each in (position, rotation) if each)
    return f"95 % interval: {known}." if known else "No interval was computed."
