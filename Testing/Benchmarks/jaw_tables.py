"""Tables of the benchmark of a mouth that opens: mean and standard deviation over the seeds, and one line a seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from benchmark_store import Row, machines
from benchmark_tables import table
from degraded_scores import FAILED_MM, is_inside, silent_failures
from jaw_anatomy import MANDIBLE
from jaw_teeth import ENAMEL_HU, FORMS

LEGEND = f"""\
Of the mandible the head CT has the rami with their condyles and coronoid processes, and neither teeth nor body: it ends
within the crowns of the upper teeth. "completed" has these mirrored below as the lower row, so that both rows touch;
"scanned" is the CT as it is. Atlas and axis are left out of the structures, so they follow as soft tissue. The cameras
start 4 degrees and 15 mm off. Views 2x30: from the front, and from 30 degrees to the patient's left.

Mean (standard deviation) over the seeds. TRE: mean distance between where the mandible's voxels are found and where
they are, by its own pose; rest: of doing nothing. angle: between the mandible's found and true orientation; opening:
found less true angle of opening. interval: half widths of the stated 95 % interval along the view and across; inside:
poses within their stated 95 % region. silent: off by more than {FAILED_MM:g} mm at exit 0, neither flagged nor inside.
camera: of the means over the views, the error of the skull's projected points in the plane through each, of the
rotation, and of its depth along the view. soft: the transform's error in the body outside the bones.
"""

TEETH_LEGEND = f"""\
Voxels of at least {ENAMEL_HU:g} HU in the mouth, mostly crowns. ratio: their volume over that in the CT at rest; Dice:
against the truth; extra: more than a voxel away from any in the truth (a third row of teeth, or teeth drawn out);
missing: in the truth, and none within a voxel. paper: the published average with weights of the CT's frame; smooth: the
default warp; composed: bones laid rigidly over it. By the poses that were found and by the true ones.
"""

Kind = tuple[str, str, int]
"""Lower row, views, pixels."""


def write_tables(rows: list[Row], path: Path) -> None:
    """Tables of every kind of case, and the machines."""
    parts = ["# A mouth that opens\n", LEGEND]
    for kind in dict.fromkeys(_kind(row) for row in rows):
        mine = [row for row in rows if _kind(row) == kind]
        lower, views, pixels = kind
        parts.append(f"## {lower}, views {views}, {pixels} x {pixels} pixels\n")
        parts += [_registrations(mine), _seeds(mine)]
        if any("teeth" in row for row in mine):
            parts += [f"### Teeth ({lower}, views {views})\n", TEETH_LEGEND, _teeth(mine)]
    path.write_text("\n".join([*parts, machines(rows)]), encoding="utf-8")


def describe(row: Row) -> str:
    """One line about a row."""
    named = zip(_HEAD[1:], _cells(row["degrees"], [row])[1:], strict=True)
    return f"{row['lower']} seed {row['seed']} {row['degrees']:g} degrees: " + ", ".join(
        f"{name} {cell}" for name, cell in named
    )


def mean_sd(values: Iterable[float], digits: int = 2) -> str:
    """Mean (standard deviation of the sample) of numbers; without the latter for one, "-" for none."""
    found = np.array([value for value in values if value is not None], dtype=float)
    if not len(found):
        return "-"
    if len(found) == 1:
        return f"{found[0]:.{digits}f}"
    return f"{found.mean():.{digits}f} ({found.std(ddof=1):.{digits}f})"


def _kind(row: Row) -> Kind:
    return row["lower"], row["views"], row["pixels"]


def _by_degrees(rows: list[Row]) -> list[tuple[float, list[Row]]]:
    """Rows of each opening, the least first."""
    return [
        (degrees, [row for row in rows if row["degrees"] == degrees])
        for degrees in sorted({row["degrees"] for row in rows})
    ]


_HEAD = (
    "degrees",
    "seeds",
    "rest mm",
    "TRE mm",
    "worst mm",
    "angle deg",
    "opening deg",
    "interval mm",
    "inside",
    "silent",
    "flagged",
    "exit",
    "camera mm / deg / depth mm",
    "soft mm",
    "CPU s",
)


def _registrations(rows: list[Row]) -> str:
    """One line an opening."""
    return table(_HEAD, [_cells(degrees, mine) for degrees, mine in _by_degrees(rows)])


def _cells(degrees: float, rows: list[Row]) -> list[str]:
    """One line of the table: an opening over its seeds."""
    done = [row for row in rows if "bones" in row]
    bones = [row["bones"][MANDIBLE] for row in done]
    statuses = [row["exit_status"] for row in rows]
    along, across = (mean_sd((bone[name] for bone in bones), 1) for name in ("along_mm", "across_mm"))
    return [
        f"{degrees:g}",
        str(len(rows)),
        mean_sd(bone["rest_mm"] for bone in bones),
        mean_sd(bone["tre_mean_mm"] for bone in bones),
        f"{max(bone['tre_mean_mm'] for bone in bones):.2f}" if bones else "-",
        mean_sd(row["angle_deg"] for row in done),
        mean_sd(row["opening_error_deg"] for row in done),
        f"{along} / {across}",
        f"{sum(is_inside(bone) for bone in bones)} of {len(bones)}",
        str(sum(len(silent_failures(row)) for row in rows)),
        str(sum(bone["flagged"] for bone in bones)),
        ", ".join(f"{status} x {statuses.count(status)}" for status in sorted(set(statuses))),
        " / ".join(_camera(done, n) for n in range(3)),
        mean_sd(row["soft_mm"] for row in done),
        f"{np.mean([row['cpu_seconds'] for row in rows]):.0f}",
    ]


def _camera(rows: list[Row], number: int) -> str:
    """One of the cameras' errors, over the seeds, of the means over the views."""
    return mean_sd(float(np.mean([abs(view[number]) for view in row["cameras"]])) for row in rows)


def _seeds(rows: list[Row]) -> str:
    """One line a row: what the means hide."""
    lines = []
    for row in sorted(rows, key=lambda row: (row["degrees"], row["seed"])):
        cells = _cells(row["degrees"], [row])
        lines.append([cells[0], str(row["seed"]), *cells[2:]])
    return table(("degrees", "seed", *_HEAD[2:]), lines)


def _teeth(rows: list[Row]) -> str:
    """One line an opening and form."""
    numbers = ("volume_ratio", "dice", "extra_ml", "missing_ml")
    lines = []
    for degrees, mine in _by_degrees(rows):
        found = [row["teeth"] for row in mine if "teeth" in row]

        def cells(of: Callable[[dict], dict], found: list[dict] = found) -> list[str]:
            return [mean_sd(of(each)[name] for each in found) for name in numbers]

        lines.append([f"{degrees:g}", "truth", "", *cells(lambda each: each["truth"])])
        for whose in ("found", "true"):
            for form in FORMS:
                lines.append([f"{degrees:g}", form, whose, *cells(lambda each, w=whose, f=form: each[w][f])])
    return table(["degrees", "form", "poses", "ratio", "Dice", "extra ml", "missing ml"], lines)
