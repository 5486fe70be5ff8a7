"""Bones in motion: how well are they followed, how honest are the intervals, and what does a frame cost?

Three bones of a knee bend by 60 degrees in front of calibrated cameras. Bones are rigid volumes whose shafts go on
where the CT ends, each projected by itself by another program than the product's renderer; the soft tissue is drawn
anew around the bones in every frame, so that it follows no model of the product's; photons, scatter, blur and 12 bits
are those of a C-arm. In "pelvis" the hips of a real CT bend, and soft tissue follows Laplace's equation
(PolyPoseLib.simulation.sequences). Every sequence is tracked in a process of its own. "loop" registers a few frames of
the same sequence by themselves, each given the cameras that the true pose of the anchor makes: the other bones alone
are to be found.

    python Testing/Benchmarks/tracking.py --seeds 10 11 12
    python Testing/Benchmarks/tracking.py --cases one_view jump --frames 40

Rows that are in the results file already are not run again unless --again is given. The numbers of
PolyPoseLib/tracking/intervals.py were chosen on seed 0; the tables hold others.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_runs import RESULTS, run_measured
from benchmark_store import Row, Store
from benchmark_tables import machine
from scipy.stats import chi2
from tracking_tables import describe, write_tables

from PolyPoseLib.data.study import Study
from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.rigid import perturbation_between, rigid_inverse
from PolyPoseLib.pipeline import register
from PolyPoseLib.tracking.follow import track

sys.path.insert(0, str(Path(__file__).parents[1] / "Core" / "support"))
from moving_knee import KneeOptions, MovingKnee

NAME = "tracking"

FIELDS = ("case", "method", "seed", "frames", "pixels")
"""What tells one row from another."""


@dataclass(frozen=True)
class Case:
    """says: what the tables call it; knee: how the knee differs, none when it has the images of "knee"; views: how many
    of the cameras are used; blank: shares of the frames between which the first camera shows nothing.
    """

    says: str
    knee: dict[str, Any]
    views: int = 2
    blank: tuple[float, float] = (0.0, 0.0)


CASES = {
    "knee": Case("two views 70 degrees apart", {}),
    "overlap": Case(
        "the patella passes behind the femur in the first view for a fifth of the frames",
        {"passing_mm": (40, 38)},
    ),
    "blank": Case("the first camera shows nothing in a tenth of the frames", {}, blank=(0.45, 0.55)),
    "jump": Case("everything jumps by 15 mm and 7.5 degrees in the middle", {"jump_mm": 15.0}),
    "one_view": Case("the first view alone", {}, views=1),
    "pelvis": Case("hips of a real CT, soft tissue by Laplace's equation, two views 70 degrees apart", {}),
}

METHODS = ("track", "smooth", "loop")

LOOP_FRAMES = 3
"""Frames that "loop" registers."""

SILENT_MM = 2.0
"""An error beyond which a pose must be flagged, or its interval hold it."""


def main() -> int:
    """Run what is missing and write the tables after every row."""
    arguments = parse_arguments()
    if arguments.child is not None:
        run_child(arguments)
        return 0
    store = Store(
        arguments.output / f"{NAME}.json",
        FIELDS,
        partial(write_tables, says={name: case.says for name, case in CASES.items()}),
    )
    keys = [
        {"case": case, "method": method, "seed": seed, "frames": arguments.frames, "pixels": arguments.pixels}
        for case in arguments.cases
        for seed in arguments.seeds
        for method in arguments.methods
    ]
    store.run(
        store.missing(keys, arguments.again), arguments.jobs, partial(run_row, arguments=arguments), describe
    )
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", nargs="+", choices=CASES, default=["knee"])
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=["track"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[10, 11, 12])
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--pixels", type=int, default=500, help="rows and columns of an image of 220 mm")
    parser.add_argument("--jobs", type=int, default=1, help="sequences at a time")
    parser.add_argument("--threads", type=int, default=1, help="of one tracking")
    parser.add_argument("--limit", type=float, default=7200, metavar="SECONDS", help="of one tracking")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where images are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--again", action="store_true", help="run rows again that are there already")
    parser.add_argument("--child", nargs=3, metavar=("CASE", "METHOD", "SEED"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    return arguments


@dataclass(frozen=True)
class Truth:
    """A sequence and its true poses (F, K, 4, 4)."""

    sequence: Sequence
    poses: np.ndarray


class StoredImages:
    """Images that are made once, and then read from a file."""

    def __init__(self, images: np.ndarray, blank: range) -> None:
        self.images, self.blank = images, blank

    @property
    def count(self) -> int:
        return len(self.images)

    def read(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        image = self.images[index]
        return np.full_like(image, 0.5) if index in self.blank else np.array(image), np.ones(
            image.shape, bool
        )


def truth_of(name: str, seed: int, arguments: argparse.Namespace) -> Truth:
    """A case's sequence, with images from the work folder where they are there already."""
    case = CASES[name]
    truth = pelvis(seed, arguments) if name == "pelvis" else knee(case, seed, arguments)
    source = name if case.knee or name == "pelvis" else "knee"
    path = arguments.work / f"{source}-{seed}-{arguments.frames}-{arguments.pixels}.npy"
    if not path.is_file():
        images = [[view.images.read(f)[0] for f in range(arguments.frames)] for view in truth.sequence.views]
        part = path.with_suffix(".part.npy")
        np.save(part, np.array(images, np.float32))
        part.replace(path)
    images = np.load(path, mmap_mode="r")
    blank = range(*(int(share * arguments.frames) for share in case.blank))
    views = tuple(
        replace(view, images=StoredImages(images[n], blank if n == 0 else range(0)))
        for n, view in enumerate(truth.sequence.views[: case.views])
    )
    return Truth(replace(truth.sequence, views=views), truth.poses)


