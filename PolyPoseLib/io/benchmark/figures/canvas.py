"""What all figures of a benchmark share: a canvas without a window, colours, and how a file is written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.report.figure import drawn_texts, take_literally
from PolyPoseLib.io.whole_files import replaced_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED = "#1d2733", "#5a6672"

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Of M. Okabe and K. Ito, "Color universal design", 2008, told apart by all kinds of colour vision; without the yellow,
which is too light for lines on white."""

DPI = 300
TEXT, SMALL = 9.0, 8.0
"""Sizes in points, at the figure's printed width."""

COLUMN, PAGE = 3.5, 7.2
"""Widths in inches of a journal's column and page."""


def new_figure(width: float, height: float) -> Figure:
    """A figure that no window shows; raises InputError when matplotlib is missing."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError(
            "Figures need matplotlib, which is not installed: pip install matplotlib."
        ) from error
    figure = Figure(figsize=(width, height), dpi=DPI, facecolor="#ffffff", layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, folder: Path, stem: str, endings: tuple[str, ...] = ("png",)) -> list[str]:
    """Write a figure into whole files, its texts as they are; returns their names."""
    for text in drawn_texts(figure):
        take_literally(text)
    names = []
    for ending in endings:
        name = f"{stem}.{ending}"
        with replaced_whole(folder / name) as path:
            figure.savefig(path, metadata={"Date": None} if ending == "svg" else None)
        names.append(name)
    return names


def tidy(place: Axes) -> None:
    """Axes without a box, ticks and labels in the text's size."""
    for side in ("top", "right"):
        place.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        place.spines[side].set_color(MUTED)
    place.tick_params(labelsize=SMALL, colors=INK, width=0.6, length=3)
