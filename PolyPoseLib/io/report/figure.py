"""The report as one picture, drawn by matplotlib: report.png."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.report.figure_parts import (
    HEADER_ROWS,
    INK,
    MUTED,
    TONES,
    draw_close_up,
    draw_curve,
    draw_motions,
    draw_view,
)
from PolyPoseLib.io.report.summary import Summary
from PolyPoseLib.io.report.views import CloseUp, close_ups
from PolyPoseLib.io.report.words import BEFORE, CAUTION, CELLS_MEAN, INTERVALS, SIMILARITY, count

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

WIDTH = 15.0
"""Inches; all lengths here are."""

_LEFT, _RIGHT = 0.5, 14.85
_DPI = 120

_COLUMNS = 5
_TILES, _PANELS = 6, 6
"""Close-ups and similarity panels in a row."""

MOST_TILES, MOST_PANELS, MOST_NOTES, MOST_ROWS = 24, 18, 12, 60
"""The rest is in report.html."""

_KEY = (
    "Lines: orange, dashed = before; blue = after; pink = after, uncertain; yellow = the anchor. Overlays: magenta = "
    "X-ray only, green = CT only, grey = both agree (contrast made equal)."
)


def draw_figure(summary: Summary) -> Figure:
    """The report as a matplotlib figure that no window shows; raises InputError when matplotlib is missing."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError(
            "The picture of the report needs matplotlib, which is not installed: pip install matplotlib."
        ) from error
    layout = _Layout(Figure(figsize=(WIDTH, 10.0), facecolor="#ffffff", dpi=_DPI))
    FigureCanvasAgg(layout.figure)
    _header(layout, summary)
    _views(layout, summary)
    _close_ups(layout, summary)
    _motions(layout, summary)
    _panels(layout, summary)
    layout.text(CAUTION, 9, MUTED)
    layout.end()
    for text in drawn_texts(layout.figure):
        take_literally(text)
    return layout.figure


def drawn_texts(figure: Figure) -> Iterator[Text]:
    """Every text of a figure; those in the cells of tables are not among the children that matplotlib lists."""
    from matplotlib.table import Table
    from matplotlib.text import Text

    yield from figure.findobj(Text)
    for table in figure.findobj(Table):
        yield from (cell.get_text() for cell in table.get_celld().values())


def take_literally(text: Text) -> None:
    """Show a text as it is: names are the user's, and "$" in one begins no formula.

    Half of a surrogate pair, which no font has, is shown as "?".
    """
    text.set_parse_math(False)
    text.set_usetex(False)
    text.set_text(text.get_text().encode("utf-8", "replace").decode("utf-8"))


class _Layout:
    """Rows from the top of a figure to its bottom, in inches; the figure becomes as high as they need."""

    def __init__(self, figure: Figure) -> None:
        self.figure = figure
        self._width, self._height = (float(each) for each in figure.get_size_inches())
        self.top = 0.15

    def text(
        self, text: str, size: float, colour: str = INK, weight: str = "normal", gap: float = 0.05
    ) -> None:
        """Write a text below what is there, in as many lines as it needs."""
        for line in textwrap.wrap(text, int((_RIGHT - _LEFT) * 136 / size), break_long_words=True) or [""]:
            drawn = self.figure.text(
                _LEFT / self._width, 1 - self.top / self._height, line, fontsize=size, color=colour, weight=weight,
                va="top",
            )  # fmt: skip
            take_literally(drawn)
            width = drawn.get_window_extent().width / self.figure.dpi
            drawn.set_fontsize(
                size * min(1.0, (_RIGHT - _LEFT) / max(width, 1e-6))
            )  # letters may all be wide
            self.top += size / 72 * 1.35
        self.top += gap

    def axes(self, column: int, columns: int, height: float, gap: float = 0.08) -> Axes:
        """Axes in one of several equal columns, at the present place; ``skip`` goes on below them."""
        width = (_RIGHT - _LEFT - gap * (columns - 1)) / columns
        left = _LEFT + column * (width + gap)
        return self.figure.add_axes(
            (
                left / self._width,
                1 - (self.top + height) / self._height,
                width / self._width,
                height / self._height,
            )
        )

    def skip(self, height: float) -> None:
        """Go down."""
        self.top += height

    def end(self) -> None:
        """Give the figure the height of what was put into it."""
        height = self.top + 0.1
        ratio = self._height / height
        for axes in self.figure.axes:
            box = axes.get_position()
            axes.set_position((box.x0, 1 - (1 - box.y0) * ratio, box.width, box.height * ratio))
        for text in self.figure.texts:
            text.set_y(1 - (1 - text.get_position()[1]) * ratio)
        self.figure.set_size_inches(self._width, height)