def knee(case: Case, seed: int, arguments: argparse.Namespace) -> Truth:
    """The knee, started 1 degree and 1 mm off its true poses."""
    options = KneeOptions(
        pixels=arguments.pixels, frames=arguments.frames, flexion_deg=60.0, spacing_mm=1.2, **case.knee
    )
    made = MovingKnee(seed, options)
    sequence = made.sequence()
    rng = np.random.default_rng([seed, 3])
    given = {name: _roughly(pose, rng) for name, pose in sequence.initial_poses.items()}
    return Truth(replace(sequence, initial_poses=given), made.poses)


def pelvis(seed: int, arguments: argparse.Namespace) -> Truth:
    """Hips of the sample CT that bend by 60 degrees and back."""
    from benchmark_cases import STRUCTURES

    from PolyPoseLib.data.structures import structures_from_labels
    from PolyPoseLib.io.samples import CT_FILE, LABELS_FILE, fetch_sample
    from PolyPoseLib.io.volumes import read_ct, read_volume
    from PolyPoseLib.simulation.sequence_options import SequenceOptions
    from PolyPoseLib.simulation.sequences import rig_cameras, simulate_sequence

    folder = fetch_sample("pelvis")
    ct = read_ct(folder / CT_FILE)
    names = ("pelvis", "femur_left", "femur_right")
    groups = {name: STRUCTURES["pelvis"][name] for name in names}
    structures = structures_from_labels(read_volume(folder / LABELS_FILE), groups, ct)
    options = SequenceOptions(frames=arguments.frames, motion="flexion", amplitude=60.0)
    cameras = rig_cameras(ct, structures, (20.0, 90.0), arguments.pixels, 430.0)
    made = simulate_sequence(ct, structures, cameras, seed=seed, options=options, reference="pelvis")
    return Truth(made.tracked(TrackOptions(threads=1), kept=False), made.poses)


