"""How far may bones have moved? The motions of accuracy.py, times 1 to 3.

Every case is registered as a process of its own, as a user does it. Counted are bones off by more than 3 mm, and of
these the announced ones: flagged, inside their stated 95 % region, or of a result that is refused or distrusted; and
those that the result only calls uncertain, in its report and on the command line. The others are silent failures.

    python Testing/Benchmarks/range.py --anatomy pelvis --scales 1 2.5 --seeds 0

Rows that are in the results file already are not run again unless --again is given.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

import numpy as np
from benchmark_cases import STRUCTURES, case_folder
from benchmark_store import MAKING, Row, Store, add_run_arguments, machines, parsed, register_row
from benchmark_tables import table
from degraded_scores import FAILED_MM, RIGHT_MM, is_called_uncertain, score_folder, silent_failures

from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation.simulate import SimulationOptions

NAME = "range"

FIELDS = ("anatomy", "views", "seed", "pixels", "scale")
"""What tells one row from another."""

LEGEND = """\
scale: factor on the motions of accuracy.py; a posture in which bones would collide is drawn again, and shrunk in the
end, so rest, the error of doing nothing, grows less. mean, worst: over moving bones, of the mean distance between where
a bone's voxels are found and where they are, by the bone's own pose, in mm. failed: bones off by more than 3 mm;
announced: of these, flagged, inside their stated 95 % region, or of a case that does not end at exit 0; only uncertain:
outside their region, but called uncertain in the report because it is wide; silent: the others. right but uncertain: of
bones within 1.5 mm, those flagged or called uncertain.
"""


def main() -> int:
    """Run what is missing and write the tables after every row."""
    arguments = parse_arguments()
    store = Store(arguments.output / f"{NAME}.json", FIELDS, write_tables)
    keys = [
        {
            "anatomy": anatomy,
            "views": arguments.views,
            "seed": seed,
            "pixels": arguments.pixels,
            "scale": scale,
        }
        for anatomy in arguments.anatomy
        for scale in arguments.scales
        for seed in arguments.seeds
    ]
    missing = store.missing(keys, arguments.again)
    store.run(missing, arguments.jobs, lambda key: run_row(key, arguments), describe)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--anatomy", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument("--scales", nargs="+", type=float, default=[1.0, 1.5, 2.0, 2.5, 3.0])
    add_run_arguments(parser, range(5), "2x30", 3600)
    return parsed(parser)


def run_row(key: Row, arguments: argparse.Namespace) -> Row:
    """Simulate, register, score."""
    options = SimulationOptions(motion_scale=key["scale"])
    name = f"range{key['scale']:g}"
    with MAKING:
        folder = case_folder(
            key["anatomy"], key["views"], key["seed"], key["pixels"], arguments.work, options, name
        )
    truth = load_truth(folder / "truth")
    result = folder / "result"
    shutil.rmtree(result, ignore_errors=True)
    row = key | {"size_factor": 1.0} | register_row(folder / "study.json", result, arguments)
    if (result / "result.json").is_file():
        row |= score_folder(result, truth, np.eye(4))
    if not arguments.keep:
        shutil.rmtree(folder)
    return row


def write_tables(rows: list[Row], path: Path) -> None:
    """One table an anatomy, one line a scale, and the machines."""
    parts = ["# Range of motion\n", LEGEND]
    for anatomy, views, pixels in dict.fromkeys((r["anatomy"], r["views"], r["pixels"]) for r in rows):
        mine = [r for r in rows if (r["anatomy"], r["views"], r["pixels"]) == (anatomy, views, pixels)]
        parts.append(f"## {anatomy}, views {views}, {pixels} x {pixels} pixels\n")
        head = ["scale", "seeds", "rest mm", "mean mm", "worst mm", "failed", "announced"]
        head += ["only uncertain", "silent", "right but uncertain", "exit"]
        lines = [
            _cells(scale, [row for row in mine if row["scale"] == scale])
            for scale in sorted({row["scale"] for row in mine})
        ]
        parts.append(table(head, lines))
    path.write_text("\n".join([*parts, machines(rows)]), encoding="utf-8")


def describe(row: Row) -> str:
    """One line about a row."""
    cells = _cells(row["scale"], [row])
    return f"{row['anatomy']} seed {row['seed']} scale {cells[0]}: " + ", ".join(cells[2:])


def _cells(scale: float, rows: list[Row]) -> list[str]:
    """One line of a table: a scale over its seeds."""
    bones = [bone for row in rows for bone in row.get("bones", {}).values()]
    errors = np.array([bone["tre_mean_mm"] for bone in bones])
    rest = np.array([bone["rest_mm"] for bone in bones])
    failed = int((errors > FAILED_MM).sum())
    missed = [(row["bones"][name], row) for row in rows for name in silent_failures(row)]
    silent = sum(not is_called_uncertain(bone, row) for bone, row in missed)
    right = [(bone, row) for row in rows for bone in row.get("bones", {}).values()]
    right = [(bone, row) for bone, row in right if bone["tre_mean_mm"] <= RIGHT_MM]
    doubted = sum(bone["flagged"] or is_called_uncertain(bone, row) for bone, row in right)
    statuses = [row["exit_status"] for row in rows]
    exits = ", ".join(f"{status} x {statuses.count(status)}" for status in sorted(set(statuses)))
    numbers = (
        [f"{values:.2f}" for values in (rest.mean(), errors.mean(), errors.max())]
        if len(bones)
        else ["-"] * 3
    )
    return [
        f"{scale:g}",
        str(len(rows)),
        *numbers,
        f"{failed} of {len(bones)}",
        str(failed - len(missed)),
        str(len(missed) - silent),
        str(silent),
        f"{doubted} of {len(right)}",
        exits,
    ]


if __name__ == "__main__":
    sys.exit(main())
