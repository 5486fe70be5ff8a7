"""The motion of joints as tables: joints.csv for spreadsheets, and joints.json with all that is known."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.tracking.joint_motion import SOURCES_OF_AXES, BoneAxes, HelicalAxes, JointMotion
from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.errors import one_line
from PolyPoseLib.io.json_records import json_text

TABLE, RECORD = "joints.csv", "joints.json"

VERSION = 1

_DECIMALS = 6


def write_joint_tables(track: Track, motions: Sequence[JointMotion], folder: Path) -> list[str]:
    """Write joints.csv and joints.json.

    Parameters
    ----------
    track : Track
        From which the motions come.
    motions : sequence of JointMotion
        Of the same frames.
    folder : Path
        There.

    Returns
    -------
    list of str
        Names of the files; none where there is no motion, as of a single structure.

    """
    if not motions:
        return []
    columns = [column for motion in motions for column in _columns(motion)]
    with (folder / TABLE).open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["frame", "time_s", *(header for header, _ in columns)])
        for row, (frame, seconds) in enumerate(zip(motions[0].frames, motions[0].seconds, strict=True)):
            table.writerow([int(frame), _decimal(seconds), *(values[row] for _, values in columns)])
    (folder / RECORD).write_text(json_text(_record(track, motions)), encoding="utf-8")
    return [TABLE, RECORD]


def _columns(motion: JointMotion) -> Iterator[tuple[str, list[str]]]:
    """Headers with their unit, and what stands below them."""
    name = one_line(motion.joint.name)
    for quantities, unit, values, halves in (
        (motion.angle_quantities, "deg", motion.angles_deg, motion.angles_95_deg),
        (motion.translation_quantities, "mm", motion.translations_mm, motion.translations_95_mm),
    ):
        for place, quantity in enumerate(quantities):
            yield f"{name}.{quantity.name}_{unit}", _decimals(values[:, place])
            yield f"{name}.{quantity.name}_95_{unit}", _decimals(halves[:, place])
    axes = motion.since_first
    yield f"{name}.helical_angle_deg", _decimals(axes.angles_deg)
    yield f"{name}.helical_angle_95_deg", _decimals(axes.angles_95_deg)
    yield f"{name}.helical_shift_mm", _decimals(axes.shifts_mm)
    yield f"{name}.helical_shift_95_mm", _decimals(axes.shifts_95_mm)
    for place, letter in enumerate("xyz"):
        yield f"{name}.helical_direction_{letter}", _decimals(axes.directions[:, place])
    for place, letter in enumerate("xyz"):
        yield f"{name}.helical_point_{letter}_mm", _decimals(axes.points_mm[:, place])
    yield f"{name}.gimbal_lock", ["yes" if each else "no" for each in motion.locked]
    yield f"{name}.doubtful", ["yes" if each else "no" for each in motion.doubtful]
    sources = f"{motion.proximal_axes.source} / {motion.distal_axes.source}"
    yield f"{name}.axes", [sources] * len(motion.frames)


def _record(track: Track, motions: Sequence[JointMotion]) -> dict[str, Any]:
    return {
        "version": VERSION,
        "frames_per_second": track.frames_per_second,
        "smoothed": track.smoothed,
        "distrust": track.distrust,
        "intervals": 'fields with "half_width_95" reach from the value to either end of its 95 % interval',
        "frame": motions[0].frames,
        "time_s": motions[0].seconds.round(_DECIMALS),
        "joints": [_joint_record(motion) for motion in motions],
    }


def _joint_record(motion: JointMotion) -> dict[str, Any]:
    joint = motion.joint
    return {
        "name": joint.name,
        "proximal": joint.proximal,
        "distal": joint.distal,
        "convention": joint.convention,
        "side": joint.side,
        "axes": {
            "proximal": _axes_record(motion.proximal_axes),
            "distal": _axes_record(motion.distal_axes),
        },
        "warnings": motion.warnings,
        "angles": [
            {
                "name": quantity.name,
                "positive": quantity.positive,
                "deg": motion.angles_deg[:, place].round(_DECIMALS),
                "half_width_95_deg": motion.angles_95_deg[:, place].round(_DECIMALS),
            }
            for place, quantity in enumerate(motion.angle_quantities)
        ],
        "translations": [
            {
                "name": quantity.name,
                "positive": quantity.positive,
                "mm": motion.translations_mm[:, place].round(_DECIMALS),
                "half_width_95_mm": motion.translations_95_mm[:, place].round(_DECIMALS),
            }
            for place, quantity in enumerate(motion.translation_quantities)
        ],
        "gimbal_lock": motion.locked,
        "doubtful": motion.doubtful,
        "helical_since_first_frame": _helical_record(motion.since_first),
        "helical_since_previous_frame": _helical_record(motion.since_previous),
    }


def _axes_record(axes: BoneAxes) -> dict[str, Any]:
    return {
        "from": axes.source,
        "meaning": SOURCES_OF_AXES[axes.source],
        "note": axes.note,
        "axes_to_ct_lps_mm": axes.matrix,
    }


def _helical_record(axes: HelicalAxes) -> dict[str, Any]:
    """In the proximal bone's axes."""
    fields = {
        "angle_deg": axes.angles_deg,
        "angle_half_width_95_deg": axes.angles_95_deg,
        "shift_mm": axes.shifts_mm,
        "shift_half_width_95_mm": axes.shifts_95_mm,
        "direction": axes.directions,
        "direction_half_width_95_deg": axes.directions_95_deg,
        "point_mm": axes.points_mm,
        "point_half_width_95_mm": axes.points_95_mm,
    }
    return {name: np.round(values, _DECIMALS) for name, values in fields.items()}


def _decimals(values: np.ndarray) -> list[str]:
    return [_decimal(each) for each in values]


def _decimal(value: float) -> str:
    """A number, empty where it is not known."""
    return f"{value + 0.0:.{_DECIMALS}f}" if math.isfinite(value) else ""
