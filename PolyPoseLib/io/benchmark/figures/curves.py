"""Scores against the number of views: Dice coefficients and folds, one figure per data set."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from PolyPoseLib.errors import one_line
from PolyPoseLib.evaluation.benchmark.columns import Column, Row
from PolyPoseLib.evaluation.benchmark.statistics import OURS, REFERENCE, Cell, Line, tables_of
from PolyPoseLib.io.benchmark.figures.canvas import (
    COLOURS,
    INK,
    MUTED,
    PAGE,
    SMALL,
    TEXT,
    new_figure,
    save,
    tidy,
)
from PolyPoseLib.io.benchmark.tables import check_rows
from PolyPoseLib.io.tracking.file_names import file_stems

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")
_Dashes = Literal["-", "--", ":", "-."]
_DASHES: tuple[_Dashes, ...] = ("-", "--", ":", "-.")
_VIEWS = re.compile(r"([1-9][0-9]{0,3})x([0-9]{1,3}(?:\.[0-9]{1,3})?)", re.ASCII)

_LEAST_FOLDS = 0.01
"""Percent below which the axis of folds is linear, so that 0 has a place on it."""

_SPREAD = 0.5
"""Width over which the systems of one number of views stand side by side, in views."""


@dataclass(frozen=True)
class _Style:
    colour: str
    marker: str
    dashes: _Dashes
    front: float
    """Place among the systems, from -1/2 to 1/2."""


_Points = dict[str, dict[int, tuple[Cell, bool]]]
"""{system: {number of views: (its numbers, whether it finished every case)}}."""


def write_figures(rows: Sequence[Row], folder: Path) -> list[str]:
    """Draw scores against the number of views.

    Parameters
    ----------
    rows : sequence of Row
        One per system and case.
    folder : Path
        There; files of the same names are replaced.

    Returns
    -------
    list of str
        Names of the files, a .png and a .svg per data set; none for one whose views are not rendered ("2x30"), since
        frames and the X-rays of simulated cases lie at other angles each, or in which no system finished a case.

    Raises
    ------
    InputError
        There are no rows, one lacks a field, or matplotlib is missing.

    """
    check_rows(rows)
    datasets = list(dict.fromkeys(row["dataset"] for row in rows))
    names = []
    for dataset, stem in zip(
        datasets, file_stems([f"figure-{each}-views" for each in datasets]), strict=True
    ):
        figure = draw_curves([row for row in rows if row["dataset"] == dataset])
        if figure is not None:
            names += save(figure, folder, stem, ("png", "svg"))
    return names


def draw_curves(rows: Sequence[Row]) -> Figure | None:
    """The figure of one data set; None when there is nothing to draw."""
    series = _series(rows)
    arcs = sorted({arc for _, arc in series}, key=lambda arc: -arc)
    columns = list(dict.fromkeys(column for column, _ in series))
    if not columns:
        return None
    systems = list(dict.fromkeys(system for points in series.values() for system in points))
    styles = _styles(systems)
    counts = {arc: _counts(series, arc) for arc in arcs}
    widths = [max(counts[arc][-1] - counts[arc][0], 0.7) + 0.8 for arc in arcs]
    legend_rows = -(-len(systems) // 4)
    figure = new_figure(PAGE, 2.0 * len(columns) + 0.2 * legend_rows + 0.6)
    places = figure.subplots(
        len(columns), len(arcs), squeeze=False, width_ratios=widths, sharey="row", sharex="col"
    )
    for row, column in enumerate(columns):
        for number, arc in enumerate(arcs):
            place = places[row, number]
            _draw(place, series.get((column, arc), {}), styles, bars=column.measure == "Dice")
            if row == 0:
                place.set_title(f"over {arc:g} degrees", fontsize=TEXT, color=INK)
        places[row, 0].set_ylabel(_label(column), fontsize=SMALL, color=INK)
    # Limits that a row shares stay as they are once they are set: only when all of it is drawn.
    for row, column in enumerate(columns):
        for number, arc in enumerate(arcs):
            _dress(places[row, number], column, counts[arc], _highest(series, column))
    for place in places[-1]:
        place.set_xlabel("number of X-rays", fontsize=SMALL, color=INK)
    figure.suptitle(_heading(rows), fontsize=TEXT + 1, color=INK, weight="bold")
    _legend(figure, styles, series)
    return figure


def _series(rows: Sequence[Row]) -> dict[tuple[Column, float], _Points]:
    """What is drawn: {(column, arc): points}."""
    series: dict[tuple[Column, float], _Points] = {}
    for table in tables_of(rows):
        parsed = _parsed(table.views)
        if parsed is None:
            continue
        count, arc = parsed
        for column in table.columns:
            if column.measure not in ("Dice", "folds"):
                continue
            for line in table.lines:
                if column.key in line.cells:
                    points = series.setdefault((column, arc), {})
                    points.setdefault(line.system, {})[count] = (
                        line.cells[column.key],
                        _is_whole(line, column.key),
                    )
    order = {key: place for place, key in enumerate(series)}
    return dict(sorted(series.items(), key=lambda item: (item[0][0].measure == "folds", order[item[0]])))


def _parsed(views: str) -> tuple[int, float] | None:
    """Number of views and arc in degrees of a name such as "2x30"; None for any other."""
    found = _VIEWS.fullmatch(views)
    return None if found is None else (int(found[1]), float(found[2]))


def _counts(series: Mapping[tuple[Column, float], _Points], arc: float) -> list[int]:
    """The numbers of views that are drawn over an arc."""
    drawn = [points for (_, other), points in series.items() if other == arc]
    return sorted({count for points in drawn for by_count in points.values() for count in by_count})


def _is_whole(line: Line, key: tuple[str, str, str]) -> bool:
    return line.is_whole and key in line.cells


def _styles(systems: Sequence[str]) -> dict[str, _Style]:
    """Colours, markers and dashes, so that systems differ in print without colours, too."""
    others = [system for system in systems if system not in (OURS, REFERENCE)]
    styles = {}
    for place, system in enumerate(systems):
        front = (place + 0.5) / len(systems) - 0.5
        if system == OURS:
            styles[system] = _Style(COLOURS[0], "o", "-", front)
        elif system == REFERENCE:
            styles[system] = _Style(MUTED, "", "--", front)
        else:
            number = others.index(system)
            styles[system] = _Style(
                COLOURS[1 + number % (len(COLOURS) - 1)],
                _MARKERS[1 + number % (len(_MARKERS) - 1)],
                _DASHES[number // (len(COLOURS) - 1) % len(_DASHES)],
                front,
            )
    return styles


def _draw(place: Axes, points: _Points, styles: Mapping[str, _Style], bars: bool) -> None:
    """Means, and standard deviations as bars, side by side at every number of views."""
    for system, by_count in points.items():
        style = styles[system]
        counts = sorted(by_count)
        across = [count + style.front * _SPREAD for count in counts]
        cells = [by_count[count] for count in counts]
        means = [cell.mean for cell, _ in cells]
        if bars:
            spread = [cell.sd or 0.0 for cell, _ in cells]
            place.errorbar(
                across, means, yerr=spread, fmt="none", ecolor=style.colour, elinewidth=0.6, alpha=0.55
            )
        heavy = system == OURS
        place.plot(
            across,
            means,
            style.dashes,
            color=style.colour,
            linewidth=1.8 if heavy else 1.0,
            zorder=4 if heavy else 3,
        )
        if not style.marker:
            place.plot(across, means, linestyle="none", marker="_", markersize=8, color=style.colour)
            continue
        for x, (cell, whole) in zip(across, cells, strict=True):
            place.plot(
                [x], [cell.mean], marker=style.marker, markersize=5 if heavy else 4, color=style.colour,
                markerfacecolor=style.colour if whole else "#ffffff", linestyle="none", zorder=5 if heavy else 4,
            )  # fmt: skip


def _highest(series: Mapping[tuple[Column, float], _Points], column: Column) -> float:
    """The highest mean in a column, over all arcs."""
    drawn = [points for (other, _), points in series.items() if other == column]
    return max(cell.mean for points in drawn for by_count in points.values() for cell, _ in by_count.values())


def _dress(place: Axes, column: Column, counts: Sequence[int], highest: float) -> None:
    tidy(place)
    place.set_xticks(list(counts))
    place.set_xlim(counts[0] - 0.6, counts[-1] + 0.6)
    place.grid(axis="y", color="#e3e7eb", linewidth=0.6)
    place.set_axisbelow(True)
    if column.measure == "folds":
        place.set_yscale("symlog", linthresh=_LEAST_FOLDS, linscale=0.4)
        place.set_ylim(bottom=-_LEAST_FOLDS / 8, top=max(2 * highest, 10 * _LEAST_FOLDS))
        place.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        place.minorticks_off()
    else:
        place.set_ylim(top=min(place.get_ylim()[1], 1.0) if place.get_ylim()[1] < 1 else 1.005)


def _label(column: Column) -> str:
    if column.measure == "folds":
        return f"folds (% of voxels,\nlinear below {_LEAST_FOLDS:g})"
    return "Dice,\n" + one_line(column.span).replace(", ", ",\n")


def _heading(rows: Sequence[Row]) -> str:
    subjects = len({row["subject"] for row in rows})
    return f"{one_line(rows[0]['dataset'])} ({subjects} {'subject' if subjects == 1 else 'subjects'}; mean, bars: SD)"


def _legend(
    figure: Figure, styles: Mapping[str, _Style], series: Mapping[tuple[Column, float], _Points]
) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D(
            [], [], color=style.colour, linestyle=style.dashes, marker=style.marker or "_", markersize=4.5,
            linewidth=1.8 if system == OURS else 1.0, label=one_line(system),
        )
        for system, style in styles.items()
    ]  # fmt: skip
    if not all(
        whole for points in series.values() for by_count in points.values() for _, whole in by_count.values()
    ):
        handles.append(
            Line2D([], [], color=MUTED, linestyle="none", marker="o", markerfacecolor="#ffffff", markersize=4.5,
                   label="hollow: not finished on every case")
        )  # fmt: skip
    figure.legend(
        handles=handles, loc="outside lower center", ncols=4, fontsize=SMALL, frameon=False, handlelength=2.6
    )