def run_row(key: Row, arguments: argparse.Namespace) -> Row:
    """Track one sequence in a process of its own, and score what came out."""
    truth = truth_of(key["case"], key["seed"], arguments)
    output = output_of(key, arguments)
    output.unlink(missing_ok=True)
    command = [sys.executable, __file__, "--child", key["case"], key["method"], str(key["seed"])]
    for name in ("frames", "pixels", "threads", "work", "output"):
        command += [f"--{name}", str(getattr(arguments, name))]
    ran = run_measured(command, output.with_suffix(".log"), arguments.limit)
    row = key | {
        name: ran[name] for name in ("exit_status", "wall_seconds", "cpu_seconds", "peak_memory_mib")
    }
    found = machine()
    row["measured_on"] = {name: found[name] for name in ("processor", "cores", "date", "python", "polypose")}
    row["measured_on"] |= {"device": "cpu", "threads": arguments.threads}
    if output.is_file():
        row |= score(dict(np.load(output)), truth)
    else:
        row["message"] = output.with_suffix(".log").read_text().strip()[-400:]
    return row


def output_of(key: Row, arguments: argparse.Namespace) -> Path:
    """Where the child leaves what it found."""
    name = "-".join(str(key[field]) for field in FIELDS)
    return arguments.work / f"{name}.found.npz"


def run_child(arguments: argparse.Namespace) -> None:
    """Track, or register some frames one by one, and leave arrays for the parent."""
    case, method, seed = arguments.child
    key = {
        "case": case,
        "method": method,
        "seed": int(seed),
        "frames": arguments.frames,
        "pixels": arguments.pixels,
    }
    truth = truth_of(case, int(seed), arguments)
    sequence = truth.sequence
    options = replace(sequence.options, threads=arguments.threads, smooth=method == "smooth")
    if method == "loop":
        found = loop(truth, arguments)
    else:
        result = track(replace(sequence, options=options))
        found = {
            "frames": result.numbers,
            "poses": result.poses,
            "covariances": result.covariances,
            "doubtful": result.doubtful,
            "lost": np.array([[source == "none" for source in each.sources] for each in result.frames]),
            "seconds": np.array([each.cpu_seconds for each in result.frames]),
        }
    np.savez(output_of(key, arguments), **found)


def loop(truth: Truth, arguments: argparse.Namespace) -> dict[str, np.ndarray]:
    """Whole registrations of some frames, in the world of the true pose of the anchor."""
    sequence = truth.sequence
    anchor = sequence.structures.index(sequence.reference)
    numbers = np.linspace(0, len(truth.poses) - 1, LOOP_FRAMES + 2).astype(int)[1:-1]
    poses, covariances, seconds, flagged = [], [], [], []
    for number in numbers:
        true = truth.poses[number, anchor]
        xrays = []
        for view in sequence.views:
            image, mask = view.images.read(view.first + int(number))
            extrinsic = view.camera.extrinsic @ rigid_inverse(true)
            xrays.append(
                Xray(image, mask, view.camera.intrinsics, extrinsic, "known", (0.5, 0.5), 1000.0, view.name)
            )
        study = Study(
            sequence.ct,
            sequence.structures,
            sequence.reference,
            tuple(xrays),
            {"device": "cpu", "threads": arguments.threads},
        )
        before = time.process_time()
        result = register(study)
        seconds.append(time.process_time() - before)
        found = [result.structures[name] for name in sequence.structures.names]
        poses.append([each.fixed_to_moving @ true for each in found])
        flagged.append([bool(each.doubts or result.distrust) for each in found])
        covariances.append(
            [
                np.array(each.uncertainty["covariance"]) if each.uncertainty else np.full((6, 6), np.nan)
                for each in found
            ]
        )
    return {
        "frames": numbers,
        "poses": np.array(poses),
        "covariances": np.array(covariances),
        "doubtful": np.array(flagged),
        "lost": np.zeros((len(numbers), len(sequence.structures.names)), bool),
        "seconds": np.array(seconds),
    }


