"""Plots of the joints: angles and translations against time with their 95 % bands, as PNG and SVG."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.tracking.joint_motion import SOURCES_OF_AXES, BoneAxes, JointMotion, Quantity
from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.errors import InputError, one_line
from PolyPoseLib.io.report.figure import drawn_texts, take_literally
from PolyPoseLib.io.report.figure_parts import FLAGGED_COLOUR, INK, MUTED, TONES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CURVE_COLOUR = "#2563a8"
"""Of curves and their bands, as in the report of a registration."""

_SIZE = (12.0, 8.2)
_DPI = 120
_WIDEST_BAND = 1.0
"""A band is shown to this many times the range of its curve beyond it: that of gimbal lock would flatten it."""

_LEAST_RANGE = {"deg": 1.0, "mm": 0.5}
"""Range of an axis at least, so that noise does not fill the picture."""

_LONGEST = 60


def write_plots(track: Track, motions: Sequence[JointMotion], folder: Path) -> list[str]:
    """Draw every joint into a PNG and an SVG file.

    Parameters
    ----------
    track : Track
        From which the motions come; says whether it is smoothed, and whether it is to be trusted.
    motions : sequence of JointMotion
        One figure each.
    folder : Path
        There.

    Returns
    -------
    list of str
        Names of the files, in the order of the joints.

    Raises
    ------
    InputError
        Matplotlib is missing.

    """
    names = []
    for number, motion in enumerate(motions):
        figure = draw_motion(track, motion)
        stem = _stem(number, motion.joint.name)
        for name in (f"{stem}.png", f"{stem}.svg"):
            _save(figure, folder / name)
            names.append(name)
    return names


def draw_motion(track: Track, motion: JointMotion) -> Figure:
    """One joint as a matplotlib figure that no window shows; raises InputError when matplotlib is missing."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("Plots need matplotlib, which is not installed: pip install matplotlib.") from error
    figure = Figure(figsize=_SIZE, dpi=_DPI, facecolor="#ffffff")
    FigureCanvasAgg(figure)
    places = figure.subplots(3, 2, sharex=True, squeeze=False)
    figure.subplots_adjust(left=0.075, right=0.985, top=0.815, bottom=0.105, hspace=0.3, wspace=0.17)
    for row in range(3):
        _draw_curve(
            places[row, 0], motion, motion.angle_quantities[row], "deg", motion.angles_deg[:, row],
            motion.angles_95_deg[:, row], motion.locked if row != 1 else None,
        )  # fmt: skip
        _draw_curve(
            places[row, 1], motion, motion.translation_quantities[row], "mm", motion.translations_mm[:, row],
            motion.translations_95_mm[:, row], None,
        )  # fmt: skip
    for place in places[2]:
        place.set_xlabel("time (s)", fontsize=9, color=MUTED)
    _write_heading(figure, track, motion)
    for text in drawn_texts(figure):
        take_literally(text)
    return figure


def _write_heading(figure: Figure, track: Track, motion: JointMotion) -> None:
    joint = motion.joint
    side = "" if joint.side == "none" else f", {joint.side} side"
    smoothed = "; smoothed over time" if track.smoothed else ""
    lines = [
        (_short(joint.name), 15, INK, "bold"),
        (
            f"{_short(joint.distal)} relative to {_short(joint.proximal)}; "
            f"convention {joint.convention}{side}{smoothed}",
            10, MUTED, "normal",
        ),
        (f"axes of {_short(joint.proximal)}: {_axes_words(motion.proximal_axes)}", 9, MUTED, "normal"),
        (f"axes of {_short(joint.distal)}: {_axes_words(motion.distal_axes)}", 9, MUTED, "normal"),
    ]  # fmt: skip
    if track.distrust:
        lines.insert(1, ("NOT TO BE TRUSTED: see track.json", 10, TONES["bad"], "bold"))
    top = 0.985
    for text, size, colour, weight in lines:
        figure.text(0.012, top, text, fontsize=size, color=colour, weight=weight, va="top")
        top -= 1.5 * size / 72 / _SIZE[1]
    key = "Band: 95 % interval. Pink: a bone's pose is flagged as uncertain."
    if motion.locked.any():
        key += " Grey: near gimbal lock, where this angle is not determined."
    figure.text(0.012, 0.012, key, fontsize=9, color=MUTED, va="bottom")


