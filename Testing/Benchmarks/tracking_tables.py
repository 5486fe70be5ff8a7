"""Tables of the benchmark of tracking."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from benchmark_store import Row, machines
from benchmark_tables import table

LEGEND = """\
RMS and worst over all frames and bones: mm at a bone's centroid / over its surface, and degrees. lost: poses without a
fit of their own; silent: poses more than 2 mm off without a flag and outside their 95 % ellipsoid. coverage: percent of
the six numbers of every pose inside their 95 % interval, and of whole poses inside their ellipsoid. beam: RMS of the
error along the beam of the first view, and percent of it inside its interval; plane: RMS across it. CPU s a frame: of
all threads, whole run without the start; loop: of one registration.
"""


def write_tables(rows: list[Row], path: Path, says: Mapping[str, str]) -> None:
    """One line a row, and one of all seeds, for every case and method; says: what each case is."""
    parts = ["# Tracking\n", LEGEND]
    kinds = dict.fromkeys((row["case"], row["method"], row["frames"], row["pixels"]) for row in rows)
    for kind in kinds:
        mine = [row for row in rows if tuple(row[n] for n in ("case", "method", "frames", "pixels")) == kind]
        case, method, frames, pixels = kind
        parts.append(f"## {case}, {method}: {says[case]}; {frames} frames, {pixels} x {pixels} pixels\n")
        head = ["seed", "RMS mm / surface / deg", "worst mm / surface / deg", "lost", "flagged", "silent"]
        head += ["coverage % each / whole", "beam mm, inside %", "plane mm", "CPU s a frame", "MiB"]
        lines = [_cells(str(row["seed"]), [row]) for row in sorted(mine, key=lambda row: row["seed"])]
        parts.append(table(head, lines + ([_cells("all", mine)] if len(mine) > 1 else [])))
        names = dict.fromkeys(name for row in mine for name in row.get("bones", {}))
        by_bone = [
            _cells(
                name,
                [row | {"bones": {name: row["bones"][name]}} for row in mine if name in row.get("bones", {})],
            )
            for name in names
        ]
        parts.append(table(["bone", *head[1:]], by_bone))
    path.write_text("\n".join([*parts, machines(rows)]), encoding="utf-8")


def describe(row: Row) -> str:
    """One line about a row."""
    return f"{row['case']} {row['method']} seed {row['seed']}: " + ", ".join(_cells("", [row])[1:])


def _cells(title: str, rows: list[Row]) -> list[str]:
    """One line of a table over rows and all their bones."""
    bones = [bone for row in rows for bone in row.get("bones", {}).values()]
    if not bones:
        return [title, *["-"] * 10]

    def rms(name: str) -> float:
        return float(np.sqrt(np.mean(np.concatenate([bone[name] for bone in bones]) ** 2.0)))

    def worst(name: str) -> float:
        return float(np.max(np.concatenate([bone[name] for bone in bones])))

    names = ("mm", "surface_mm", "deg")
    each = 100 * np.mean([bone["inside_each"] for bone in bones])
    whole, along = (100 * np.mean([bone[name] for bone in bones]) for name in ("inside", "inside_along"))
    interval = np.mean([bone["along_interval_mm"] for bone in bones])
    return [
        title,
        " / ".join(f"{rms(name):.2f}" for name in names),
        " / ".join(f"{worst(name):.2f}" for name in names),
        *(str(sum(bone[name] for bone in bones)) for name in ("lost", "doubtful", "silent")),
        f"{each:.0f} / {whole:.0f}",
        f"{rms('along_mm'):.2f} (+-{interval:.2f}), {along:.0f}",
        f"{rms('across_mm'):.2f}",
        f"{np.mean([row['seconds_a_frame'] for row in rows]):.2f}",
        f"{np.max([row['peak_memory_mib'] for row in rows]):.0f}",
    ]
