"""Breathing between the CT and the X-rays: what becomes of cameras, ribs and organs?

The chest breathes in by PolyPoseLib.simulation.breathing: every rib turns about its joint with the spine, the sternum
follows, the diaphragm descends, liver and heart go along, and lungs grow and become less dense. The registration is
given every rib as a structure of its own (--bodies ribs), or the ribs of each side as one (--bodies sides), which no
rigid motion fits. Every case is registered as a process of its own, as a user does it.

    python Testing/Benchmarks/breathing.py --seeds 0 1 2 3 4
    python Testing/Benchmarks/breathing.py --modes default paper_true_cameras

Rows that are in the results file already are not run again unless --again is given.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from functools import partial
from pathlib import Path

import numpy as np
from benchmark_cases import case_folder, fuse, study_of_true_cameras
from benchmark_store import Row, Store, add_run_arguments, machines, parsed, register_row
from benchmark_tables import table
from degraded_scores import FAILED_MM, is_inside, score_folder, silent_failures

from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.truth import Truth
from PolyPoseLib.evaluation.metrics import dice
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.samples import sample_named
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation.breathing import separate_ribs
from PolyPoseLib.simulation.simulate import SimulationOptions
from PolyPoseLib.warp.dense import warp_labels

NAME = "breathing"

FIELDS = ("seed", "views", "pixels", "amplitude", "bodies", "mode")
"""What tells one row from another."""

MODES = ("default", "fast", "paper", "paper_true_cameras")
"""Presets; paper_true_cameras is the published method, given the true cameras."""

ORGANS = ("lung", "liver", "heart")
"""First words of the labels' names that make an organ."""

LEGEND = """\
The chest CT breathes in; the cameras start 4 degrees and 15 mm off. camera: mean over the views of the error of the
anchor's projected points in the plane through each, of the rotation, and of the anchor's depth along the view. ribs,
sternum: mean distance between where a bone's voxels are found and where they are, by the bone's own pose, after and at
rest; worst: of all bones. lungs, liver, heart: Dice after, and at rest. failed: bones off by more than 3 mm; silent: of
these, at exit 0, neither flagged nor inside the stated 95 % region. With bodies "sides", a rib has the pose of its side
and no interval of its own.
"""


def main() -> int:
    """Run what is missing and write the tables after every row."""
    arguments = parse_arguments()
    store = Store(arguments.output / f"{NAME}.json", FIELDS, write_tables)
    for seed in arguments.seeds:
        keys = [
            {
                "seed": seed,
                "views": arguments.views,
                "pixels": arguments.pixels,
                "amplitude": arguments.amplitude,
                "bodies": bodies,
                "mode": mode,
            }
            for bodies in arguments.bodies
            for mode in arguments.modes
        ]
        missing = store.missing(keys, arguments.again)
        if not missing:
            continue
        folder = breathing_case(seed, arguments)
        truth = load_truth(folder / "truth")
        cases = [(key, study_of(key, folder, truth)) for key in missing]
        store.run(cases, arguments.jobs, partial(run_row, truth=truth, arguments=arguments), describe)
        if not arguments.keep:
            shutil.rmtree(folder)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--amplitude", type=float, default=20.0, metavar="MM", help="descent of the diaphragm"
    )
    parser.add_argument("--modes", nargs="+", choices=MODES, default=["default"])
    parser.add_argument("--bodies", nargs="+", choices=("ribs", "sides"), default=["ribs"])
    add_run_arguments(parser, range(5), "2x30", 7200)
    return parsed(parser)


def breathing_case(seed: int, arguments: argparse.Namespace) -> Path:
    """The folder of one case."""
    options = SimulationOptions(motion="breathing", amplitude=arguments.amplitude)
    groups, _ = structures()
    name = f"breathing{arguments.amplitude:g}"
    return case_folder(
        "chest", arguments.views, seed, arguments.pixels, arguments.work, options, name, groups
    )


def structures() -> tuple[dict[str, list[int]], str]:
    """Labels of every structure of the sample's proposal with the ribs one by one, the anchor first."""
    sample = sample_named("chest")
    proposed = {name: list(labels) for name, labels in sample.structures.items()}
    groups, anchor = separate_ribs(proposed, sample.anchor, label_table(sample.label_table))
    return {anchor: groups[anchor], **groups}, anchor


def study_of(key: Row, folder: Path, truth: Truth) -> tuple[Path, dict[str, str]]:
    """Write the study of one way to register a case, before any registration reads it; and {structure: its body}."""
    study = folder / "study.json"
    if key["mode"] == "paper_true_cameras":
        study = study_of_true_cameras(folder, truth.cameras)
    return study_of_sides(study) if key["bodies"] == "sides" else (study, {})


