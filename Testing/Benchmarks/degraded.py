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
import shutil
import sys
from typing import Any

from benchmark_cases import STRUCTURES
from benchmark_store import MAKING, Store, add_run_arguments, parsed, register_row
from degraded_cases import CLEAN, covered_shares, degraded_case, structures_of
from degraded_pictures import write_pictures
from degraded_scores import score_folder
from degraded_tables import describe, write_degraded_tables

from PolyPoseLib.io.degraded_cases import degraded_truth, write_degraded_study
from PolyPoseLib.simulation.degradations.registry import DEGRADATIONS

NAME = "degraded"

FIELDS = ("kind", "anatomy", "views", "seed", "pixels")
"""What tells one case from another."""


def main() -> int:
    """Run what is missing and write the tables after every row."""
    arguments = parse_arguments()
    if arguments.pictures:
        for anatomy in arguments.anatomy:
            path = arguments.output / f"{arguments.name}_{anatomy}.png"
            write_pictures(
                anatomy, arguments.views, arguments.seeds[0], arguments.pixels, arguments.kinds, path
            )
            print(path)
        return 0
    store = Store(arguments.output / f"{arguments.name}.json", FIELDS, write_degraded_tables)
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
            missing = store.missing(keys, arguments.again)
            store.run(missing, arguments.jobs, lambda key: run_row(key, arguments), describe)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kinds", nargs="+", choices=tuple(DEGRADATIONS), default=list(DEGRADATIONS))
    parser.add_argument("--anatomy", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument("--name", default=NAME, help="of the results' files")
    add_run_arguments(parser, (0, 1, 2), "2x60", 3600)
    parser.add_argument(
        "--pictures", action="store_true", help="write a sheet with every kind, and run nothing"
    )
    return parsed(parser)


def run_row(key: dict[str, Any], arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate, degrade, register, score."""
    kind, anatomy = key["kind"], key["anatomy"]
    folder = arguments.work / NAME / "-".join(str(value) for value in key.values())
    shutil.rmtree(folder, ignore_errors=True)
    with MAKING:
        degraded = degraded_case(anatomy, key["views"], key["seed"], key["pixels"], kind)
        study = write_degraded_study(degraded, folder, structures_of(anatomy))
        truth, covered = degraded_truth(degraded), covered_shares(degraded)
    row = {
        **key,
        "recoverable": kind == CLEAN or DEGRADATIONS[kind].recoverable,
        "size_factor": degraded.size_factor,
        **register_row(study, folder / "result", arguments),
    }
    if row["exit_status"] == 0 or (folder / "result" / "result.json").is_file():
        row |= score_folder(folder / "result", truth, degraded.given_to_true)
        for name, bone in row["bones"].items():
            bone["covered"] = covered[name]
    if not arguments.keep:
        shutil.rmtree(folder, ignore_errors=True)
    return row


if __name__ == "__main__":
    sys.exit(main())
