"""Carried points against independent truths: how often the 95 % ellipsoids hold the true place, and how long it takes.

Cases are those of accuracy.py: bones move rigidly, soft tissue by another law than the warp's. Points of bones, organs
and the whole body are carried from the CT to the patient as X-rayed and compared with the truth's own displacements.
The soft tissue's variance (PolyPoseLib/carrying/soft_tissue_error.py) was fitted on the seeds 0 and 1 of both anatomies
and both laws together; coverage is shown on others.

    python Testing/Benchmarks/carry.py --anatomy pelvis chest --seeds 13 14 --threads 1
    python Testing/Benchmarks/carry.py --times case/result
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from pathlib import Path

import numpy as np
from accuracy import ELASTIC_NODE_MM, LAWS
from benchmark_cases import STRUCTURES, case_folder
from benchmark_runs import RESULTS, register_command, run_measured
from benchmark_tables import machine

from PolyPoseLib.data.result import Result
from PolyPoseLib.data.truth import Truth
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation.simulate import SimulationOptions
from PolyPoseLib.warp.inverse import invert_at

POINTS = 3000
"""Per case and group."""

BODY_HU = -500.0

GROUPS = ("bones", "organs", "body")
"""bones: that move; organs: labels that are neither structure nor bone; body: anything denser than air."""


def main() -> int:
    """Run what is missing and write the table after every case."""
    arguments = parse_arguments()
    if arguments.times:
        print(json.dumps(times(load_result(arguments.times)), indent=1))
        return 0
    store = arguments.output / "carry.json"
    rows = json.loads(store.read_text())["rows"] if store.is_file() else []
    arguments.work.mkdir(parents=True, exist_ok=True)
    for anatomy in arguments.anatomy:
        for seed in arguments.seeds:
            key = {"anatomy": anatomy, "views": arguments.views, "seed": seed, "tissue": arguments.tissue}
            old = [row for row in rows if all(row[field] == value for field, value in key.items())]
            if old and not arguments.again:
                continue
            result, truth = registered(anatomy, seed, arguments)
            row = key | {group: score(result, truth, group) for group in GROUPS} | {"times": times(result)}
            rows = [each for each in rows if each not in old] + [row]
            store.write_text(json.dumps({"machine": machine(), "rows": rows}, indent=1) + "\n")
            write_table(rows, arguments.output / "carry.md")
            print(json.dumps(row), flush=True)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--anatomy", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument("--views", default="2x30", metavar="NxARC")
    parser.add_argument("--seeds", nargs="+", type=int, default=[13, 14])
    parser.add_argument("--tissue", default="harmonic", choices=tuple(LAWS), help="law of the truth's tissue")
    parser.add_argument("--pixels", type=int, default=400)
    parser.add_argument("--threads", type=int, help="of a registration (default: all)")
    parser.add_argument("--limit", type=float, default=7200, metavar="SECONDS", help="of one registration")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where cases are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the table")
    parser.add_argument("--again", action="store_true", help="run cases again that are there already")
    parser.add_argument("--times", type=Path, metavar="RESULT", help="only time carrying by this result")
    return parser.parse_args()


def registered(anatomy: str, seed: int, arguments: argparse.Namespace) -> tuple[Result, Truth]:
    """Simulate and register where that was not done before."""
    elastic = arguments.tissue == "elastic"
    options = SimulationOptions(tissue="elastic", node_mm=ELASTIC_NODE_MM) if elastic else None
    folder = case_folder(
        anatomy,
        arguments.views,
        seed,
        arguments.pixels,
        arguments.work,
        options,
        "elastic" if elastic else "",
    )
    output = folder / "result_carry"
    if arguments.again or not (output / "structures.nii.gz").is_file():
        shutil.rmtree(output, ignore_errors=True)
        command = register_command(folder / "study.json", output, "default", "cpu", arguments.threads)
        ran = run_measured(command, folder / "log_carry.txt", arguments.limit)
        if ran["exit_status"] not in (0, 3):
            raise SystemExit((folder / "log_carry.txt").read_text()[-500:])
    return load_result(output), load_truth(folder / "truth")


def score(result: Result, truth: Truth, group: str) -> dict[str, float]:
    """Errors and coverage of one group's points, carried from the CT to the patient as X-rayed."""
    points, true = true_places(result, truth, group, np.random.default_rng(truth.seed))
    carried = result.transform_points(points)
    error = carried.points - true
    squared = np.einsum("ni,nij,nj->n", error, np.linalg.inv(carried.covariances), error)
    size, axes = np.linalg.norm(error, axis=1), carried.semi_axes_mm
    return {
        "points": len(points),
        "coverage_percent": float(100 * (squared <= 7.815).mean()),
        "error_median_mm": float(np.median(size)),
        "error_p95_mm": float(np.quantile(size, 0.95)),
        "longest_half_axis_median_mm": float(np.median(axes[:, 2])),
        "shortest_half_axis_median_mm": float(np.median(axes[:, 0])),
    }


