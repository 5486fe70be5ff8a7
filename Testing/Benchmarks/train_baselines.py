"""LiftReg and 2D3D-RegNet trained on simulated motions of a public CT: do they learn, and what do they reach?

A network is trained on motions of one CT, simulated at the network's resolution, and keeps the weights that are best on
held-out motions. It is then tested as the benchmark runs it, by `fit`, on further motions that are simulated at the
CT's own resolution: with other X-rays, other noise and other seeds than any in the training.

    python Testing/Benchmarks/train_baselines.py --samples pelvis --systems liftreg --steps 300
    python Testing/Benchmarks/train_baselines.py --samples pelvis chest --minutes 30

Weights are kept in --work; with --resume a training goes on from its checkpoint there.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_cases import DISTANCES_MM, parse_views
from benchmark_runs import RESULTS
from benchmark_tables import machine, table

from PolyPoseLib.baselines.liftreg import LiftReg
from PolyPoseLib.baselines.regnet import RegNet
from PolyPoseLib.baselines.trained.simulated_pairs import SimulatedPatient, bone_points, simulated_pairs
from PolyPoseLib.baselines.trained.training import Training, TrainingPlan
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.structures import structures_from_labels
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io.camera_models import read_tensors, write_tensors
from PolyPoseLib.io.samples import CT_FILE, LABELS_FILE, fetch_sample, sample_named
from PolyPoseLib.io.volumes import read_ct, read_volume
from PolyPoseLib.simulation.simulate import (
    SimulatedCase,
    SimulationOptions,
    arc_angles,
    simulate_case,
    structures_centre,
    view_cameras,
)
from PolyPoseLib.warp.dense import jacobian_determinant

NAME = "trained_baselines"
SYSTEMS = {"liftreg": LiftReg, "2d3d-regnet": RegNet}
TEST_SEED = 9000
DETECTOR_MM = 430.0

LEGEND = """\
One CT, motions drawn at random about every joint. Held-out: mean distance at the moving bones between the network's
displacement and the truth, over held-out motions at the network's resolution, at its best; these motions choose the
weights. Test: the same by `fit` on further motions simulated at the CT's own resolution, mean and worst case; folds:
share of the field's nodes whose Jacobian determinant is 0 or less. Rest: doing nothing.
"""


def main() -> None:
    """Train and test what is asked for, and write the tables after every system."""
    arguments = parse_arguments()
    arguments.output.mkdir(parents=True, exist_ok=True)
    for sample in arguments.samples:
        patient = load_patient(sample, arguments)
        for system in arguments.systems:
            row = train_and_test(sample, system, patient, arguments)
            put(row, arguments.output)


def load_patient(sample: str, arguments: argparse.Namespace) -> dict[str, Any]:
    """CT, structures, anchor and cameras of a sample."""
    folder, known = fetch_sample(sample), sample_named(sample)
    ct = read_ct(folder / CT_FILE)
    labels = read_volume(folder / LABELS_FILE)
    structures = structures_from_labels(
        Volume(labels.voxels.astype(np.int16), ct.affine), known.structures, ct
    )
    count, arc = parse_views(arguments.views)
    # The places of a benchmark's sources: a network knows only those that it was trained with.
    isocenter = structures_centre(structures, ct.affine)
    cameras = view_cameras(ct, arc_angles(count, arc), arguments.pixels, DETECTOR_MM, isocenter=isocenter)
    return {"ct": ct, "structures": structures, "anchor": known.anchor, "cameras": cameras}


def train_and_test(
    sample: str, system: str, patient: dict[str, Any], arguments: argparse.Namespace
) -> dict[str, Any]:
    """One row: settings, the training's report and the scores of every test."""
    arguments.work.mkdir(parents=True, exist_ok=True)
    path = arguments.work / f"{sample}-{arguments.views}-{system}.pt"
    checkpoint = path.with_name(path.name + ".checkpoint")
    began, cpu = time.perf_counter(), time.process_time()
    coarse = SimulatedPatient.of(**patient, side=arguments.side)
    pairs = TrainingSet.collected(
        simulated_pairs([coarse], arguments.seed, SimulationOptions(projector=arguments.projector)),
        (arguments.pairs, arguments.held_out),
        arguments.side,
    )
    made = time.process_time() - cpu
    print(f"{sample} {system}: {arguments.pairs} pairs after {made:.0f} CPU seconds", flush=True)
    plan = TrainingPlan(
        minutes=arguments.minutes,
        steps=arguments.steps,
        batch=arguments.batch,
        validate_every=arguments.validate_every,
        seed=arguments.seed,
    )

    def keep(fields: dict[str, Any]) -> None:
        write_tensors(fields, checkpoint)
        last = fields["history"][-1]
        print(json.dumps(last), flush=True)

    method = SYSTEMS[system]()
    earlier = read_tensors(checkpoint, "checkpoint") if arguments.resume and checkpoint.is_file() else None
    weights = Training(method, pairs, plan, keep).run(Monitor(None, None), earlier)
    write_tensors(weights.to_fields(), path)
    trained = time.process_time() - cpu
    tests = [test(method, path, patient, TEST_SEED + number) for number in range(arguments.tests)]
    return {
        "sample": sample,
        "system": system,
        "views": arguments.views,
        "side": arguments.side,
        "pixels": arguments.pixels,
        "seed": arguments.seed,
        "batch": arguments.batch,
        "report": weights.report,
        "cpu_seconds": {"pairs": made, "pairs_and_training": trained},
        "wall_seconds": time.perf_counter() - began,
        "parameters": sum(value.numel() for name, value in weights.state.items() if "." in name),
        "weights_mib": path.stat().st_size / 2**20,
        "tests": tests,
        "machine": machine(),
    }


