"""Tables and the coverage curve of the degraded cases."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from benchmark_store import machines
from benchmark_tables import table
from degraded_scores import (
    coverage,
    false_alarm_percent,
    false_flags,
    is_broken,
    is_false_refusal,
    is_inside,
    silent_failures,
)

from PolyPoseLib.simulation.degradations.registry import DEGRADATIONS

SCALES = np.array([0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0])

CLEAN = "clean"

Row = dict[str, Any]

LEGEND = """\
mean / worst: mean over bones, and largest bone, of the mean distance between where a bone's voxels are found and where
they are, in mm, by the bone's own pose, over the seeds that gave a result; the anchor is left out. x clean: mean over
that of the same case without a fault. exit: statuses (0 trusted, 2 refused, 3 distrusted). flagged: bones of which a
warning says not to rely on them. inside: bones whose pose lies inside the stated 95 % region. silent: bones off by more
than 3 mm at exit 0, neither flagged nor inside. alarms: bones within 1.5 mm that are flagged, plus recoverable cases
refused, or distrusted although right. small_bones has a quarter of the size and of these limits; its lengths are shown
as they are. A star marks kinds in whose inputs the information needed is still there.
"""


def write_degraded_tables(rows: list[Row], path: Path) -> None:
    """Write the totals, a table an anatomy, the coverage curve, and the machines; a plot beside them if possible."""
    parts = ["# Degraded X-rays and inputs\n", totals(rows), LEGEND]
    for anatomy in dict.fromkeys(row["anatomy"] for row in rows):
        parts += [f"## {anatomy}\n", kinds_table([row for row in rows if row["anatomy"] == anatomy])]
    parts += ["## Coverage against the stated interval\n", coverage_table(rows), machines(rows)]
    path.write_text("\n".join(parts), encoding="utf-8")
    _plot(rows, path.with_name(f"{path.stem}_coverage.png"))


def totals(rows: list[Row]) -> str:
    """The numbers that matter, over all rows."""
    failures = [(row, name) for row in rows for name in silent_failures(row)]
    flags = sum(len(false_flags(row)) for row in rows)
    refusals = sum(is_false_refusal(row) for row in rows)
    recoverable = sum(row["recoverable"] for row in rows)
    return table(
        [
            "cases",
            "silent failures",
            "in cases",
            "false flags",
            "% of right bones",
            "false refusals",
            "of",
            "broken",
        ],
        [
            [
                str(len(rows)),
                str(len(failures)),
                str(len({id(row) for row, _ in failures})),
                str(flags),
                f"{false_alarm_percent(rows):.1f}",
                str(refusals),
                str(recoverable),
                str(sum(is_broken(row) for row in rows)),
            ]
        ],
    )


def kinds_table(rows: list[Row]) -> str:
    """One line a kind, over its seeds."""
    lines = []
    for kind in [CLEAN, *DEGRADATIONS]:
        mine = [row for row in rows if row["kind"] == kind]
        if not mine:
            continue
        bones = [bone for row in mine for bone in row.get("bones", {}).values()]
        mark = "*" if mine[0]["recoverable"] else ""
        statuses = [row["exit_status"] for row in mine]
        exits = ", ".join(
            f"{s}" + (f" x {statuses.count(s)}" if len(mine) > 1 else "") for s in sorted(set(statuses))
        )
        lines.append(
            [
                kind + mark,
                _millimetres(bones),
                _against_clean(mine, rows),
                exits,
                f"{sum(bone['flagged'] for bone in bones)}/{len(bones)}",
                f"{sum(is_inside(bone) for bone in bones)}/{len(bones)}",
                str(sum(len(silent_failures(row)) for row in mine)),
                str(sum(len(false_flags(row)) + is_false_refusal(row) for row in mine)),
            ]
        )
    return table(
        ["kind", "mean / worst mm", "x clean", "exit", "flagged", "inside", "silent", "alarms"], lines
    )


def coverage_table(rows: list[Row]) -> str:
    """Percent of bones inside s times the stated region."""
    chosen = {
        "all": rows,
        "clean": [row for row in rows if row["kind"] == CLEAN],
        "recoverable": [row for row in rows if row["recoverable"]],
        "not recoverable": [row for row in rows if not row["recoverable"]],
    }
    lines = []
    for title, some in chosen.items():
        for flagged, what in ((True, "all bones"), (False, "not flagged")):
            shares = coverage(some, SCALES, flagged)
            lines.append([title, what, *(f"{share:.0f}" if np.isfinite(share) else "-" for share in shares)])
    return table(["cases", "bones", *(f"{scale:g}" for scale in SCALES)], lines)


def describe(row: Row) -> str:
    """One line about a row."""
    bones = list(row.get("bones", {}).values())
    silent = ", ".join(silent_failures(row))
    return (
        f"{row['anatomy']} seed {row['seed']} {row['kind']}: exit {row['exit_status']}, {_millimetres(bones)} mm"
        + (f", silent: {silent}" if silent else "")
        + f", {row['wall_seconds']:.0f} s"
    )


def _millimetres(bones: list[dict[str, Any]]) -> str:
    """Mean and worst error."""
    errors = [bone["tre_mean_mm"] for bone in bones]
    return f"{np.mean(errors):.2f} / {np.max(errors):.2f}" if errors else "-"


def _against_clean(mine: list[Row], rows: list[Row]) -> str:
    """Mean error over that of the clean cases of the same seeds, relative to the size."""
    ratios = []
    for row in mine:
        clean = [
            r for r in rows if r["kind"] == CLEAN and r["seed"] == row["seed"] and r["views"] == row["views"]
        ]
        if clean and row.get("bones") and clean[0].get("bones"):
            ratios.append(_mean_error(row) / row["size_factor"] / _mean_error(clean[0]))
    return f"{np.mean(ratios):.1f}" if ratios else "-"


def _mean_error(row: Row) -> float:
    return float(np.mean([bone["tre_mean_mm"] for bone in row["bones"].values()]))


def _plot(rows: list[Row], path: Path) -> None:
    """Coverage against s; nothing when matplotlib is not installed."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    scales = np.linspace(0.1, 6, 60)
    figure = Figure(figsize=(5.5, 4), layout="constrained")
    axes = figure.subplots()
    for flagged, what in ((True, "all bones"), (False, "bones that are not flagged")):
        axes.plot(scales, coverage(rows, scales, flagged), label=what)
    axes.axhline(95, color="0.6", lw=0.8)
    axes.axvline(1, color="0.6", lw=0.8)
    axes.set(xlabel="s", ylabel="% inside s times the stated 95 % region", ylim=(0, 101), xlim=(0, 6))
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=110)