def run_row(
    case: tuple[Row, tuple[Path, dict[str, str]]], truth: Truth, arguments: argparse.Namespace
) -> Row:
    """Register one case in one way, and score what came out; case: its key, and what study_of gives of it."""
    key, (study, stands_for) = case
    preset = "paper" if key["mode"] == "paper_true_cameras" else key["mode"]
    result = study.with_name(f"result_{key['bodies']}_{key['mode']}")
    shutil.rmtree(result, ignore_errors=True)
    row = key | {"size_factor": 1.0} | register_row(study, result, arguments, preset)
    if (result / "result.json").is_file():
        row |= score_folder(result, truth, np.eye(4), stands_for)
        row["organs"] = organ_dice(result, truth)
    return row


def study_of_sides(study: Path) -> tuple[Path, dict[str, str]]:
    """Write a study beside another in which the ribs of a side are one body; and {structure: its body}."""
    fields = json.loads(study.read_text())
    groups = {
        f"ribs_{side}": [name for name in fields["structures"] if name.startswith(f"rib_{side}_")]
        for side in ("left", "right")
    }
    fields["structures"], stands_for = fuse(fields["structures"], groups)
    path = study.with_name(f"{study.stem}_sides.json")
    path.write_text(json.dumps(fields, indent=1))
    return path, stands_for


def organ_dice(result: Path, truth: Truth) -> dict[str, list[float]]:
    """{organ: Dice after and at rest}."""
    moving, fixed = truth.moving_organs, truth.fixed_organs
    if moving is None or fixed is None:
        return {}
    transform = load_result(result).transform
    found = {}
    for organ in ORGANS:
        numbers = [n for n, name in truth.organ_names.items() if name.split("_")[0] == organ]
        before, after = (np.isin(volume.voxels, numbers) for volume in (moving, fixed))
        warped = warp_labels(moving.with_voxels(before.astype(np.int16)), transform, method="nearest")
        found[organ] = [dice(after, warped.voxels > 0), dice(after, before)]
    return found


def write_tables(rows: list[Row], path: Path) -> None:
    """One line a row, means over the seeds, and the machines."""
    parts = ["# Breathing\n", LEGEND]
    kinds = dict.fromkeys(tuple(row[name] for name in FIELDS[1:]) for row in rows)
    for kind in kinds:
        mine = [row for row in rows if tuple(row[name] for name in FIELDS[1:]) == kind]
        views, pixels, amplitude, bodies, mode = kind
        parts.append(
            f"## {mode}, {amplitude:g} mm, bodies {bodies}, views {views}, {pixels} x {pixels} pixels\n"
        )
        head = [
            "seed",
            "camera deg / mm / depth mm",
            "ribs (rest)",
            "sternum (rest)",
            "worst",
            "lungs (rest)",
        ]
        head += ["liver (rest)", "heart (rest)", "failed", "silent", "exit", "CPU s"]
        lines = [_cells(str(row["seed"]), [row]) for row in sorted(mine, key=lambda row: row["seed"])]
        parts.append(table(head, lines + ([_cells("all", mine)] if len(mine) > 1 else [])))
    path.write_text("\n".join([*parts, machines(rows)]), encoding="utf-8")


def describe(row: Row) -> str:
    """One line about a row."""
    return f"seed {row['seed']} {row['bodies']} {row['mode']}: " + ", ".join(_cells("", [row])[1:])


def _cells(title: str, rows: list[Row]) -> list[str]:
    """One line of a table: means over rows, and counts of all their bones."""
    bones = [(name, bone) for row in rows for name, bone in row.get("bones", {}).items()]
    cameras = [camera for row in rows for camera in row.get("cameras", [])]
    mm, degrees, depth = np.abs(np.array(cameras or [[np.nan] * 3])).mean(axis=0)
    failed = [bone for _, bone in bones if bone["tre_mean_mm"] > FAILED_MM]
    inside = sum(is_inside(bone) for bone in failed)
    return [
        title,
        f"{degrees:.2f} / {mm:.2f} / {depth:.1f}",
        _error([bone for name, bone in bones if name.startswith("rib_")]),
        _error([bone for name, bone in bones if name == "sternum"]),
        f"{max((bone['tre_mean_mm'] for _, bone in bones), default=float('nan')):.1f}",
        *(_overlap(rows, organ) for organ in ORGANS),
        f"{len(failed)} of {len(bones)} ({inside} inside)",
        str(sum(len(silent_failures(row)) for row in rows)),
        ", ".join(str(status) for status in sorted({row["exit_status"] for row in rows})),
        f"{np.mean([row['cpu_seconds'] for row in rows]):.0f}",
    ]


def _error(bones: list[Row]) -> str:
    """Mean error after, and at rest."""
    if not bones:
        return "-"
    after, rest = (np.mean([bone[name] for bone in bones]) for name in ("tre_mean_mm", "rest_mm"))
    return f"{after:.2f} ({rest:.2f})"


def _overlap(rows: list[Row], organ: str) -> str:
    """Dice after, and at rest."""
    found = np.array([row["organs"][organ] for row in rows if organ in row.get("organs", {})])
    return f"{found[:, 0].mean():.3f} ({found[:, 1].mean():.3f})" if len(found) else "-"


if __name__ == "__main__":
    sys.exit(main())
