"""Speed: ratios to peers in one interleaved run, seconds and memory of whole registrations, and how cost grows.

Contestants take turns, so that whatever else the machine does hits all of them; ratios are of medians. Peers that
are not installed are left out.

    python Testing/Benchmarks/speed.py --parts projector iteration limits registration scaling memory
"""

from __future__ import annotations

import argparse
import gc
import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import torch
from benchmark_cases import case_folder
from benchmark_runs import RESULTS, register_command, resident_mib, run_measured
from benchmark_tables import machine
from speed_limits import ray_limits, watched_kernels
from speed_peers import Missing, OfficialIteration, diffdrr_projector, nanodrr_projector
from speed_scenes import (
    bone_problem,
    paper_objective,
    pelvis,
    phantom,
    regular_grid,
    weight_field,
)
from speed_tables import write_tables

from PolyPoseLib.baselines.published.method import attenuation_grid
from PolyPoseLib.evaluation.score import score_result
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.studies import load_study
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.pipeline import register
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.projector import render
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.rendering.select import select_backend

STEP_MM = 2.0
PARTS = ("projector", "iteration", "limits", "registration", "scaling", "memory")


def main() -> int:
    """Run the chosen parts and write the tables after every one."""
    arguments = parse_arguments()
    if arguments.child:
        return memory_child()
    store = arguments.output / f"{arguments.name}.json"
    arguments.output.mkdir(parents=True, exist_ok=True)
    results = json.loads(store.read_text()) if store.is_file() else {}
    torch.set_num_threads(arguments.threads)
    backend = select_backend("auto", "cpu", arguments.threads)
    for part in arguments.parts:
        print(f"{part} ...", flush=True)
        results[part] = {
            "projector": lambda: time_projectors(arguments, backend),
            "iteration": lambda: time_iterations(arguments, backend),
            "limits": lambda: time_limits(arguments, backend),
            "registration": lambda: time_registrations(arguments),
            "scaling": lambda: time_growth(arguments, backend),
            "memory": lambda: measure_memory(),
        }[part]()
        results["machine"] = speed_machine(arguments.threads, backend)
        store.write_text(json.dumps(results, indent=1) + "\n")
        write_tables(results, arguments.output / f"{arguments.name}.md")
        print(json.dumps(results[part], indent=1), flush=True)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--rounds", type=int, default=5, help="turns of every contestant (default: 5)")
    parser.add_argument("--threads", type=int, default=2, help="of all contestants (default: 2)")
    parser.add_argument("--pixels", type=int, default=200, help="rows and columns (default: 200)")
    parser.add_argument(
        "--presets",
        nargs="+",
        default=["default", "fast", "paper", "paper/torch"],
        help="whole registrations: presets, each with a kernel if need be (default: default fast paper paper/torch; "
        "the last is the published method as plain torch runs it, and takes many minutes)",
    )
    parser.add_argument("--limit", type=float, default=7200, metavar="SECONDS", help="of one registration")
    parser.add_argument(
        "--quick", action="store_true", help="one round of small sizes: to see that it runs, not to quote"
    )
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where cases are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--name", default="speed", help="of the tables' files")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.rounds = 1
    return arguments


def interleaved(contestants: dict[str, Callable[[], object]], rounds: int) -> dict[str, dict[str, float]]:
    """Median and best seconds of every contestant, which take turns after one turn that does not count."""
    for run in contestants.values():
        run()
    seconds: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, run in contestants.items():
            gc.collect()
            start = time.perf_counter()
            run()
            seconds[name].append(time.perf_counter() - start)
    return {name: {"median": float(np.median(s)), "best": min(s)} for name, s in seconds.items()}


def add_if_there(
    contestants: dict[str, Callable[[], object]], name: str, make: Callable[[], Callable[[], object]]
) -> None:
    """Add a peer, or say that it is missing."""
    try:
        contestants[name] = make()
    except Missing as missing:
        print(f"left out: {missing}", flush=True)