def true_places(
    result: Result, truth: Truth, group: str, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Random points (N, 3) of a group in the CT, and where they truly are as X-rayed."""
    labels = truth.moving_labels
    if group == "bones":
        moving = [n for n, name in enumerate(truth.names, start=1) if name != truth.anchor]
        points, index = random_points(labels.with_voxels(np.isin(labels.voxels, moving)), rng)
        owner = labels.voxels[tuple(index[:, ::-1].T)]
        true = np.empty_like(points)
        for n in moving:
            back = rigid_inverse(truth.fixed_to_moving[truth.names[n - 1]])
            true[owner == n] = points[owner == n] @ back[:3, :3].T + back[:3, 3]
        return points, true
    if group == "organs":
        assert truth.moving_organs is not None
        mask = truth.moving_organs.with_voxels(truth.moving_organs.voxels > 0)
    else:  # a body voxel of the CT is one whose true place as X-rayed is in the body
        mask = truth.fixed_ct.with_voxels(truth.fixed_ct.voxels > BODY_HU)
        true, _ = random_points(mask, rng)
        return truth.field(true), true
    points, _ = random_points(mask, rng)
    shift, residual = invert_at(truth.field, points)
    sound = residual < 0.01
    return points[sound], points[sound] + shift[sound]


def random_points(mask: Volume, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Places (N, 3) in mm anywhere in the voxels of a mask, and the voxels' indices (i, j, k)."""
    index = np.argwhere(mask.voxels)[:, ::-1]
    index = index[rng.integers(len(index), size=POINTS)]
    return mask.to_world(index + rng.uniform(-0.5, 0.5, index.shape)), index


def times(result: Result) -> dict[str, float]:
    """CPU seconds for 10,000 points with their ellipsoids and for a mesh of 200,000 vertices, preparation included."""
    rng = np.random.default_rng(0)
    assert result.structure_labels is not None
    last = np.array(result.structure_labels.shape[::-1]) - 1
    anywhere = result.structure_labels.to_world(rng.uniform(0, last, (10_000, 3)))
    sphere = rng.normal(size=(200_000, 3))
    sphere *= 60 / np.linalg.norm(sphere, axis=1, keepdims=True)
    out = {}
    for name, points in (
        ("points_10000", anywhere),
        ("mesh_200000", result.structure_labels.bounds_center + sphere),
    ):
        fresh = load_like(result)
        start = time.process_time()
        if name.startswith("mesh"):
            fresh.transform_mesh(points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
        else:
            assert np.isfinite(fresh.transform_points(points).semi_axes_mm).all()
        out[f"{name}_seconds"] = time.process_time() - start
    return out


def load_like(result: Result) -> Result:
    """The same result with nothing prepared."""
    from dataclasses import replace

    return replace(result)


def write_table(rows: list[dict], path: Path) -> None:
    """Coverage by case and group, as Markdown."""
    lines = [
        "# Carried points against the truth",
        "",
        "Share of points whose true place lies within the stated 95 % ellipsoid; errors and the ellipsoids' half axes, "
        "medians, in mm. The points of one case share one draw of the bones' errors.",
        "",
        "| case | truth's tissue | points | inside % | error mm | 95 % of errors below mm | half axes mm |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in sorted(rows, key=lambda each: (each["tissue"], each["anatomy"], each["seed"])):
        for group in GROUPS:
            each = row[group]
            lines.append(
                f"| {row['anatomy']} {row['views']} seed {row['seed']} | {row['tissue']} | {group} | "
                f"{each['coverage_percent']:.1f} | {each['error_median_mm']:.2f} | {each['error_p95_mm']:.2f} | "
                f"{each['shortest_half_axis_median_mm']:.1f} to {each['longest_half_axis_median_mm']:.1f} |"
            )
    laws = sorted({row["tissue"] for row in rows})
    for group in GROUPS:
        means = []
        for law in laws:
            means.append(np.mean([row[group]["coverage_percent"] for row in rows if row["tissue"] == law]))
            lines.append(f"| all | {law} | {group} | {means[-1]:.1f} | | | |")
        lines.append(f"| all | each law counting alike | {group} | {np.mean(means):.1f} | | | |")
    lines += [
        "",
        "10,000 points with their ellipsoids took "
        f"{np.median([row['times']['points_10000_seconds'] for row in rows]):.2f} CPU s, a mesh of 200,000 vertices "
        f"{np.median([row['times']['mesh_200000_seconds'] for row in rows]):.2f} CPU s.",
        "",
    ]
    path.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
