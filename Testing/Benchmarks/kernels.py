"""The same registrations by compiled loops (numba), by torch, and by what a GPU runs: how far apart bones end.

    python Testing/Benchmarks/kernels.py --device cpu

All paths compute the same images, derivatives and steps (tests hold each against the other); here whole registrations
are compared, in which every choice between minima might go the other way. How far apart two registrations end that
differ in nothing that matters, the compiled loops tell once more, with X-rays whose initial cameras lie a thousandth of
a millimetre elsewhere. Without a GPU, its path runs on the CPU as if there were one (pretended_gpu_cli.py), and its
seconds say nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from benchmark_cases import STRUCTURES, case_folder
from benchmark_runs import register_command, run_measured
from benchmark_store import Row, Store, add_run_arguments, machines, parsed
from benchmark_tables import machine, table
from speed import with_kernel

from PolyPoseLib.data.study import Study
from PolyPoseLib.evaluation.score import score_result
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.truths import load_truth

PATHS = ("numba", "nudged", "torch", "gpu")
NUDGE_MM = 1e-3
"""By which initial cameras are shifted along every axis."""

STEP = 10
"""Every which voxel of a structure is carried by two results."""


def main() -> int:
    """Register every case by every path and compare."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_run_arguments(parser, seeds=(8,), views="2x30", limit=7200)
    parser.add_argument("--samples", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument(
        "--paths",
        nargs="+",
        choices=PATHS[1:],
        default=list(PATHS[1:]),
        help="to compare with the first, numba",
    )
    arguments = parsed(parser)
    store = Store(arguments.output / "kernels.json", ("sample", "seed", "views", "pixels"), write)
    fixed = {"views": arguments.views, "pixels": arguments.pixels}
    keys = [
        {"sample": sample, "seed": seed} | fixed for seed in arguments.seeds for sample in arguments.samples
    ]
    for key in keys:
        row = store.row(key) or {"exit_status": 0}
        wanted = [path for path in arguments.paths if arguments.again or path not in row]
        for path, run in compared(key, [PATHS[0], *wanted] if wanted else [], arguments):
            row[path] = run
            row["measured_on"] = machine() | {"device": arguments.device, "threads": str(arguments.threads)}
            store.put(key | row)
    return 0


def compared(key: Row, paths: list[str], arguments: argparse.Namespace) -> Iterator[tuple[str, Row]]:
    """One case by several paths, the compiled loops first: a path's name and its part of the row."""
    folder = case_folder(key["sample"], key["views"], key["seed"], key["pixels"], arguments.work)
    truth = load_truth(folder / "truth")
    first = 0.0
    for path in paths:
        output, log = folder / f"result_{path}", folder / f"log_{path}.txt"
        ran = run_measured(command(folder / "study.json", path, output, arguments), log, arguments.limit)
        if ran["exit_status"] not in (0, 3):
            raise SystemExit(f"{path}: {log.read_text().strip()[-500:]}")
        first = first or ran["cpu_seconds"]
        run = {
            "exit_status": ran["exit_status"],
            "cpu_seconds": round(ran["cpu_seconds"], 1),
            "times": ran["cpu_seconds"] / first,
            "peak_memory_mib": round(ran["peak_memory_mib"]),
            "mean_tre_mm": score_result(load_result(output), truth)["summary"]["mean_tre_mm"],
            "apart_mm": apart(folder, path),
        }
        yield path, run


def command(study: Path, path: str, output: Path, arguments: argparse.Namespace) -> list[str]:
    """What registers a study by a path."""
    if path != "gpu":
        kernel = "torch" if path == "torch" else "numba"
        chosen = with_kernel(nudged(study) if path == "nudged" else study, kernel)
        return register_command(chosen, output, None, "cpu", arguments.threads)
    whole = register_command(study, output, None, "cuda", arguments.threads)
    if torch.cuda.is_available():
        return whole
    return [sys.executable, str(Path(__file__).with_name("pretended_gpu_cli.py")), *whole[3:]]


def nudged(study: Path) -> Path:
    """A copy of a study's file beside it, with initial cameras a little elsewhere."""
    fields = json.loads(study.read_text())
    for xray in fields["xrays"]:
        for row in xray["extrinsic"][:3]:
            row[3] += NUDGE_MM
    copy = study.with_name("study_nudged.json")
    copy.write_text(json.dumps(fields))
    return copy


def apart(folder: Path, path: str) -> dict[str, float]:
    """The largest distance of a structure's voxels (mm) between where the compiled loops and a path carry them."""
    study = Study.load(folder / "study.json")
    results = [load_result(folder / f"result_{each}").structures for each in (PATHS[0], path)]
    found = {}
    for name in study.structures.names:
        points = study.ct.to_world(np.argwhere(study.structures.mask(name))[::STEP, ::-1])
        motions = [np.linalg.inv(result[name].fixed_to_moving) for result in results]
        ends = [points @ motion[:3, :3].T + motion[:3, 3] for motion in motions]
        found[name] = float(np.linalg.norm(ends[1] - ends[0], axis=1).max())
    return found


def write(rows: list[Row], path: Path) -> None:
    """The table."""
    head = ["case", "path", "mean TRE mm", "apart mm, mean", "worst bone", "CPU s", "times", "MiB"]
    lines = [
        _line(row, path)
        for row in sorted(rows, key=lambda row: (row["sample"], row["seed"]))
        for path in PATHS
        if path in row
    ]
    sections = [
        "# Compiled loops, torch, and what a GPU runs\n",
        "Whole registrations of the same cases, the preset `default`. Apart: from where the compiled loops put a bone, "
        "at the voxel that is farthest. Nudged: the compiled loops once more, from initial cameras "
        f"{NUDGE_MM:g} mm elsewhere; two paths cannot be asked to end closer than that. Times: CPU "
        "seconds over those of the compiled loops beside them. What a GPU runs is run by the "
        "CPU where there is none; its seconds then say nothing.\n",
        table(head, lines),
        machines(rows),
    ]
    path.write_text("\n".join(sections), encoding="utf-8")


def _line(row: Row, path: str) -> list[str]:
    run, distances = row[path], row[path]["apart_mm"]
    worst = max(distances, key=distances.__getitem__)
    return [
        f"{row['sample']}, seed {row['seed']}, {row['views']}",
        path,
        f"{run['mean_tre_mm']:.3f}",
        f"{np.mean(list(distances.values())):.3f}",
        f"{distances[worst]:.3f} ({worst})",
        f"{run['cpu_seconds']:.0f}",
        f"{run['times']:.1f}",
        str(run["peak_memory_mib"]),
    ]


if __name__ == "__main__":
    sys.exit(main())
