"""Rows of a benchmark in a results file, with the tables beside it; registrations that make such rows."""

from __future__ import annotations

import argparse
import json
import os
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from benchmark_cases import parse_views
from benchmark_runs import RESULTS, register_command, run_measured
from benchmark_tables import machine

Row = dict[str, Any]
Case = TypeVar("Case")

INTERRUPTED = (130, -2, -15)
"""Exit statuses of a registration that somebody stopped: such a row is not kept, and run again the next time."""

MAKING = threading.Lock()
"""One case is made at a time: each takes a gigabyte while it is."""


class Store:
    """Rows in a results file, written with their tables after every row.

    fields: those that tell one case from another; write: makes the tables from the rows.
    """

    def __init__(self, path: Path, fields: Sequence[str], write: Callable[[list[Row], Path], None]) -> None:
        self.path, self.fields, self.write = path, tuple(fields), write
        self.rows: list[Row] = json.loads(path.read_text())["rows"] if path.is_file() else []

    def row(self, key: Row) -> Row | None:
        """The row with these fields; None when there is none."""
        return next((row for row in self.rows if _matches(row, key)), None)

    def has(self, key: Row) -> bool:
        """Whether there is a row with these fields."""
        return self.row(key) is not None

    def missing(self, keys: Iterable[Row], again: bool) -> list[Row]:
        """Those of the keys that are to be run: without a row, or all when they are run again."""
        return [key for key in keys if again or not self.has(key)]

    def run(
        self, cases: Sequence[Case], jobs: int, make: Callable[[Case], Row], say: Callable[[Row], str]
    ) -> None:
        """Make the rows of cases, so many at a time; put each and say a line about it as it comes."""
        with ThreadPoolExecutor(jobs) as pool:
            for row in pool.map(make, cases):
                self.put(row)
                print(say(row), flush=True)

    def put(self, row: Row) -> None:
        """Add a row in the place of an earlier one of the same case, unless it was interrupted."""
        if row["exit_status"] in INTERRUPTED:
            return
        key = {name: row[name] for name in self.fields}
        self.rows = [each for each in self.rows if not _matches(each, key)] + [row]
        self.path.write_text(json.dumps({"rows": self.rows}, indent=1) + "\n")
        self.write(self.rows, self.path.with_suffix(".md"))


def add_run_arguments(
    parser: argparse.ArgumentParser, seeds: Sequence[int], views: str, limit: float
) -> None:
    """Arguments of a benchmark whose cases are registered one by one; limit: seconds of one registration."""
    parser.add_argument("--seeds", nargs="+", type=int, default=list(seeds))
    parser.add_argument("--views", default=views, metavar="NxARC", help=f"such as {views}, the default")
    parser.add_argument("--pixels", type=int, default=400, help="rows and columns of an X-ray of 430 mm")
    parser.add_argument("--jobs", type=int, default=1, help="registrations at a time")
    parser.add_argument("--threads", type=int, help="of a registration (default: all cores over jobs)")
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--limit", type=float, default=limit, metavar="SECONDS", help="of one registration")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where cases are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--again", action="store_true", help="run rows again that are there already")
    parser.add_argument("--keep", action="store_true", help="keep studies and results in the work folder")


def parsed(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """The arguments, with the folders made; exits when --views is not of the form NxARC."""
    arguments = parser.parse_args()
    try:
        parse_views(arguments.views)
    except ValueError:
        parser.error(
            f"--views {arguments.views}: write the number of views and the arc in degrees, such as 2x60."
        )
    arguments.work.mkdir(parents=True, exist_ok=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    return arguments


def register_row(study: Path, output: Path, arguments: argparse.Namespace, preset: str | None = None) -> Row:
    """Register a study in a process of its own: exit status, seconds, memory, last words, machine and date."""
    threads = arguments.threads or max(1, (os.cpu_count() or 1) // arguments.jobs)
    log = output.with_name(f"{output.name}.log")
    ran = run_measured(
        register_command(study, output, preset, arguments.device, threads), log, arguments.limit
    )
    row: Row = {name: round(ran[name], 1) for name in ("wall_seconds", "cpu_seconds", "peak_memory_mib")}
    row["exit_status"] = ran["exit_status"]
    if ran["exit_status"] != 0:
        folder = study.parent
        said = log.read_text().strip().replace(f"{folder.absolute()}", ".").replace(f"{folder}", ".")
        row["message"] = said[-400:]
    found = machine()
    row["measured_on"] = {name: found[name] for name in ("processor", "cores", "date", "python", "polypose")}
    row["measured_on"]["device"] = arguments.device
    row["measured_on"]["threads"] = threads
    return row


def machines(rows: list[Row]) -> str:
    """The section that says on what and when rows were measured."""
    found: dict[str, int] = {}
    for row in rows:
        on = row["measured_on"]
        text = f"{on['processor']}, {on['cores']} cores, device {on['device']}, {on['date']}"
        found[text] = found.get(text, 0) + 1
    return "## Measured on\n\n" + "\n".join(f"- {text}: {count} rows" for text, count in found.items()) + "\n"


def _matches(row: Row, key: Row) -> bool:
    return all(row.get(name) == value for name, value in key.items())
