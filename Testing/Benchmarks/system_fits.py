"""Systems of ``polypose benchmark`` on one study, in a process of their own, scored as registrations are.

python Testing/Benchmarks/system_fits.py STUDY.json --system dense-r3 --output DIR
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np
from benchmark_runs import run_measured

from PolyPoseLib.benchmark.systems import SYSTEMS, load_system
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.truth import Truth
from PolyPoseLib.evaluation.score import camera_errors, score_motion
from PolyPoseLib.io.studies import load_study
from PolyPoseLib.io.transforms import read_transform, write_transform

TRANSFORM, MOTION = "transform.h5", "motion.json"

ITERATED = ("dense-r3", "dense-se3")
"""Systems that take a number of iterations."""


def fit_and_score(
    study: Path, truth: Truth, system: str, iterations: int | None, arguments: argparse.Namespace
) -> dict:
    """One row of a table, as register_and_score makes it.

    study: whose cameras are all known and true; iterations: the system's own when None; arguments: device, threads
    and limit.
    """
    name = system if iterations is None else f"{system}-{iterations}"
    output, log = study.parent / f"fit_{name}", study.parent / f"log_{name}.txt"
    shutil.rmtree(output, ignore_errors=True)
    command = [sys.executable, str(Path(__file__).absolute()), str(study), "--system", system]
    command += ["--output", str(output), "--device", arguments.device]
    command += ["--threads", str(arguments.threads or os.cpu_count() or 1)]
    command += [] if iterations is None else ["--iterations", str(iterations)]
    ran = run_measured(command, log, arguments.limit)
    if ran["exit_status"] != 0:
        return ran | {"failed": log.read_text().strip()[-500:]}
    return ran | scored(output, truth)


def scored(folder: Path, truth: Truth) -> dict:
    """What score_result gives of a registration; numbers of the bones' own poses are None where there are none."""
    motion = json.loads((folder / MOTION).read_text())
    poses = {name: np.array(motion["poses"].get(name, np.eye(4))) for name in truth.names}
    table = score_motion(poses, read_transform(folder / TRANSFORM), truth)
    for name, row in table["structures"].items():
        if name not in motion["poses"]:
            row |= {key: None for key in row if key.startswith("pose_")}
    if any(name not in motion["poses"] for name in truth.names if name != truth.anchor):
        table["summary"] |= {"mean_pose_tre_mm": None, "worst_pose_tre_mm": None}
    table["cameras"] = [camera_errors(camera, camera, truth) for camera in truth.cameras]
    return table | {"notes": motion["notes"]}


def main() -> int:
    """Fit, and write the field and the poses."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", type=Path)
    parser.add_argument("--system", required=True, choices=tuple(SYSTEMS))
    parser.add_argument("--output", type=Path, required=True, help="new folder")
    parser.add_argument("--iterations", type=int, metavar="N", help=f"of {', '.join(ITERATED)}")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="cpu", choices=("auto", "cpu", "cuda"))
    arguments = parser.parse_args()
    system = load_system(SYSTEMS[arguments.system])
    if arguments.iterations is not None:
        if arguments.system not in ITERATED:
            parser.error(f"--iterations is of {' and '.join(ITERATED)} only.")
        system = type(system)(arguments.iterations)  # pyright: ignore[reportCallIssue]
    motion = system.fit(load_study(arguments.study), SystemSetting(arguments.threads, arguments.device))
    arguments.output.mkdir(parents=True)
    write_transform(motion.field, arguments.output / TRANSFORM)
    poses = {name: np.asarray(pose).tolist() for name, pose in motion.poses.items()}
    (arguments.output / MOTION).write_text(json.dumps({"poses": poses, "notes": motion.notes}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
