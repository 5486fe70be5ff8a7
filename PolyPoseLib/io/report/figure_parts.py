"""Parts of the report's picture: a view's row, a close-up, a similarity panel, the table of motions."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import one_line
from PolyPoseLib.io.report.levels import LevelCurve
from PolyPoseLib.io.report.pictures import window
from PolyPoseLib.io.report.views import BoneOutline, CloseUp, Polygons, ReportView, name_places
from PolyPoseLib.io.report.words import CELLS, UNKNOWN, BoneLine, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, MUTED = "#1d2733", "#66727f"
TONES = {"good": "#1f7a3d", "caution": "#8a5a00", "bad": "#b3261e"}

BEFORE_COLOUR, AFTER_COLOUR, FLAGGED_COLOUR, ANCHOR_COLOUR = "#ff9e3d", "#35d6ff", "#ff5c93", "#ffe066"

_TITLES = (
    "before: bones as in the CT",
    "after: bones as found",
    "CT rendered after",
    "overlay before",
    "overlay after",
)
HEADER_ROWS = 1.6
"""Height of the table's header in rows."""

_LONGEST = 40
_NAMES_UP_TO = 12


def draw_view(axes: list[Axes], view: ReportView, first: bool) -> None:
    """One row: the X-ray with outlines before and after, the rendering, the overlays; titles above the first row."""
    for place, before in zip(axes[:2], (True, False), strict=True):
        _show(place, view.picture, view.shape)
        for bone in view.outlines:
            _draw_outline(place, bone, before=before, after=not before)
        if len(view.outlines) <= _NAMES_UP_TO:
            _draw_names(place, view, before)
    _show(axes[2], view.after, view.shape)
    for place, image in zip(axes[3:], (view.overlay_before, view.overlay_after), strict=True):
        _show(place, image, view.shape)
    for place, title in zip(axes, _TITLES, strict=True):
        _bare(place)
        if first:
            place.set_title(title, fontsize=10, color=INK, pad=5)
    name = textwrap.shorten(view.name, _LONGEST, placeholder="...") or one_line(view.name)[:_LONGEST]
    similarity = number(view.similarity, 3)
    axes[0].set_ylabel(
        name if similarity == UNKNOWN else f"{name}\nsimilarity {similarity}", fontsize=9, color=INK
    )


def draw_close_up(place: Axes, tile: CloseUp, bone: BoneLine) -> None:
    """One bone in one view, before and after, with its motion and its interval above."""
    picture = tile.view.picture
    if picture is not None:
        slope, offset = window(tile.part)
        _show(
            place,
            np.clip(slope * picture.astype(np.float32) + 255 * offset, 0, 255).astype(np.uint8),
            tile.view.shape,
        )
    else:
        _show(place, None, tile.view.shape)
    _draw_outline(place, tile.bone, before=True, after=True)
    _bare(place)
    column, row, width, height = tile.box
    side = max(width, height)
    middle = column + width / 2, row + height / 2
    place.set_xlim(middle[0] - side / 2, middle[0] + side / 2)
    place.set_ylim(middle[1] + side / 2, middle[1] - side / 2)
    place.set_facecolor("#000000")
    title = textwrap.shorten(f"{bone.name}, {tile.view.name}", 38, placeholder="...") or bone.name[:38]
    flag = "; uncertain" if bone.doubts else ""
    interval = "no interval"
    if UNKNOWN not in bone.intervals[:2]:
        interval = f"95 %: ± {bone.intervals[0]} mm along, ± {bone.intervals[1]} mm across"
    text = f"{title}\n{bone.cells[0]}°, {bone.cells[4]} mm{flag}\n{interval}"
    place.set_title(text, fontsize=7.5, color=TONES["caution"] if bone.doubts else INK, pad=3)