def test(method: Any, path: Path, patient: dict[str, Any], seed: int) -> dict[str, float]:
    """Scores of one motion at the CT's own resolution, found as the benchmark finds it."""
    case = simulate_case(**patient, seed=seed, options=SimulationOptions(node_mm=6.0, projector="sum"))
    began, cpu = time.perf_counter(), time.process_time()
    motion = method.fit(study_of(case), SystemSetting(weights={method.name: path}))
    seconds, cpu_seconds = time.perf_counter() - began, time.process_time() - cpu
    points, moved = bone_points(case, seed)
    folds = 100 * float((jacobian_determinant(motion.field) <= 0).mean())
    return {
        "seed": seed,
        "rest_mm": float(np.linalg.norm(moved, axis=1).mean()),
        "tre_mm": float(np.linalg.norm(motion.field.sample(points) - moved, axis=1).mean()),
        "folds_percent": folds,
        "seconds": seconds,
        "cpu_seconds": cpu_seconds,
    }


def study_of(case: SimulatedCase) -> Study:
    """The case as a study with the true cameras."""
    pairs = zip(case.images, case.cameras, strict=True)
    return Study(
        case.ct, case.structures, case.anchor, tuple(_xray(image, camera) for image, camera in pairs)
    )


def _xray(image: np.ndarray, camera: Camera) -> Xray:
    """A simulated X-ray with a known camera."""
    pitch = DETECTOR_MM / camera.width
    return Xray(
        image,
        np.ones(image.shape, bool),
        camera.intrinsics,
        camera.extrinsic,
        "known",
        (pitch, pitch),
        float(camera.intrinsics[0, 0] * pitch),
    )


def put(row: dict[str, Any], output: Path) -> None:
    """Add a row in the place of an earlier one of the same sample, system and views, and write the tables."""
    path = output / f"{NAME}.json"
    rows = json.loads(path.read_text())["rows"] if path.is_file() else []
    key = ("sample", "system", "views", "side")
    rows = [each for each in rows if any(each[name] != row[name] for name in key)] + [row]
    rows.sort(key=lambda each: [str(each[name]) for name in key])
    for target, text in (
        (path, json.dumps({"rows": rows}, indent=1) + "\n"),
        (path.with_suffix(".md"), page(rows)),
    ):
        temporary = target.with_name(target.name + ".part")
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, target)


def page(rows: list[dict[str, Any]]) -> str:
    """The tables, as Markdown."""
    head = ["sample", "system", "views", "nodes", "pairs", "steps", "CPU min", "held-out mm", "rest mm",
            "test mm (worst)", "rest mm", "better than rest", "folds %", "fit CPU s"]  # fmt: skip
    body, curves = [], []
    for row in rows:
        report, tests = row["report"], row["tests"]
        errors, rests = ([each[name] for each in tests] for name in ("tre_mm", "rest_mm"))
        better = sum(a < b for a, b in zip(errors, rests, strict=True))
        body.append([
            row["sample"], row["system"], row["views"], f"{row['side']}^3", str(report["pairs"]), str(report["steps"]),
            f"{row['cpu_seconds']['pairs_and_training'] / 60:.1f}", f"{report['held_out_mm']:.2f}",
            f"{report['rest_mm']:.2f}", f"{np.mean(errors):.2f} ({max(errors):.2f})", f"{np.mean(rests):.2f}",
            f"{better} of {len(tests)}", f"{np.mean([each['folds_percent'] for each in tests]):.3f}",
            f"{np.mean([each['cpu_seconds'] for each in tests]):.1f}",
        ])  # fmt: skip
        points = [
            [
                str(each["step"]),
                f"{each['loss']:.4f}",
                f"{each['held_out_loss']:.4f}",
                f"{each['held_out_mm']:.2f}",
            ]
            for each in report["curve"]
        ]
        title = f"## {row['sample']}, {row['system']}, {row['views']}, {row['side']}^3 nodes"
        curves.append(f"{title}\n\n" + table(["step", "loss", "held-out loss", "held-out mm"], points))
    return f"# Trained systems\n\n{LEGEND}\n{table(head, body)}\n\n" + "\n\n".join(curves) + "\n"


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", nargs="+", choices=tuple(DISTANCES_MM), default=["pelvis"])
    parser.add_argument("--systems", nargs="+", choices=tuple(SYSTEMS), default=list(SYSTEMS))
    parser.add_argument("--views", default="2x90", help="number of views x arc in degrees (default: 2x90)")
    parser.add_argument("--pixels", type=int, default=200, help="of an X-ray's side (default: 200)")
    parser.add_argument("--side", type=int, default=64, help="nodes of the network's grid (default: 64)")
    parser.add_argument("--pairs", type=int, default=96, help="to train on (default: 96)")
    parser.add_argument("--held-out", type=int, default=8, help="pairs that choose the weights (default: 8)")
    parser.add_argument("--tests", type=int, default=6, help="motions for the test (default: 6)")
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--minutes", type=float, help="longest wall time of each training")
    parser.add_argument("--validate-every", type=int, default=25)
    parser.add_argument(
        "--projector", choices=("auto", "rtk", "sum"), default="auto", help="of the training X-rays"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--work", type=Path, default=Path("trained-baselines"), help="folder of weights")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--resume", action="store_true", help="go on from the checkpoints in --work")
    return parser.parse_args()


if __name__ == "__main__":
    main()
