"""Accuracy on independent truths: TRE, Dice, folds, cameras, seconds and memory of several modes.

Bones of a public CT are moved rigidly about their joints, soft tissue follows Laplace's equation (with --tissue
elastic: that of an elastic body with a free skin), ITK-RTK renders, a detector model adds noise, scatter, saturation
and 12-bit rounding, and the cameras start 4 degrees and 15 mm off. Every registration runs as its own process, the way
a user runs it, so that seconds and peak memory are its own.

    python Testing/Benchmarks/accuracy.py --anatomy pelvis --views 2x30 --seeds 0 1 2 3 4

Rows that are in the results file already are not run again unless --again is given.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from benchmark_cases import (
    STRUCTURES,
    VIEWS,
    case_folder,
    fused_study,
    parse_views,
    study_of_true_cameras,
)
from benchmark_runs import RESULTS, register_and_score
from benchmark_tables import machine, write_tables

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.truth import Truth
from PolyPoseLib.evaluation.score import camera_errors, score_motion
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation.simulate import SimulationOptions

TRUE_CAMERAS = "_true_cameras"

MODES = ("still", "rigid", "paper", "paper" + TRUE_CAMERAS, "default", "fast", "default" + TRUE_CAMERAS)
"""still: nothing done; rigid: all bones but the anchor as one body; with TRUE_CAMERAS: the preset before it, given the
true cameras; the others are presets."""

LAWS = {"harmonic": "Laplace's equation", "elastic": "linear elasticity with a free skin"}
"""Laws of the truths' soft tissue."""

ELASTIC_NODE_MM = 8.0
"""Nodes of an elastic truth, whose equation is the slower one."""


def main() -> int:
    """Run what is missing and write the tables after every row."""
    arguments = parse_arguments()
    name = arguments.name or ("accuracy" if arguments.tissue == "harmonic" else "accuracy_elastic")
    store = arguments.output / f"{name}.json"
    rows = json.loads(store.read_text())["rows"] if store.is_file() else []
    arguments.work.mkdir(parents=True, exist_ok=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    for anatomy in arguments.anatomy:
        for views in arguments.views:
            for seed in arguments.seeds:
                for mode in arguments.modes:
                    key = {
                        "anatomy": anatomy,
                        "views": views,
                        "seed": seed,
                        "mode": mode,
                        "pixels": arguments.pixels,
                    }
                    old = [row for row in rows if all(row[field] == value for field, value in key.items())]
                    if old and not arguments.again:
                        continue
                    row = key | run_row(anatomy, views, seed, mode, arguments)
                    rows = [each for each in rows if each not in old] + [row]
                    store.write_text(json.dumps({"machine": machine(), "rows": rows}, indent=1) + "\n")
                    write_tables(rows, arguments.output / f"{name}.md", LAWS[arguments.tissue])
                    print(describe(row), flush=True)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--anatomy", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument("--views", nargs="+", default=list(VIEWS), metavar="NxARC", help="such as 2x30 3x120")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--modes", nargs="+", choices=MODES, default=["still", "rigid", "paper", "default"])
    parser.add_argument(
        "--tissue", default="harmonic", choices=tuple(LAWS), help="law of the truth's soft tissue"
    )
    parser.add_argument("--pixels", type=int, default=400, help="rows and columns of an X-ray of 430 mm")
    parser.add_argument("--threads", type=int, help="of a registration (default: all)")
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--limit", type=float, default=7200, metavar="SECONDS", help="of one registration")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where cases are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--name", help="of the tables' files (default: accuracy or accuracy_elastic)")
    parser.add_argument("--again", action="store_true", help="run rows again that are there already")
    arguments = parser.parse_args()
    for views in arguments.views:
        try:
            parse_views(views)
        except ValueError:
            parser.error(f"--views {views}: write the number of views and the arc in degrees, such as 2x30.")
    return arguments


def run_row(anatomy: str, views: str, seed: int, mode: str, arguments: argparse.Namespace) -> dict:
    """Simulate if necessary, register, score."""
    elastic = arguments.tissue == "elastic"
    options = SimulationOptions(tissue="elastic", node_mm=ELASTIC_NODE_MM) if elastic else SimulationOptions()
    name = "elastic" if elastic else ""
    folder = case_folder(anatomy, views, seed, arguments.pixels, arguments.work, options, name)
    truth = load_truth(folder / "truth")
    if mode == "still":
        return still(folder, truth)
    study, preset, stands_for = folder / "study.json", mode, None
    if mode == "rigid":
        study, preset, stands_for = folder / "study_rigid.json", "default", fused_study(folder)
    elif mode.endswith(TRUE_CAMERAS):
        study, preset = study_of_true_cameras(folder, truth.cameras), mode.removesuffix(TRUE_CAMERAS)
    return register_and_score(study, truth, mode, arguments, preset, stands_for)


def still(folder: Path, truth: Truth) -> dict:
    """Score of doing nothing: bones at rest, cameras as given."""
    affine, shape = covering_grid(truth.fixed_ct.affine, truth.fixed_ct.shape, 4.0)
    transform = DisplacementField(np.zeros((*shape, 3), np.float32), affine)
    table = score_motion({name: np.eye(4) for name in truth.names}, transform, truth)
    xrays = json.loads((folder / "study.json").read_text())["xrays"]
    table["cameras"] = [
        camera_errors(
            true, Camera(true.intrinsics, np.array(xray["extrinsic"]), true.height, true.width), truth
        )
        for true, xray in zip(truth.cameras, xrays, strict=True)
    ]
    return table | {"exit_status": 0, "wall_seconds": 0.0, "peak_memory_mib": 0.0}


def describe(row: dict) -> str:
    """One line about a row."""
    head = f"{row['anatomy']} {row['views']} seed {row['seed']} {row['mode']}:"
    if "failed" in row:
        return f"{head} failed with {row['exit_status']}: {row['failed'].splitlines()[-1:]}"
    summary = row["summary"]
    return (
        f"{head} TRE {summary['mean_tre_mm']:.2f} mm, worst {summary['worst_tre_mm']:.2f} mm, "
        f"folds {summary['folds_percent']:.4f} %, {row['wall_seconds']:.0f} s, {row['peak_memory_mib']:.0f} MiB"
    )


if __name__ == "__main__":
    sys.exit(main())
