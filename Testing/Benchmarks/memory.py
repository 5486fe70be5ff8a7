"""Whole registrations of 26 structures on a CT of 512 x 512 x 400: seconds of every stage and peak memory.

A synthetic spine with ribs is drawn in two postures, at rest for the CT and moved for two X-rays 45 degrees apart,
whose cameras are known to 4 degrees and 15 mm only; ITK-RTK renders. The registration runs as its own process, as
a user runs it.

    python Testing/Benchmarks/memory.py --presets fast default
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from benchmark_runs import RESULTS, register_command, run_measured
from benchmark_tables import machine, measured_on, table
from memory_phantom import SHAPE, draw, draw_poses

from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.evaluation.metrics import structure_errors
from PolyPoseLib.io.volumes import read_volume, write_volume
from PolyPoseLib.io.xray.storage import Storage
from PolyPoseLib.io.xray.writer import Stand, write_xray_dicom
from PolyPoseLib.simulation import independent_projector
from PolyPoseLib.simulation.simulate import perturbed_camera, view_cameras
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

GOAL_MIB = 8192
VIEW_ANGLES_DEG = (0.0, 45.0)
SOURCE_TO_DETECTOR_MM, SOURCE_TO_ISOCENTER_MM = 1300.0, 1000.0
DETECTOR_MM = 560.0
CAMERA_ERROR = (4.0, 15.0)
"""Of the initial cameras: degrees and mm."""


def main() -> int:
    """Make the case if necessary, register it with every preset, and write the tables after each."""
    arguments = parse_arguments()
    arguments.output.mkdir(parents=True, exist_ok=True)
    store = arguments.output / f"{arguments.name}.json"
    rows = json.loads(store.read_text())["rows"] if store.is_file() else []
    shape = tuple(arguments.shape[::-1])
    folder = phantom_case(shape, arguments.pixels, arguments.work)
    for preset in arguments.presets:
        row = {"preset": preset, "shape": list(shape), "pixels": arguments.pixels}
        row |= {"threads": arguments.threads} | run_preset(folder, preset, arguments)
        same = ("preset", "shape", "pixels", "threads")
        rows = [each for each in rows if any(each[key] != row[key] for key in same)] + [row]
        store.write_text(json.dumps({"machine": machine(), "rows": rows}, indent=1) + "\n")
        (arguments.output / f"{arguments.name}.md").write_text(tables(rows), encoding="utf-8")
        print(tables([row]), flush=True)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--presets", nargs="+", default=["fast"], choices=("fast", "default", "paper"))
    parser.add_argument(
        "--shape", nargs=3, type=int, default=SHAPE[::-1], metavar=("I", "J", "K"), help="voxels of the CT"
    )
    parser.add_argument("--pixels", type=int, default=1000, help="rows and columns of an X-ray")
    parser.add_argument("--threads", type=int, help="of a registration (default: all)")
    parser.add_argument("--limit", type=float, default=7200, metavar="SECONDS", help="of one registration")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where the case is kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--name", default="memory", help="of the tables' files")
    return parser.parse_args()


def phantom_case(shape: tuple[int, int, int], pixels: int, work: Path) -> Path:
    """The folder of the case, made unless it is there; shape: (k, j, i)."""
    folder = work / f"phantom-{'x'.join(str(n) for n in shape[::-1])}-{pixels}px"
    if (folder / "study.json").is_file():
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    ct, structures = draw(shape=shape)
    write_volume(ct.with_voxels(np.rint(ct.voxels).astype(np.int16)), folder / "ct.nii.gz")
    write_volume(Volume(structures.labels, ct.affine), folder / "labels.nii.gz")
    moved, _ = draw(draw_poses(0), shape)
    fields = {
        "version": 1,
        "ct": "ct.nii.gz",
        "segmentation": "labels.nii.gz",
        "structures": {name: [n] for n, name in enumerate(structures.names, start=1)},
        "anchor": structures.names[0],
        "xrays": xrays(moved, structures.centroids(ct.affine)[0], pixels, folder),
        "options": {},
    }
    (folder / "study.json").write_text(json.dumps(fields, indent=1) + "\n")
    return folder


def xrays(ct: Volume, anchor: np.ndarray, pixels: int, folder: Path) -> list[dict]:
    """Write two X-rays (XA) of the moved CT; their entries in the study."""
    rng, entries = np.random.default_rng(0), []
    attenuation = ct.with_voxels(hounsfield_to_attenuation(ct.voxels).astype(np.float32))
    cameras = view_cameras(
        ct,
        VIEW_ANGLES_DEG,
        pixels,
        DETECTOR_MM,
        SOURCE_TO_DETECTOR_MM,
        SOURCE_TO_ISOCENTER_MM,
    )
    for n, camera in enumerate(cameras, start=1):
        image = measure(independent_projector.project(attenuation, camera), XrayPhysics(), rng)
        initial = perturbed_camera(camera, anchor, rng, *CAMERA_ERROR)
        write_xray_dicom(
            folder / f"xray_{n}.dcm",
            image,
            Stand(
                source_to_detector_mm=SOURCE_TO_DETECTOR_MM,
                pixel_spacing_mm=(DETECTOR_MM / pixels,) * 2,
                source_to_isocenter_mm=SOURCE_TO_ISOCENTER_MM,
                extrinsic=initial.extrinsic,
            ),
            Storage(bits=XrayPhysics().bits, saturation=XrayPhysics().saturation),
            description=f"view {n}",
            study="synthetic spine with ribs",
        )
        entry = {"name": f"view {n}", "image": f"xray_{n}.dcm", "camera": "initial"}
        entries.append(entry | {"extrinsic": initial.extrinsic.tolist()})
    return entries


def run_preset(folder: Path, preset: str, arguments: argparse.Namespace) -> dict:
    """Register and compare the motions with the true ones."""
    output, log = folder / f"result_{preset}", folder / f"log_{preset}.txt"
    command = register_command(folder / "study.json", output, preset, threads=arguments.threads)
    row = run_measured(command, log, arguments.limit)
    if row["exit_status"] not in (0, 3) or not (output / "result.json").is_file():
        return row | {"failed": log.read_text().strip()[-500:]}
    result = json.loads((output / "result.json").read_text())
    true = draw_poses(0)
    labels = read_volume(folder / "labels.nii.gz")
    found = np.array([result["structures"][name]["fixed_to_moving"] for name in true])
    tre, rest = (errors_mm(labels, true, poses) for poses in (found, np.stack([np.eye(4)] * len(true))))
    return row | {
        "stages": result["seconds"],
        "mean_tre_mm": float(tre.mean()),
        "worst_tre_mm": float(tre.max()),
        "rest_tre_mm": float(rest.mean()),
    }


def errors_mm(labels: Volume, true: dict[str, np.ndarray], poses: np.ndarray) -> np.ndarray:
    """Mean TRE of every bone but the anchor, for poses (K, 4, 4)."""
    names, motions = tuple(true), np.stack(list(true.values()))
    errors = structure_errors(labels.voxels, labels.affine, names, motions, poses, 2000)
    return np.array([errors[name]["mean"] for name in names[1:]])


def tables(rows: list[dict]) -> str:
    """All rows' totals, and their stages."""
    parts = [
        "# Memory and time of a large case\n",
        f"26 structures of a synthetic CT, 2 views. The goal is {GOAL_MIB} MiB. TRE: of the bones' rigid motions, mean "
        "over bones and worst bone.\n",
        table(
            [
                *("preset", "CT", "pixels", "threads", "peak MiB", "seconds", "CPU seconds"),
                *("TRE at rest mm", "mean TRE mm", "worst TRE mm"),
            ],
            [_totals(row) for row in rows],
        ),
    ]
    scored = [row for row in rows if "failed" not in row]
    stages = list(dict.fromkeys(stage for row in scored for stage in row["stages"] if stage != "total"))
    parts += [
        "## Seconds per stage\n",
        table(
            ["stage", *(f"{row['preset']}, {_size(row)}" for row in scored)],
            [[stage, *(_seconds(row["stages"].get(stage)) for row in scored)] for stage in (*stages, "total")]
            + [
                [
                    "start, reading, writing",
                    *(_seconds(row["wall_seconds"] - row["stages"]["total"]) for row in scored),
                ]
            ],
        ),
        measured_on(machine()),
    ]
    return "\n".join(parts)


def _totals(row: dict) -> list[str]:
    """Cells of the first table."""
    head = [row["preset"], _size(row), str(row["pixels"]), str(row["threads"] or "all")]
    head += [f"{row['peak_memory_mib']:.0f}", f"{row['wall_seconds']:.0f}"]
    head.append(f"{row['cpu_seconds']:.0f}")
    if "failed" in row:
        return [*head, "-", f"failed ({row['exit_status']})", "-"]
    return [*head, f"{row['rest_tre_mm']:.2f}", f"{row['mean_tre_mm']:.2f}", f"{row['worst_tre_mm']:.2f}"]


def _size(row: dict) -> str:
    """The CT's voxels i x j x k."""
    return " x ".join(str(n) for n in reversed(row["shape"]))


def _seconds(value: float | None) -> str:
    """Seconds as a cell."""
    return "-" if value is None else f"{value:.1f}"


if __name__ == "__main__":
    sys.exit(main())