def draw_curve(place: Axes, curve: LevelCurve) -> None:
    """The similarity during one level."""
    from matplotlib.ticker import MaxNLocator

    place.plot(
        np.arange(1, len(curve.values) + 1),
        curve.values,
        color="#2563a8",
        linewidth=1.5,
        marker="o",
        markersize=2.5,
    )
    place.set_ylim(*curve.limits)
    title = textwrap.shorten(curve.title, 30, placeholder="...") or curve.title[:30]
    place.set_title(f"{title}\n{curve.summary}", fontsize=8, color=INK, loc="left", pad=3)
    place.ticklabel_format(axis="y", useOffset=False)
    place.locator_params(axis="y", nbins=3)
    place.xaxis.set_major_locator(MaxNLocator(4, integer=True))
    place.tick_params(labelsize=7, colors=MUTED, length=2)
    place.set_xlabel("iteration", fontsize=7.5, color=MUTED, labelpad=1)
    place.grid(True, linewidth=0.4, alpha=0.5)
    for side in ("top", "right"):
        place.spines[side].set_visible(False)


def draw_motions(place: Axes, bones: list[BoneLine]) -> None:
    """The table of motions and intervals, which fills the axes."""
    from matplotlib.transforms import Bbox

    place.set_axis_off()
    header = ["bone", *(each.replace(" (", "\n(") for each in CELLS), "reasons for doubt"]
    rows = [
        [
            textwrap.shorten(bone.name, _LONGEST, placeholder="...") or bone.name[:_LONGEST],
            *bone.cells,
            *bone.intervals,
            _shortened("; ".join(bone.doubts)) or ("anchor, does not move" if bone.still else "none"),
        ]
        for bone in bones
    ]
    widths = [0.15, *[0.068] * 9, 0.238]
    drawn = place.table(
        rows, colLabels=header, colWidths=widths, bbox=Bbox([[0, 0], [1, 1]]), edges="horizontal"
    )
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(8.5)
    for (row, column), cell in drawn.get_celld().items():
        cell.set_edgecolor("#d5dbe1")
        cell.set_text_props(color=INK, weight="bold" if row == 0 else "normal")
        last = column == len(header) - 1
        cell.get_text().set_horizontalalignment("left" if column == 0 or last else "right")
        cell.set_height((HEADER_ROWS if row == 0 else 1) / (len(rows) + HEADER_ROWS))


def _shortened(text: str) -> str:
    return text if len(text) <= 46 else text[:43] + "..."


def _show(place: Axes, image: np.ndarray | None, shape: tuple[int, int]) -> None:
    """An image over the area of the shown picture, grey or in colour."""
    if image is None:
        place.text(0.5, 0.5, "not kept", transform=place.transAxes, ha="center", color=MUTED, fontsize=9)
        return
    extent = (-0.5, shape[1] - 0.5, shape[0] - 0.5, -0.5)
    place.imshow(image, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="bilinear")


def _bare(place: Axes) -> None:
    """Without ticks and frame."""
    place.set_xticks([])
    place.set_yticks([])
    for spine in place.spines.values():
        spine.set_visible(False)


def _draw_outline(place: Axes, bone: BoneOutline, before: bool, after: bool) -> None:
    if bone.kind == "anchor":
        _draw_lines(place, bone.after, ANCHOR_COLOUR, 0.7)
        return
    if before:
        _draw_lines(place, bone.before, BEFORE_COLOUR, 1.0, dashed=True)
    if after:
        _draw_lines(place, bone.after, FLAGGED_COLOUR if bone.kind == "flagged" else AFTER_COLOUR, 1.0)


def _draw_lines(place: Axes, polygons: Polygons, colour: str, width: float, dashed: bool = False) -> None:
    from matplotlib.collections import LineCollection

    lines = [np.concatenate([each, each[:1]]) for each in polygons]
    style = (0, (4, 2)) if dashed else "solid"
    place.add_collection(
        LineCollection(lines, colors=colour, linewidths=width, linestyles=[style]), autolim=False
    )


def _draw_names(place: Axes, view: ReportView, before: bool) -> None:
    from matplotlib.patheffects import withStroke

    for name, (column, row) in name_places(view, before, max(view.shape) / 30).items():
        place.text(
            column, row, textwrap.shorten(name, _LONGEST, placeholder="...") or name[:_LONGEST], fontsize=6.5,
            color="#ffffff", ha="center", va="baseline", path_effects=[withStroke(linewidth=1.5, foreground="#000000")],
            clip_on=True,
        )  # fmt: skip
