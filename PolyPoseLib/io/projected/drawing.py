"""A plan's shadows drawn over an X-ray."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError, one_line
from PolyPoseLib.geometry.projected_ellipse import ellipse
from PolyPoseLib.io.projected.shadows import ViewShadows
from PolyPoseLib.io.report.pictures import grey, shrunk

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LARGEST_SIDE, SMALLEST_SIDE = 2048, 900
"""Pixels of a picture's longer side: X-rays are averaged or enlarged by whole factors to lie between, if they can."""

MOST_LABELS = 60
"""Points of which the labels are written; more would hide the X-ray."""

POINT_COLOUR = "#35d6ff"
OUTLINE_COLOURS = ("#ff9e3d", "#7ee787", "#ff5c93", "#ffe066", "#c39bff", "#4dd0c8")

_DPI = 100
_LONGEST = 40


def drawn_xray(xray: np.ndarray, shadows: ViewShadows, heading: str, warning: str = "") -> np.ndarray:
    """An X-ray with a plan over it.

    Parameters
    ----------
    xray : (H, W) array
        Line integrals.
    shadows : ViewShadows
        In pixels of the X-ray.
    heading : str
        Written in the upper left corner.
    warning : str
        Written below it in red.

    Returns
    -------
    (h, w, 3) array of uint8
        The picture, rows and columns as the X-ray's times one factor.

    Raises
    ------
    InputError
        Matplotlib is missing.

    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError(
            "Drawing on X-rays needs matplotlib, which is not installed: pip install matplotlib."
        ) from error
    small, factor = shrunk(xray, LARGEST_SIDE)
    picture = grey(small)
    enlarged = max(1, round(SMALLEST_SIDE / max(picture.shape)))
    height, width = (enlarged * each for each in picture.shape)
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, facecolor="#000000")
    canvas = FigureCanvasAgg(figure)
    place = figure.add_axes((0, 0, 1, 1))
    place.set_axis_off()
    rows, columns = (factor * each for each in picture.shape)
    extent = (-0.5, columns - 0.5, rows - 0.5, -0.5)
    place.imshow(
        picture, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="bilinear", aspect="auto"
    )
    place.set_xlim(extent[0], extent[1])
    place.set_ylim(extent[2], extent[3])
    names = [*_draw_points(place, shadows, max(height, width)), *_draw_outlines(place, shadows)]
    size = max(height, width) / 90
    _write_names(place, names, size, columns / width)
    _write(place, (0.012, 0.988), _plain(heading), size, "#ffffff", axes=True)
    if warning:
        _write(place, (0.012, 0.955), warning, 1.2 * size, "#ff6b5e", axes=True)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:height, :width, :3].copy()


def _draw_outlines(place: Axes, shadows: ViewShadows) -> list[_Name]:
    """Draw them, and return what is to be written."""
    from matplotlib.collections import LineCollection

    names = []
    for number, outline in enumerate(shadows.outlines):
        colour = OUTLINE_COLOURS[number % len(OUTLINE_COLOURS)]
        lines = [np.concatenate([each, each[:1]]) for each in outline.polygons]
        place.add_collection(LineCollection(lines, colors=colour, linewidths=1.3), autolim=False)
        largest = max(outline.polygons, key=len)
        names.append(_Name(outline.name, largest[largest[:, 1].argmin()], colour))
    return names


def _draw_points(place: Axes, shadows: ViewShadows, side: int) -> list[_Name]:
    """Draw them with their ellipses and lines, and return what is to be written."""
    from matplotlib.collections import LineCollection

    drawn = [each for each in shadows.points if each.drawn]
    known = [each for each in drawn if np.isfinite(each.covariance).all()]
    rings = [ellipse(each.place, each.covariance) for each in known]
    rings = [np.concatenate([each, each[:1]]) for each in rings]
    place.add_collection(LineCollection(rings, colors=POINT_COLOUR, linewidths=0.9, alpha=0.9), autolim=False)
    lines = LineCollection(list(shadows.lines), colors=POINT_COLOUR, linewidths=1.4)
    place.add_collection(lines, autolim=False)
    if drawn:
        at = np.array([each.place for each in drawn])
        size = side / 90 if len(drawn) <= MOST_LABELS else side / 220
        place.scatter(at[:, 0], at[:, 1], s=size**2, c=POINT_COLOUR, marker="+", linewidths=1.2)
    return (
        [_Name(each.label, each.place, POINT_COLOUR) for each in drawn] if len(drawn) <= MOST_LABELS else []
    )


@dataclass(frozen=True)
class _Name:
    """A text that belongs to a place (column, row)."""

    text: str
    at: np.ndarray
    colour: str


def _write_names(place: Axes, names: Sequence[_Name], size: float, scale: float) -> None:
    """Write names beside their places, none over another where there is room; size: letters' height in pixels.

    scale: pixels of the X-ray in one of the picture.
    """
    shorts = [_short(each.text) for each in names]
    boxes = [(scale * 0.72 * size * len(text), scale * 1.3 * size) for text in shorts]
    limits = (place.get_xlim(), sorted(place.get_ylim()))
    corners = free_corners([each.at for each in names], boxes, scale * 0.6 * size, limits)
    for name, text, corner in zip(names, shorts, corners, strict=True):
        _write(place, corner, text, size, name.colour)


def free_corners(
    places: Sequence[np.ndarray],
    boxes: Sequence[tuple[float, float]],
    gap: float,
    limits: tuple[Sequence[float], Sequence[float]],
) -> list[tuple[float, float]]:
    """Where to put boxes (width, height) beside places so that they do not overlap.

    Every box lies at its place's right or left, above or below, or farther up or down where these are taken; the first
    of these at the right above where all are.

    Returns
    -------
    list of tuple of float
        Lower left corner of every box, rows counted downwards.

    """
    (left, right), (top, bottom) = limits
    taken: list[tuple[float, float, float, float]] = []
    corners = []
    for (column, row), (width, height) in zip(places, boxes, strict=True):
        rows = [row + step for n in range(6) for step in (-gap - n * height, gap + height + n * height)]
        options = [(x, y) for y in rows for x in (column + gap, column - gap - width)]
        free = (
            (x, y)
            for x, y in options
            if left <= x and x + width <= right and top <= y - height and y <= bottom
            and all(x >= x1 or x + width <= x0 or y <= y0 or y - height >= y1 for x0, x1, y0, y1 in taken)
        )  # fmt: skip
        x, y = next(free, (min(column + gap, right - width), max(row - gap, top + height)))
        taken.append((x, x + width, y - height, y))
        corners.append((float(x), float(y)))
    return corners


def _plain(text: str) -> str:
    """A text on one line; half of a surrogate pair, which no font has, is shown as "?"."""
    return one_line(text.encode("utf-8", "replace").decode("utf-8"))


def _short(text: str) -> str:
    plain = _plain(text)
    return textwrap.shorten(plain, _LONGEST, placeholder="...") or plain[:_LONGEST]


def _write(
    place: Axes, at: tuple[float, float], text: str, size: float, colour: str, axes: bool = False
) -> None:
    """Write a text as it is, with a dark edge.

    at: its lower left corner in pixels of the X-ray, or with ``axes`` its upper left one as shares of the picture.
    """
    from matplotlib.patheffects import withStroke

    written = place.text(
        *at, text, fontsize=1.2 * size * 72 / _DPI, color=colour, va="top" if axes else "bottom", ha="left",
        clip_on=True, transform=place.transAxes if axes else place.transData, parse_math=False,
        path_effects=[withStroke(linewidth=2, foreground="#000000")],
    )  # fmt: skip
    written.set_usetex(False)
