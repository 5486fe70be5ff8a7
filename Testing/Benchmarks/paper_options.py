"""What every difference between the published program and this project changes: the options of the preset "paper".

Cases are those of accuracy.py, two views of the pelvis 30 degrees apart with an independent truth. Every registration
is given the true cameras, except those of the camera stage, which start from the case's initial ones. One thing differs
from the published program in every row; the last rows differ in all, and are this project's default.

    python Testing/Benchmarks/paper_options.py
    python Testing/Benchmarks/paper_options.py --seeds 0 1 2 --variants published "anchor held"

Rows that are in the results file already are not run again unless --again is given; --list prints what is missing.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmark_cases import STRUCTURES, case_folder
from benchmark_store import Row, Store, add_run_arguments, machines, parsed, register_row
from benchmark_tables import COLUMNS, mean_rows, table

from PolyPoseLib.evaluation.score import score_result
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.truths import load_truth

NAME = "paper_options"
FIELDS = ("anatomy", "views", "pixels", "seed", "variant", "options")
AS_BEFORE = {
    "anchor": "held",
    "restart_adam": False,
    "bone_multiplier": 1,
    "gradient_blur_px": 0,
    "camera_plateaus": False,
}


@dataclass(frozen=True)
class Variant:
    """options: of the study; cameras: "true" or "initial"."""

    options: dict[str, Any]
    cameras: str = "true"


def _paper(cameras: str = "true", more: dict[str, Any] | None = None, **details: Any) -> Variant:
    return Variant({"preset": "paper", **(more or {}), "paper": details}, cameras)


VARIANTS: dict[str, Variant] = {
    "published": _paper(),
    "anchor held": _paper(anchor="held"),
    "bone multiplier 1": _paper(bone_multiplier=1),
    "no blur of gradients": _paper(gradient_blur_px=0),
    "Adam goes on": _paper(restart_adam=False),
    "all four": _paper(**AS_BEFORE),
    "Levenberg-Marquardt": _paper(more={"optimizer": "lm"}),
    "weights m/d², moving": _paper(more={"weights": "rigid", "weight_frame": "moving"}),
    "this project's default": Variant({"preset": "default"}),
    "cameras found, plateaus": _paper("initial"),
    "cameras found, 51 iterations a level": _paper("initial", camera_plateaus=False),
    "cameras found, this project's default": Variant({"preset": "default"}, "initial"),
}
"""The first is the published program."""


def main() -> int:
    """Run what is missing, and write the table after every row."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_run_arguments(parser, seeds=(0,), views="2x30", limit=14400)
    parser.add_argument("--variants", nargs="+", choices=tuple(VARIANTS), default=list(VARIANTS))
    parser.add_argument("--anatomy", default="pelvis", choices=tuple(STRUCTURES))
    parser.add_argument("--list", action="store_true", help="print what would be run, and stop")
    arguments = parsed(parser)
    store = Store(arguments.output / f"{NAME}.json", FIELDS, write_table)
    wanted = store.missing(
        [key(name, seed, arguments) for seed in arguments.seeds for name in arguments.variants],
        arguments.again,
    )
    if arguments.list:
        print("\n".join(f"seed {each['seed']}: {each['variant']}" for each in wanted))
        return 0
    store.run(wanted, arguments.jobs, lambda each: run_row(each, arguments), outcome)
    return 0


def key(name: str, seed: int, arguments: argparse.Namespace) -> Row:
    """What tells one row from another."""
    variant = VARIANTS[name]
    return {
        "anatomy": arguments.anatomy,
        "views": arguments.views,
        "pixels": arguments.pixels,
        "seed": seed,
        "variant": name,
        "options": variant.options,
    }


def run_row(wanted: Row, arguments: argparse.Namespace) -> Row:
    """Simulate if necessary, register, score."""
    folder = case_folder(wanted["anatomy"], wanted["views"], wanted["seed"], wanted["pixels"], arguments.work)
    truth = load_truth(folder / "truth")
    fields = json.loads((folder / "study.json").read_text())
    fields["options"] = wanted["options"] | {"uncertainty": False}
    if VARIANTS[wanted["variant"]].cameras == "true":
        for xray, camera in zip(fields["xrays"], truth.cameras, strict=True):
            xray |= {"camera": "known", "extrinsic": camera.extrinsic.tolist()}
    tag = list(VARIANTS).index(wanted["variant"])
    study = folder / f"study_{NAME}_{tag}.json"
    study.write_text(json.dumps(fields, indent=1))
    output = folder / f"result_{NAME}_{tag}"
    row = wanted | register_row(study, output, arguments)
    if output.is_dir():
        row |= score_result(load_result(output), truth)
    else:
        row["failed"] = row.get("message", "")
    return row


def write_table(rows: list[Row], path: Path) -> None:
    """One line per variant, means over seeds."""
    groups = [
        (f"{name} ({variant.cameras})", found)
        for name, variant in VARIANTS.items()
        if (found := [row for row in rows if row["variant"] == name])
    ]
    text = (
        "# Options of the preset paper\n\n"
        "Two views 30 degrees apart with an independent truth; means over seeds (second column: how many), out of "
        f"{', '.join(sorted({str(row['seed']) for row in rows}))}. Every line differs "
        "from the published program (first line) in what its name says, and the default in everything. In brackets the "
        "cameras that a registration is given: true ones, which it holds, or initial ones, which it refines.\n\n"
    )
    text += table(["variant", "seeds", *(name for name, _, _ in COLUMNS)], mean_rows(groups))
    path.write_text(f"{text}\n{machines(rows)}", encoding="utf-8")


def outcome(row: Row) -> str:
    """What came out, in one line."""
    if "failed" in row:
        return f"{row['variant']}, seed {row['seed']}: failed: {row['failed'][-200:]}"
    summary = row["summary"]
    return (
        f"{row['variant']}, seed {row['seed']}: TRE {summary['mean_tre_mm']:.2f} mm, worst "
        f"{summary['worst_tre_mm']:.2f} mm, {row['cpu_seconds']:.0f} CPU s"
    )


if __name__ == "__main__":
    sys.exit(main())