def _column_width(columns: int) -> float:
    return (_RIGHT - _LEFT - 0.08 * (columns - 1)) / columns


def _view_height(summary: Summary) -> float:
    ratios = [view.shape[0] / view.shape[1] for view in summary.views]
    return _column_width(_COLUMNS) * float(np.clip(max(ratios, default=1.0), 0.5, 1.6))


def _header(layout: _Layout, summary: Summary) -> None:
    layout.text("PolyPose report", 17, weight="bold")
    layout.text(summary.headline.text, 13, TONES[summary.headline.tone], "bold")
    layout.text(summary.facts, 9.5, MUTED)
    for text, tone in summary.notes[:MOST_NOTES]:
        layout.text(text, 9.5, TONES[tone], gap=0.02)
    if len(summary.notes) > MOST_NOTES:
        more = f"... and {len(summary.notes) - MOST_NOTES} more in report.html and result.json"
        layout.text(more, 9.5, TONES["caution"])
    layout.skip(0.08)
    layout.text(f"{BEFORE} {_KEY}", 9, MUTED, gap=0.3)


def _views(layout: _Layout, summary: Summary) -> None:
    height = _view_height(summary)
    for number, view in enumerate(summary.views):
        draw_view([layout.axes(column, _COLUMNS, height) for column in range(_COLUMNS)], view, number == 0)
        layout.skip(height + 0.28)


def _tiles(summary: Summary) -> list[CloseUp]:
    """Close-ups of the moving bones: in every view where there is room for that, or else in the one that shows most."""
    found = [close_ups(summary.views, bone.name) for bone in summary.bones if not bone.still]
    if sum(map(len, found)) > MOST_TILES:
        found = [[max(each, key=lambda tile: tile.box[2] * tile.box[3])] if each else [] for each in found]
    return [tile for each in found for tile in each][:MOST_TILES]


def _close_ups(layout: _Layout, summary: Summary) -> None:
    tiles = _tiles(summary)
    if not tiles:
        return
    shown = {tile.bone.name for tile in tiles}
    wanted = [bone.name for bone in summary.bones if not bone.still]
    more = (
        f" {len(shown)} of {len(wanted)}; the others are in report.html." if len(shown) < len(wanted) else ""
    )
    layout.text(f"Every moving bone, close up.{more}", 11, weight="bold", gap=0.02)
    side = _column_width(_TILES)
    by_name = {bone.name: bone for bone in summary.bones}
    for start in range(0, len(tiles), _TILES):
        layout.skip(0.48)
        for column, tile in enumerate(tiles[start : start + _TILES]):
            draw_close_up(layout.axes(column, _TILES, side), tile, by_name[tile.bone.name])
        layout.skip(side + 0.13)


_TABLE_ROW = 0.24


def _motions(layout: _Layout, summary: Summary) -> None:
    if not summary.bones:
        return
    layout.skip(0.15)
    left_out = len(summary.bones) - MOST_ROWS
    more = f" The first {MOST_ROWS} bones; the others are in report.html." if left_out > 0 else ""
    layout.text(f"Motions and intervals.{more}", 11, weight="bold", gap=0.02)
    layout.text(f"{INTERVALS} {CELLS_MEAN}", 8.5, MUTED)
    bones = summary.bones[:MOST_ROWS]
    height = _TABLE_ROW * (len(bones) + HEADER_ROWS)
    draw_motions(layout.axes(0, 1, height), bones)
    layout.skip(height + 0.1)


def _panels(layout: _Layout, summary: Summary) -> None:
    curves = summary.curves[-MOST_PANELS:]
    if not curves:
        return
    layout.skip(0.15)
    left_out = len(summary.curves) - len(curves)
    more = (
        f" The last {len(curves)} levels; {count(left_out, 'more is', 'more are')} in report.html."
        if left_out
        else ""
    )
    layout.text(f"Similarity, level by level.{more}", 11, weight="bold", gap=0.02)
    layout.text(SIMILARITY, 8.5, MUTED)
    for start in range(0, len(curves), _PANELS):
        layout.skip(0.45)
        for column, curve in enumerate(curves[start : start + _PANELS]):
            draw_curve(layout.axes(column, _PANELS, 1.15, gap=0.55), curve)
        layout.skip(1.15 + 0.4)