def time_projectors(arguments: argparse.Namespace, backend: Backend) -> dict:
    """One forward rendering of the pelvis, samples 2 mm apart, and agreement with PolyPose's torch projector."""
    setting = pelvis(1, arguments.pixels)
    camera = setting.cameras[0]
    padded = attenuation_grid(setting.ct, None)
    inner = padded.affine.copy()
    inner[:3, 3] += inner[:3, :3] @ np.ones(3)
    bare = Grid(np.ascontiguousarray(padded.voxels[1:-1, 1:-1, 1:-1]), inner)
    body = Body(padded.voxels, padded.affine, setting.ct.bounds_center)
    matrices = [torch.tensor(m) for m in (padded.affine, camera.intrinsics, camera.extrinsic[None])]
    volume = torch.as_tensor(padded.voxels)

    def fused() -> np.ndarray:
        part = project_body(body, camera, np.eye(4), STEP_MM, backend)
        image = np.zeros((camera.height, camera.width), np.float32)
        row0, row1, column0, column1 = part.window
        image[row0:row1, column0:column1] = part.image
        return image

    contestants: dict[str, Callable[[], np.ndarray]] = {
        f"PolyPose ({backend.name})": fused,
        "PolyPose (torch, differentiable)": lambda: render(
            volume, *matrices, camera.height, camera.width, STEP_MM
        )[0].numpy(),
    }
    add_if_there(contestants, "diffdrr trilinear", lambda: diffdrr_projector(bare, camera, STEP_MM))
    add_if_there(contestants, "nanodrr", lambda: nanodrr_projector(bare, camera, STEP_MM))
    fine = render(volume, *matrices, camera.height, camera.width, 0.25)[0].numpy()
    times = interleaved(contestants, arguments.rounds)
    return {
        name: times[name] | {"relative_l2": float(np.linalg.norm(run() - fine) / np.linalg.norm(fine))}
        for name, run in contestants.items()
    }


def time_iterations(arguments: argparse.Namespace, backend: Backend) -> dict:
    """Value and gradient of the paper's objective: 2 views, 6 structures, 2 mm voxels and steps."""
    setting = pelvis(2, arguments.pixels)
    grid = regular_grid(setting.ct, STEP_MM)
    warp = weight_field(setting)
    objective = paper_objective(setting, grid.padded(), warp, STEP_MM, backend)
    contestants: dict[str, Callable[[], object]] = {
        "PolyPose, paper's objective": lambda: objective(setting.parameters),
        "PolyPose, paper's objective and curvature": lambda: objective.normal_equations(setting.parameters),
    }
    problem, state = bone_problem(setting, STEP_MM, backend)
    contestants["PolyPose, default's normal equations"] = lambda: problem.normal_equations(state)
    agreement = {}

    def official() -> Callable[[], object]:
        peer = OfficialIteration(grid, warp, objective, STEP_MM)
        with torch.no_grad():
            theirs = torch.stack(peer.images(peer.logs(setting.parameters))).numpy()
        logs = objective._about_one_centre(setting.parameters)
        ours = np.stack([projector.image(logs) for projector in objective.projectors])
        agreement["relative_l2"] = float(np.linalg.norm(theirs - ours) / np.linalg.norm(ours))
        return lambda: peer(setting.parameters)

    add_if_there(contestants, "official method", official)
    times = interleaved(contestants, arguments.rounds)
    samples = sum(int(p.rays.count.sum()) for p in objective.projectors)
    return {"times": times, "agreement": agreement, "samples": samples, "voxels": int(grid.voxels.size)}


def time_limits(arguments: argparse.Namespace, backend: Backend) -> dict:
    """The ray kernel against loads, arithmetic and memory, and the ray kernels' share of a registration."""
    setting = pelvis(1, arguments.pixels)
    padded = attenuation_grid(setting.ct, None)
    body = Body(padded.voxels, padded.affine, setting.ct.bounds_center)
    numba.set_num_threads(arguments.threads)
    rays = ray_limits(
        body, setting.cameras[0], STEP_MM, lambda contestants: interleaved(contestants, arguments.rounds)
    )
    folder = case_folder("pelvis", "2x30", 0, 2 * arguments.pixels, arguments.work)
    study = load_study(folder / "study.json")
    study = replace(study, options={**study.options, "device": "cpu", "threads": arguments.threads})
    register(study)  # loads what was compiled
    kernels: dict[str, float] = {}
    with watched_kernels(kernels):
        start = time.perf_counter()
        register(study)
        seconds = time.perf_counter() - start
    when = {"date": machine()["date"], "threads": arguments.threads}
    return {"rays": rays, "whole": {"seconds": seconds, "kernels": kernels}, "measured": when}


