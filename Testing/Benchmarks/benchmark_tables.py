"""Tables in Markdown from a benchmark's rows, with the machine they were measured on."""

from __future__ import annotations

import datetime
import importlib.metadata
import os
import platform
from collections.abc import Iterable
from pathlib import Path

import numpy as np

COLUMNS = (
    ("mean TRE mm", lambda row: row["summary"]["mean_tre_mm"], "{:.2f}"),
    ("worst TRE mm", lambda row: row["summary"]["worst_tre_mm"], "{:.2f}"),
    ("pose TRE mm", lambda row: row["summary"]["mean_pose_tre_mm"], "{:.2f}"),
    ("bone Dice", lambda row: row["summary"]["mean_dice"], "{:.3f}"),
    ("HD95 mm", lambda row: moving_mean(row, "hd95_mm"), "{:.2f}"),
    ("organ Dice", lambda row: row["summary"]["organ_dice"], "{:.3f}"),
    ("soft mm", lambda row: row["summary"]["soft_error_mean_mm"], "{:.2f}"),
    ("folds %", lambda row: row["summary"]["folds_percent"], "{:.4f}"),
    ("SD log J", lambda row: row["summary"]["sd_log_jacobian"], "{:.3f}"),
    ("camera mm", lambda row: np.mean([c["projection_mean_mm"] for c in row["cameras"]]), "{:.2f}"),
    ("camera deg", lambda row: np.mean([c["rotation_deg"] for c in row["cameras"]]), "{:.2f}"),
    ("CPU s", lambda row: row.get("cpu_seconds", 0.0), "{:.0f}"),
    ("MiB", lambda row: row["peak_memory_mib"], "{:.0f}"),
)
"""Column, its number for one row, and how it is written."""


INTERVALS = (
    ("pose", "whole pose (6 numbers)"),
    ("along", "place along the view"),
    ("across_1", "place across"),
    ("across_2", "place across"),
    ("turn_about_view", "turn about the view"),
    ("turn_across_1", "turn across"),
    ("turn_across_2", "turn across"),
)
"""Interval ratios of a score, and what the table calls them."""


def machine() -> dict[str, str]:
    """What the numbers were measured on."""
    versions = {}
    for package in ("polypose", "torch", "numpy", "scipy", "SimpleITK", "numba", "itk-rtk"):
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "absent"
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
        "python": platform.python_version(),
        "date": datetime.date.today().isoformat(),
        **versions,
    }


def write_tables(rows: list[dict], path: Path, law: str) -> None:
    """One table per anatomy and set of views, one per structure, and the machine; law: of the truths' soft tissue."""
    parts = ["# Accuracy on independent truths\n", f"Soft tissue of the truths follows {law}.\n", _legend()]
    for anatomy, views, pixels in _unique((row["anatomy"], row["views"], row["pixels"]) for row in rows):
        chosen = [
            row for row in rows if (row["anatomy"], row["views"], row["pixels"]) == (anatomy, views, pixels)
        ]
        count, arc = views.split("x")
        parts.append(f"## {anatomy}, {count} views over {arc} degrees, {pixels} x {pixels} pixels\n")
        parts += [_modes(chosen), _structures(chosen)]
    parts += [calibration(rows), measured_on(machine())]
    path.write_text("\n".join(parts), encoding="utf-8")


def calibration(rows: list[dict]) -> str:
    """How often the error of a moving bone lay inside its 95 % interval, in the default mode."""
    lines = []
    groups = _unique((row["anatomy"], row["views"]) for row in rows)
    for group in [*groups, None]:
        found = [
            structure["interval_ratios"]
            for row in rows
            if row["mode"] == "default"
            and "failed" not in row
            and group in (None, (row["anatomy"], row["views"]))
            for structure in row["structures"].values()
            if "interval_ratios" in structure
        ]
        if not found:
            continue
        shares = [100 * np.mean([ratios[name] <= 1 for ratios in found]) for name, _ in INTERVALS]
        title = "all" if group is None else " ".join(group)
        lines.append([title, str(len(found)), *(f"{share:.0f}" for share in shares)])
    if not lines:
        return ""
    head = ["case", "bones", *(title for _, title in INTERVALS)]
    return "## Percent of true poses inside their 95 % interval (default mode)\n\n" + table(head, lines)


