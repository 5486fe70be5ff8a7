"""A plan's shadows drawn over an X-ray."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError, one_line
from PolyPoseLib.geometry.projected_ellipse import ellipse
from PolyPoseLib.io.projected.shadows import PointShadow, ViewShadows
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
    _draw_outlines(place, shadows, max(height, width) / 80)
    _draw_points(place, shadows, max(height, width))
    size = max(height, width) / 95
    _write(place, (0.012, 0.988), heading, size, "#ffffff", axes=True, vertical="top")
    if warning:
        _write(place, (0.012, 0.955), warning, size, "#ff6b5e", axes=True, vertical="top")
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:height, :width, :3].copy()


def _draw_outlines(place: Axes, shadows: ViewShadows, size: float) -> None:
    from matplotlib.collections import LineCollection

    for number, outline in enumerate(shadows.outlines):
        colour = OUTLINE_COLOURS[number % len(OUTLINE_COLOURS)]
        lines = [np.concatenate([each, each[:1]]) for each in outline.polygons]
        place.add_collection(LineCollection(lines, colors=colour, linewidths=1.3), autolim=False)
        largest = max(outline.polygons, key=len)
        top = largest[largest[:, 1].argmin()]
        _write(place, (top[0], top[1]), outline.name, size, colour, vertical="bottom")


def _draw_points(place: Axes, shadows: ViewShadows, side: int) -> None:
    from matplotlib.collections import LineCollection

    drawn = [each for each in shadows.points if each.drawn]
    known = [each for each in drawn if np.isfinite(each.covariance).all()]
    rings = [ellipse(each.place, each.covariance) for each in known]
    rings = [np.concatenate([each, each[:1]]) for each in rings]
    place.add_collection(LineCollection(rings, colors=POINT_COLOUR, linewidths=0.9, alpha=0.9), autolim=False)
    place.add_collection(
        LineCollection(list(shadows.lines), colors=POINT_COLOUR, linewidths=1.4), autolim=False
    )
    if drawn:
        at = np.array([each.place for each in drawn])
        size = side / 90 if len(drawn) <= MOST_LABELS else side / 220
        place.scatter(at[:, 0], at[:, 1], s=size**2, c=POINT_COLOUR, marker="+", linewidths=1.2)
    if len(drawn) <= MOST_LABELS:
        for each in drawn:
            _label(place, each, side)


def _label(place: Axes, point: PointShadow, side: int) -> None:
    """A point's label to its upper right, or upper left near the right edge."""
    left, right = place.get_xlim()
    near_right = point.place[0] > left + 0.85 * (right - left)
    shift = 0.008 * (right - left)
    corner = point.place + np.array([-shift if near_right else shift, -shift])
    _write(
        place,
        (corner[0], corner[1]),
        point.label,
        side / 85,
        POINT_COLOUR,
        horizontal="right" if near_right else "left",
    )


def _write(
    place: Axes,
    at: tuple[float, float],
    text: str,
    size: float,
    colour: str,
    axes: bool = False,
    vertical: str = "bottom",
    horizontal: str = "left",
) -> None:
    """Write a text as it is, with a dark edge; size in pixels."""
    from matplotlib.patheffects import withStroke

    plain = one_line(text.encode("utf-8", "replace").decode("utf-8"))
    short = plain if axes else textwrap.shorten(plain, _LONGEST, placeholder="...") or plain[:_LONGEST]
    written = place.text(
        *at, short, fontsize=1.2 * size * 72 / _DPI, color=colour, va=vertical, ha=horizontal, clip_on=True,
        transform=place.transAxes if axes else place.transData, parse_math=False,
        path_effects=[withStroke(linewidth=2, foreground="#000000")],
    )  # fmt: skip
    written.set_usetex(False)