def time_registrations(arguments: argparse.Namespace) -> dict:
    """Whole registrations of the simulated pelvis in processes of their own."""
    folder = case_folder("pelvis", "2x30", 0, 2 * arguments.pixels, arguments.work)
    truth, rows = load_truth(folder / "truth"), {}
    for name in arguments.presets:
        preset, _, kernel = name.partition("/")
        study = with_kernel(folder / "study.json", kernel) if kernel else folder / "study.json"
        output = folder / f"speed_{preset}{kernel}"
        command = register_command(study, output, preset, threads=arguments.threads)
        row = run_measured(command, output.with_suffix(".txt"), arguments.limit)
        if row["exit_status"] in (0, 3):
            row |= {"summary": score_result(load_result(output), truth)["summary"]}
            row["stages"] = json.loads((output / "result.json").read_text())["seconds"]
        rows[name] = row
    return rows


def with_kernel(study: Path, kernel: str) -> Path:
    """A copy of a study's file beside it, with the option "kernel"."""
    fields = json.loads(study.read_text())
    fields["options"] = fields.get("options", {}) | {"kernel": kernel}
    copy = study.with_name(f"study_{kernel}.json")
    copy.write_text(json.dumps(fields))
    return copy


BASE = {"views": 2, "pixels": 200, "structures": 6, "voxels": 128}
GROWTH = {
    "views": (1, 2, 4),
    "pixels": (100, 200, 400),
    "structures": (3, 6, 12, 24),
    "voxels": (64, 128, 192),
}
QUICK_BASE = {"views": 1, "pixels": 64, "structures": 3, "voxels": 48}
QUICK_GROWTH = {"views": (1, 2), "pixels": (64, 128), "structures": (3, 6), "voxels": (48, 96)}


def time_growth(arguments: argparse.Namespace, backend: Backend) -> dict:
    """Seconds of one iteration against views, pixels and voxels a side, and structures, with fitted exponents."""
    rows, exponents = [], {}
    base, growth = (QUICK_BASE, QUICK_GROWTH) if arguments.quick else (BASE, GROWTH)
    for factor, values in growth.items():
        times = []
        for value in values:
            size = base | {factor: value}
            times.append(one_iteration(size, backend, arguments.rounds))
            rows.append({"factor": factor, **size, **times[-1]})
        exponents[factor] = {
            name: float(np.polyfit(np.log(values), np.log([t[name] for t in times]), 1)[0])
            for name in times[0]
        }
    return {"rows": rows, "exponents": exponents}


def one_iteration(size: dict[str, int], backend: Backend, rounds: int) -> dict[str, float]:
    """Median seconds of the paper's gradient and of the default's normal equations on a phantom."""
    setting = phantom(size["views"], size["pixels"], size["structures"], (size["voxels"],) * 3)
    objective = paper_objective(
        setting, attenuation_grid(setting.ct, None), weight_field(setting), STEP_MM, backend
    )
    problem, state = bone_problem(setting, STEP_MM, backend)
    times = interleaved(
        {
            "paper": lambda: objective(setting.parameters),
            "default": lambda: problem.normal_equations(state),
        },
        rounds,
    )
    return {name: each["median"] for name, each in times.items()}


def measure_memory() -> dict:
    """Peak resident memory of the paper's iteration with 26 structures on a CT of 512 x 512 x 400."""
    command = [sys.executable, str(Path(__file__).resolve()), "--child"]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(found.stdout.strip().splitlines()[-1])


def memory_child() -> int:
    """Two iterations in this process; prints its peak."""
    backend = select_backend("auto", "cpu", None)
    setting = phantom(2, 200, 26, (400, 512, 512))
    made = resident_mib("self")
    objective = paper_objective(
        setting, attenuation_grid(setting.ct, None), weight_field(setting), STEP_MM, backend
    )
    objective(setting.parameters)
    start = time.perf_counter()
    objective(setting.parameters)
    print(
        json.dumps(
            {
                "peak_mib": resident_mib("self"),
                "before_mib": made,
                "seconds": time.perf_counter() - start,
                "structures": 26,
                "shape": [400, 512, 512],
            }
        )
    )
    return 0


def speed_machine(threads: int, backend: Backend) -> dict[str, str]:
    """What the numbers were measured on, peers included."""
    import importlib.metadata

    found = machine() | {"threads": str(threads), "kernel": backend.name}
    for package in ("diffdrr", "nanodrr"):
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "absent"
    return found


if __name__ == "__main__":
    sys.exit(main())
