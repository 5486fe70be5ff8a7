"""Degraded, clinic-like X-rays and inputs: right, or honestly refused?

Each case is simulated as in accuracy.py, then degraded by one kind of PolyPoseLib.simulation.degradations, written as a
study, and registered as a process of its own, the way a user does it. Counted are silent failures (a bone off by more
than 3 mm that is neither flagged nor inside its interval, at exit 0) and false alarms (a bone within 1.5 mm that is
called inconsistent; a recoverable case refused, or distrusted although its bones are right).

    python Testing/Benchmarks/degraded.py --anatomy pelvis --seeds 0
    python Testing/Benchmarks/degraded.py --pictures

Rows that are in the results file already are not run again unless --again is given.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmark_cases import STRUCTURES, parse_views
from benchmark_runs import RESULTS, register_command, run_measured
from benchmark_tables import machine
from degraded_cases import CLEAN, covered_shares, degraded_case, structures_of
from degraded_pictures import write_pictures
from degraded_scores import score_folder
from degraded_tables import describe, write_degraded_tables

from PolyPoseLib.io.degraded_cases import degraded_truth, write_degraded_study
from PolyPoseLib.simulation.degradations.registry import DEGRADATIONS

NAME = "degraded"

INTERRUPTED = (130, -2, -15)
"""Exit statuses of a registration that somebody stopped: such a row is not kept, and run again the next time."""

_MAKING = threading.Lock()
"""One case is made at a time: each takes a gigabyte while it is."""


def main() -> int:
    """Run what is missing and write the tables after every row."""
    arguments = parse_arguments()
    arguments.work.mkdir(parents=True, exist_ok=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    if arguments.pictures:
        for anatomy in arguments.anatomy:
            path = arguments.output / f"{NAME}_{anatomy}.png"
            write_pictures(
                anatomy, arguments.views, arguments.seeds[0], arguments.pixels, arguments.kinds, path
            )
            print(path)
        return 0
    store = Store(arguments.output / f"{NAME}.json")
    for anatomy in arguments.anatomy:
        for seed in arguments.seeds:
            keys = [
                {
                    "kind": kind,
                    "anatomy": anatomy,
                    "views": arguments.views,
                    "seed": seed,
                    "pixels": arguments.pixels,
                }
                for kind in [CLEAN, *arguments.kinds]
            ]
            missing = [key for key in keys if arguments.again or not store.has(key)]
            with ThreadPoolExecutor(arguments.jobs) as pool:
                for row in pool.map(lambda key: run_row(key, arguments), missing):
                    if row["exit_status"] not in INTERRUPTED:
                        store.put(row)
                    print(describe(row), flush=True)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kinds", nargs="+", choices=tuple(DEGRADATIONS), default=list(DEGRADATIONS))
    parser.add_argument("--anatomy", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--views", default="2x60", metavar="NxARC", help="such as 2x60, the default")
    parser.add_argument("--pixels", type=int, default=400, help="rows and columns of an X-ray of 430 mm")
    parser.add_argument("--jobs", type=int, default=1, help="registrations at a time")
    parser.add_argument("--threads", type=int, help="of a registration (default: all cores over jobs)")
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--limit", type=float, default=3600, metavar="SECONDS", help="of one registration")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where cases are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--again", action="store_true", help="run rows again that are there already")
    parser.add_argument("--keep", action="store_true", help="keep studies and results in the work folder")
    parser.add_argument(
        "--pictures", action="store_true", help="write a sheet with every kind, and run nothing"
    )
    arguments = parser.parse_args()
    try:
        parse_views(arguments.views)
    except ValueError:
        parser.error(
            f"--views {arguments.views}: write the number of views and the arc in degrees, such as 2x60."
        )
    return arguments


class Store:
    """Rows in a results file, and the tables beside it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: list[dict[str, Any]] = json.loads(path.read_text())["rows"] if path.is_file() else []

    def has(self, key: dict[str, Any]) -> bool:
        """Whether there is a row with these fields."""
        return any(_matches(row, key) for row in self.rows)

    def put(self, row: dict[str, Any]) -> None:
        """Add a row in the place of an earlier one of the same case."""
        key = {name: row[name] for name in ("kind", "anatomy", "views", "seed", "pixels")}
        self.rows = [each for each in self.rows if not _matches(each, key)] + [row]
        self.path.write_text(json.dumps({"rows": self.rows}, indent=1) + "\n")
        write_degraded_tables(self.rows, self.path.with_suffix(".md"))


def run_row(key: dict[str, Any], arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate, degrade, register, score."""
    kind, anatomy = key["kind"], key["anatomy"]
    folder = arguments.work / NAME / "-".join(str(value) for value in key.values())
    shutil.rmtree(folder, ignore_errors=True)
    with _MAKING:
        degraded = degraded_case(anatomy, key["views"], key["seed"], key["pixels"], kind)
        study = write_degraded_study(degraded, folder, structures_of(anatomy))
        truth, covered = degraded_truth(degraded), covered_shares(degraded)
    threads = arguments.threads or max(1, (os.cpu_count() or 1) // arguments.jobs)
    log = folder / "log.txt"
    command = register_command(study, folder / "result", None, arguments.device, threads)
    ran = run_measured(command, log, arguments.limit)
    row = {
        **key,
        "recoverable": kind == CLEAN or DEGRADATIONS[kind].recoverable,
        "size_factor": degraded.size_factor,
        **{name: round(ran[name], 1) for name in ("wall_seconds", "cpu_seconds", "peak_memory_mib")},
        "exit_status": ran["exit_status"],
    }
    if ran["exit_status"] == 0 or (folder / "result" / "result.json").is_file():
        row |= score_folder(folder / "result", truth, degraded.given_to_true)
        for name, bone in row["bones"].items():
            bone["covered"] = covered[name]
    if ran["exit_status"] != 0:
        row["message"] = (
            log.read_text().strip().replace(f"{folder.absolute()}", ".").replace(f"{folder}", ".")[-400:]
        )
    found = machine()
    row["measured_on"] = {name: found[name] for name in ("processor", "cores", "date", "python", "polypose")}
    row["measured_on"]["device"] = arguments.device
    if not arguments.keep:
        shutil.rmtree(folder, ignore_errors=True)
    return row


def _matches(row: dict[str, Any], key: dict[str, Any]) -> bool:
    return all(row[name] == value for name, value in key.items())


if __name__ == "__main__":
    sys.exit(main())