def _axes_words(axes: BoneAxes) -> str:
    return SOURCES_OF_AXES[axes.source] + (f" ({axes.note})" if axes.note else "")


def _draw_curve(
    place: Axes,
    motion: JointMotion,
    quantity: Quantity,
    unit: str,
    values: np.ndarray,
    halves: np.ndarray,
    locked: np.ndarray | None,
) -> None:
    """One angle or translation with its band, its flags behind it."""
    times = motion.seconds
    for start, end in _spans(motion.doubtful, times):
        place.axvspan(start, end, color=FLAGGED_COLOUR, alpha=0.16, linewidth=0, zorder=0)
    if locked is not None:
        for start, end in _spans(locked, times):
            place.axvspan(start, end, color=MUTED, alpha=0.25, linewidth=0, zorder=0)
    low, high = _limits(values, halves, _LEAST_RANGE[unit])
    known = np.isfinite(halves)
    band = np.where(known, halves, high - low)
    place.fill_between(
        times, values - band, values + band, color=CURVE_COLOUR, alpha=0.2, linewidth=0, zorder=2
    )
    marker = "o" if len(times) < 3 or _has_single(values) else None
    place.plot(times, values, color=CURVE_COLOUR, linewidth=1.4, marker=marker, markersize=2.5, zorder=3)
    flagged = motion.doubtful & np.isfinite(values)
    place.plot(
        times[flagged], values[flagged], linestyle="none", marker="o", markersize=3.0, color=FLAGGED_COLOUR, zorder=4
    )  # fmt: skip
    place.set_ylim(low, high)
    if len(times) > 1:
        place.set_xlim(times[0], times[-1])
    place.set_title(
        f"{quantity.name.replace('_', ' ')} ({unit}); positive: {quantity.positive}",
        fontsize=8.5, color=INK, loc="left", pad=4,
    )  # fmt: skip
    place.ticklabel_format(axis="y", useOffset=False)
    place.tick_params(labelsize=8, colors=MUTED, length=2)
    place.grid(True, linewidth=0.4, alpha=0.5)
    for side in ("top", "right"):
        place.spines[side].set_visible(False)
    if not np.isfinite(values).any():
        place.text(
            0.5, 0.5, "lost in every frame", transform=place.transAxes, ha="center", color=MUTED, fontsize=9
        )


def _limits(values: np.ndarray, halves: np.ndarray, least: float) -> tuple[float, float]:
    """Lower and upper end of the axis: the curve with its band, as far as the band does not flatten the curve."""
    known = np.isfinite(values)
    if not known.any():
        return -least, least
    low, high = float(values[known].min()), float(values[known].max())
    reach = max(_WIDEST_BAND * (high - low), least)
    band = np.minimum(np.where(np.isfinite(halves[known]), halves[known], np.inf), reach)
    low, high = min(low, float((values[known] - band).min())), max(high, float((values[known] + band).max()))
    missing = max(least - (high - low), 0.0) / 2
    margin = 0.05 * (high - low)
    return low - missing - margin, high + missing + margin


def _spans(flags: np.ndarray, times: np.ndarray) -> list[tuple[float, float]]:
    """Start and end of every run of flagged frames, half a frame beyond both."""
    half = float(np.diff(times).min()) / 2 if len(times) > 1 else 0.5
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(int)))
    return [(float(times[a]) - half, float(times[b - 1]) + half) for a, b in edges.reshape(-1, 2)]


def _has_single(values: np.ndarray) -> bool:
    """Whether a known frame lies between lost ones, where a line would not show it."""
    known = np.r_[False, np.isfinite(values), False]
    return bool((known[1:-1] & ~known[:-2] & ~known[2:]).any())


def _save(figure: Figure, path: Path) -> None:
    """Without a date and with names of elements that stay the same, so that equal plots are equal files."""
    from matplotlib import rc_context

    with rc_context({"svg.hashsalt": "polypose"}):
        metadata = {"Date": None} if path.suffix == ".svg" else None
        figure.savefig(path, dpi=figure.dpi, facecolor=figure.get_facecolor(), metadata=metadata)


def _stem(number: int, name: str) -> str:
    """A file's name that is the joint's as far as every system allows, and different for every joint."""
    return f"joint_{number + 1}_{re.sub(r'[^A-Za-z0-9_-]+', '_', name)[:40]}"


def _short(text: str) -> str:
    plain = one_line(text)
    return textwrap.shorten(plain, _LONGEST, placeholder="...") or plain[:_LONGEST]