_WORDS = {"date": "latest rows"}
"""Of what ``machine`` holds: rows that were kept are older."""


def measured_on(found: dict[str, str]) -> str:
    """The section with the machine, the versions and the date, which is that of the latest rows."""
    lines = [f"- {_WORDS.get(name, name)}: {value}" for name, value in found.items()]
    return "## Measured on\n\n" + "\n".join(lines) + "\n"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table."""
    head = list(head)
    return "\n".join(_line(cells) for cells in (head, ["---"] * len(head), *rows)) + "\n"


def mean_rows(groups: Iterable[tuple[str, list[dict]]], sd: bool = False) -> list[list[str]]:
    """Cells of COLUMNS per group of rows: means over them (the worst TRE is the worst of all).

    sd: mean(SD) over them instead, n - 1, in every column, so that the worst TRE is a mean of worst ones; the mean
    alone where one row has a number.
    """
    lines = []
    for name, rows in groups:
        scored = [row for row in rows if "failed" not in row]
        failed = len(rows) - len(scored)
        cells = [name, f"{len(scored)}" + (f" ({failed} failed)" if failed else "")]
        for column, number, form in COLUMNS:
            values = np.array([number(row) for row in scored], dtype=float)
            values = values[np.isfinite(values)]
            reduce = np.max if column.startswith("worst") and not sd else np.mean
            cell = form.format(reduce(values)) if len(values) else "-"
            cells.append(f"{cell}({form.format(np.std(values, ddof=1))})" if sd and len(values) > 1 else cell)
        lines.append(cells)
    return lines


def moving_mean(row: dict, key: str) -> float:
    """Mean over the structures that move."""
    values = [s[key] for s in row["structures"].values() if s["rest_tre_mean_mm"] > 1e-6]
    return float(np.mean(values)) if values else float("nan")


def _modes(rows: list[dict]) -> str:
    """Modes as rows, means over seeds."""
    groups = [
        (mode, [row for row in rows if row["mode"] == mode]) for mode in _unique(r["mode"] for r in rows)
    ]
    return table(["mode", "seeds", *(name for name, _, _ in COLUMNS)], mean_rows(groups))


def _structures(rows: list[dict]) -> str:
    """Structures as rows, mean and worst mean TRE over the seeds, per mode."""
    modes = _unique(row["mode"] for row in rows if "failed" not in row)
    names = _unique(name for row in rows if "failed" not in row for name in row["structures"])
    lines = []
    for name in names:
        cells = [name]
        for mode in modes:
            values = [
                row["structures"][name]["tre_mean_mm"]
                for row in rows
                if row["mode"] == mode and "failed" not in row
            ]
            cells.append(f"{np.mean(values):.2f} ({np.max(values):.2f})")
        lines.append(cells)
    return table(["TRE mm: mean (worst seed)", *modes], lines)


def _legend() -> str:
    """What the columns mean."""
    return (
        "Means over seeds. TRE: distance between where the true and the found transform take a structure's voxels, "
        "mean over structures that move; worst: the largest mean of any structure and seed; pose TRE: of the "
        "structures' own rigid motions; soft: the transform's error in the body outside all structures; camera: "
        "error of the anchor's projected points in the plane through each, and of the rotation. still: nothing "
        "done; rigid: all bones but the anchor as one body; ..._true_cameras: a preset with the true cameras given. "
        "CPU s: of all threads, loading and saving included.\n"
    )


def _line(cells: Iterable[str]) -> str:
    """One row of a table."""
    return "| " + " | ".join(cells) + " |"


def _unique(values: Iterable) -> list:
    """Each value once, in the order of appearance."""
    return list(dict.fromkeys(values))


def _processor() -> str:
    """The processor's name."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
