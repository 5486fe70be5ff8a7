"""Tables and plots of the ablations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
from ablation_cases import TITLES, Point, Settings, points, settings_of
from benchmark_tables import COLUMNS, machine, mean_rows, measured_on, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TITLE_LETTERS = 38
"""In a line of a plot's title; longer ones run into the next plot's."""

NOTES = {
    "representation": (
        "Systems of `polypose benchmark` on the same study, CT and labels, all with the true cameras: one rigid motion "
        "a bone and soft tissue that follows (the method as it is, its intervals left out), a displacement at every "
        "node of a grid, and a rigid motion at every node. The dense systems have no poses of bones, take X-rays of "
        "about 180 pixels and run their published number of iterations unless another is named. CPU s and MiB are of "
        "the whole process, reading the study included."
    ),
    "weights": (
        "The weights shape the smooth warp: soft tissue, folds, and how far bones stay rigid within it (TRE and Dice "
        "are of the warp, pose TRE is of the bones' own motions). In the preset paper the warped CT is what is "
        "compared with the X-rays, so there they move the bones as well; in the presets default and fast bones are "
        "rendered rigidly, and the weights reach them only through the soft tissue behind them. m is a structure's "
        "share of the volume, d its distance in mm, measured at the X-rays' posture (fixed) or carried along by the "
        "bone (moving)."
    ),
    "rotation_falloff": (
        "Further off, tissue takes the displacement of the bone's centroid without its rotation. The truth's law is "
        "another one (Laplace's equation)."
    ),
    "structures": (
        "Bones fused in the study only; the truth moves all of them, and each is scored by the motion of the "
        "structure that it was fused into."
    ),
    "erosion": (
        "Labels of all structures eroded in the study only; the truth stays. In brackets the share of the voxels "
        "that is left (a structure keeps at least its deepest tenth)."
    ),
    "views": "",
    "angle": "",
    "noise": "Expected count per pixel of the unattenuated beam; scatter, blur, saturation and 12 bits stay.",
}

CURVES: tuple[tuple[str, Callable[[dict], float], str, str], ...] = (
    ("bones, mean TRE", lambda row: row["summary"]["mean_tre_mm"], "#2166ac", "o"),
    ("worst bone, TRE", lambda row: row["summary"]["worst_tre_mm"], "#b2182b", "^"),
    ("soft tissue, mean error", lambda row: row["summary"]["soft_error_mean_mm"], "#4d9221", "s"),
)
"""Name, number, colour and marker of what is plotted, in mm."""

LOGARITHMIC = ("noise",)
UNORDERED = ("representation", "weights")
WEIGHT_PRESETS = ("default", "fast", "paper")


def write_tables(rows: list[dict], preset: str, path: Path) -> None:
    """One table per anatomy and study, and the machine."""
    parts = [
        "# Ablations\n",
        "Cases with an independent truth: two views 30 degrees apart unless the table says otherwise; mean(SD) "
        "over seeds (n - 1), the mean alone for one seed. TRE: of the transform over a structure's voxels, mean over "
        "moving structures; worst: of the structure with the largest; pose TRE: of the structures' own rigid motions; "
        f"soft: the transform's error in the body outside all structures. Preset {preset} unless the table says "
        "otherwise.\n",
    ]
    for anatomy, pixels in _cases(rows):
        for study, title in TITLES.items():
            groups = _groups(rows, study, anatomy, pixels, preset)
            if not groups:
                continue
            parts.append(f"## {title} ({anatomy}, {pixels} x {pixels} pixels)\n")
            parts += [NOTES[study] + "\n"] if NOTES[study] else []
            named = [(_label(study, point, chosen), chosen) for point, chosen in groups]
            parts.append(
                table([study, "seeds", *(name for name, _, _ in COLUMNS)], mean_rows(named, sd=True))
            )
    parts.append(measured_on(machine()))
    path.write_text("\n".join(parts), encoding="utf-8")


def plot(rows: list[dict], preset: str, path: Path) -> None:
    """One panel per anatomy and study: means over seeds, bars from the best to the worst seed."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    panels = [
        (anatomy, study, groups)
        for anatomy, pixels in _cases(rows)
        for study in TITLES
        if (groups := _groups(rows, study, anatomy, pixels, preset))
    ]
    if not panels:
        return
    lines = -(-len(panels) // 3)
    figure = Figure(figsize=(13.5, 3.9 * lines + 0.7), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(lines, 3, squeeze=False).ravel()
    for axis, (anatomy, study, groups) in zip(axes, panels, strict=False):
        _panel(axis, study, groups)
        axis.set_title(fill(f"{TITLES[study]} ({anatomy})", TITLE_LETTERS), fontsize=10, loc="left")
    for axis in axes[len(panels) :]:
        axis.set_axis_off()
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=len(CURVES), frameon=False)
    found = machine()
    figure.suptitle(
        f"Error in mm; preset {preset} unless named; {found['processor']}, {found['date']}", fontsize=9
    )
    figure.savefig(path, dpi=110)


def _panel(axis: Axes, study: str, groups: list[tuple[Point, list[dict]]]) -> None:
    """One study's curves; lines that have no order are not joined."""
    place = np.array([point.position for point, _ in groups], dtype=float)
    if study in UNORDERED:
        place = np.arange(len(groups), dtype=float)
    highest = 0.0
    for name, number, colour, marker in CURVES:
        values = [
            np.array([number(row) for row in chosen if "failed" not in row] or [np.nan])
            for _, chosen in groups
        ]
        mean = np.array([v.mean() for v in values])
        low, high = (np.array([pick(v) for v in values]) for pick in (np.min, np.max))
        highest = max(highest, np.nanmax(high, initial=0))
        style = {"color": colour, "marker": marker, "markersize": 4.5, "label": name, "capsize": 2}
        spread = [mean - low, high - mean]
        if study in UNORDERED:
            axis.errorbar(mean, place, xerr=spread, linestyle="none", **style)
        else:
            axis.errorbar(place, mean, yerr=spread, linewidth=1.4, elinewidth=0.8, **style)
    axis.spines[["top", "right"]].set_visible(False)
    axis.tick_params(labelsize=8)
    limit = 1.08 * highest if highest > 0 else 1.0
    if study in UNORDERED:
        axis.set_yticks(place, [point.label for point, _ in groups], fontsize=7)
        axis.invert_yaxis()
        axis.set_xlim(0, limit)
        axis.grid(axis="both", color="0.92", linewidth=0.8)
        axis.set_xlabel("mm", fontsize=8)
        return
    axis.set_ylim(0, limit)
    axis.grid(axis="y", color="0.92", linewidth=0.8)
    axis.set_ylabel("mm", fontsize=8)
    if study in LOGARITHMIC:
        axis.set_xscale("log")
    elif study == "rotation_falloff":
        axis.set_xticks(place, [point.label for point, _ in groups])
    else:
        axis.set_xticks(place)


def _cases(rows: list[dict]) -> list[tuple[str, int]]:
    """Anatomies and image sizes that there are rows of."""
    return list(dict.fromkeys((row["settings"]["anatomy"], row["settings"]["pixels"]) for row in rows))


def _groups(
    rows: list[dict], study: str, anatomy: str, pixels: int, preset: str
) -> list[tuple[Point, list[dict]]]:
    """A study's lines that there are rows of, each with its rows of all seeds that another line has as well.

    The usual case belongs to all studies, and may have been run with seeds of which this one has nothing to compare.
    """
    groups = []
    iterations = sorted({Settings.of(row).iterations or 0 for row in rows})
    for point in points(study, anatomy, WEIGHT_PRESETS, [number or None for number in iterations]):
        wanted = settings_of(point, Settings(anatomy, 0, pixels, preset)).key()
        chosen = [row for row in rows if Settings.of(row).key() | {"seed": 0} == wanted]
        if chosen:
            groups.append((point, chosen))
    lines = Counter(Settings.of(row).seed for _, chosen in groups for row in chosen)
    compared = [
        (point, [row for row in chosen if lines[Settings.of(row).seed] > 1]) for point, chosen in groups
    ]
    return [(point, chosen) for point, chosen in compared if chosen]


def _label(study: str, point: Point, rows: list[dict]) -> str:
    """A line's name, with what erosion left."""
    if study != "erosion":
        return point.label
    return f"{point.label} ({np.mean([row['kept_percent'] for row in rows]):.0f} %)"