def score(found: dict[str, np.ndarray], truth: Truth) -> Row:
    """Errors, coverage and seconds of one row."""
    sequence = truth.sequence
    structures, ct = sequence.structures, sequence.ct
    centres = structures.centroids(ct.affine)
    surfaces = [_surface(structures.mask(name), ct) for name in structures.names]
    bones = {}
    view = sequence.views[0]
    for k, name in enumerate(structures.names):
        true = truth.poses[found["frames"], k]
        errors = np.stack(
            [perturbation_between(a, b, centres[k]) for a, b in zip(found["poses"][:, k], true, strict=True)]
        )
        covariances = found["covariances"][:, k]
        known = np.isfinite(covariances).all(axis=(1, 2)) & (np.linalg.norm(errors, axis=1) > 1e-9)
        if not known.any():
            continue  # the anchor of a registration
        in_fixed = rigid_inverse(true) @ np.r_[centres[k], 1.0]
        beams = np.einsum("fab,fb->fa", true[:, :3, :3], in_fixed[:, :3] - view.camera.source)
        beams /= np.linalg.norm(beams, axis=1, keepdims=True)
        along = np.einsum("fa,fa->f", errors[:, 3:], beams)
        along_sd = np.sqrt(np.einsum("fa,fab,fb->f", beams, covariances[:, 3:, 3:], beams))
        sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
        distance = np.einsum("fa,fab,fb->f", errors, np.linalg.inv(covariances), errors)
        inside = distance <= chi2.ppf(0.95, 6)
        mm = np.linalg.norm(errors[:, 3:], axis=1)
        silent = (mm > SILENT_MM) & ~found["doubtful"][:, k] & ~found["lost"][:, k] & ~inside
        moved = [_surface_error(surfaces[k], a, b) for a, b in zip(found["poses"][:, k], true, strict=True)]
        bones[name] = {
            "mm": _list(mm),
            "surface_mm": _list(np.array(moved)),
            "deg": _list(np.degrees(np.linalg.norm(errors[:, :3], axis=1))),
            "along_mm": _list(along),
            "across_mm": _list(np.sqrt(np.maximum(mm**2 - along**2, 0))),
            "inside_along": float((np.abs(along) <= 1.96 * along_sd).mean()),
            "inside_each": ((np.abs(errors) <= 1.96 * sd).mean(axis=0)).tolist(),
            "ratio": np.sqrt(((errors / sd) ** 2).mean(axis=0)).tolist(),
            "inside": float(inside.mean()),
            "along_interval_mm": float(1.96 * along_sd.mean()),
            "lost": int(found["lost"][:, k].sum()),
            "doubtful": int(found["doubtful"][:, k].sum()),
            "silent": int(silent.sum()),
        }
    return {"bones": bones, "seconds_a_frame": float(found["seconds"].mean())}


def _list(values: np.ndarray) -> list[float]:
    return np.round(values, 4).tolist()


def _surface(mask: np.ndarray, ct) -> np.ndarray:
    """(N, 3) LPS mm, some voxels of a structure's surface."""
    from scipy.ndimage import binary_erosion

    index = np.argwhere(mask & ~binary_erosion(mask))[:, ::-1]
    return ct.to_world(index[:: max(1, len(index) // 500)].astype(float))


def _surface_error(points: np.ndarray, found: np.ndarray, true: np.ndarray) -> float:
    """Root mean square distance (mm) between where two poses have a bone's surface."""
    both = [rigid_inverse(pose) for pose in (found, true)]
    places = [points @ each[:3, :3].T + each[:3, 3] for each in both]
    return float(np.sqrt(((places[0] - places[1]) ** 2).sum(axis=1).mean()))


def _roughly(pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A pose about a degree and a millimetre off."""
    from PolyPoseLib.geometry.rigid import perturbation

    turn, shift = rng.normal(size=(2, 3))
    turn, shift = np.radians(1.0) * turn / np.linalg.norm(turn), shift / np.linalg.norm(shift)
    return perturbation(np.r_[turn, shift]) @ pose


if __name__ == "__main__":
    sys.exit(main())
