"""Learned initial cameras against those of the search, both before and after the same refinement.

Test views as in cameras.py, around one standard view: independent renderings with noise, other bones moved. Compared
are the learned prediction, before anything is refined, with the first hypothesis of the search's exhaustive part,
before it is refined; then both after the refinement that every registration starts with; then both complete methods
(several initial cameras, refined level by level, and scored).

    python Testing/Benchmarks/learned_cameras.py --anatomy pelvis --view AP --minutes 30

trains a model first, unless --model names one. Views that are in the results file already are not run again.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from benchmark_cases import STRUCTURES, load_anatomy
from benchmark_tables import machine
from cameras import FOUND_MM, RESULTS, SOURCE_TO_DETECTOR_MM, random_camera, random_views, view_name, xray_of

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import PolyPoseError
from PolyPoseLib.evaluation.metrics import mask_points, projection_error_mm
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS
from PolyPoseLib.io.camera_models import load_regressor, read_tensors, save_model, write_tensors
from PolyPoseLib.learned.camera_model import ct_fingerprint
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.training import TrainingPlan, train
from PolyPoseLib.learned.view_range import ViewRange
from PolyPoseLib.registration.cameras.initial import initial_camera
from PolyPoseLib.registration.cameras.refine import find_camera
from PolyPoseLib.registration.cameras.search import SearchRange, coarse_cameras
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.select import select_backend

WORST_MM = 100.0
"""Larger errors count as this in means."""

METHODS = {
    "learned": "learned, first prediction",
    "coarse": "search, first coarse hypothesis",
    "learned_whole": "learned, complete",
    "search_whole": "search, complete",
}


def main() -> int:
    """Train unless there is a model, run what is missing, and write rows and table."""
    arguments = parse_arguments()
    arguments.output.mkdir(parents=True, exist_ok=True)
    ct, structures, _, _ = load_anatomy(arguments.anatomy)
    path = arguments.model or arguments.output / f"learned-{arguments.anatomy}-{arguments.view}.pt"
    store = arguments.output / "learned_cameras.json"
    report = json.loads(store.read_text()) if store.is_file() else {"training": {}, "rows": []}
    key = f"{arguments.anatomy} {arguments.view}"
    if not path.is_file():
        report["training"][key] = train_model(ct, structures, arguments, path)
    comparison = Comparison(ct, structures, arguments, path)
    rows = {
        row["number"]: row
        for row in report["rows"]
        if (row["anatomy"], row["view"]) == (arguments.anatomy, arguments.view)
    }
    numbers = [n for n in range(100 * arguments.views) if view_name(n) == arguments.view][: arguments.views]
    wanted = {n for n in numbers if n not in rows or set(comparison.wanted) - set(rows[n])}
    for number, view, true, image in random_views(
        ct, structures, comparison.anchor, arguments.pixels, wanted
    ):
        if number not in rows:
            rows[number] = {"anatomy": arguments.anatomy, "view": view, "number": number}
            report["rows"].append(rows[number])
        comparison.run(true, image, rows[number])
        report["machine"] = machine()
        store.write_text(json.dumps(report, indent=1) + "\n")
        print(json.dumps(rows[number]), flush=True)
    text = table(report)
    (arguments.output / "learned_cameras.md").write_text(text, encoding="utf-8")
    print(text)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--anatomy", choices=tuple(STRUCTURES), default="pelvis")
    parser.add_argument("--view", choices=tuple(STANDARD_VIEWS), default="AP")
    parser.add_argument("--views", type=int, default=36, help="test views")
    parser.add_argument("--pixels", type=int, default=400, help="rows and columns of an X-ray of 430 mm")
    parser.add_argument("--model", type=Path, help="a trained model (default: train one)")
    parser.add_argument("--minutes", type=float, default=30.0, help="of training")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--skip", nargs="*", choices=tuple(METHODS), default=[], help="methods that are not run"
    )
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the results")
    return parser.parse_args()


def train_model(
    ct: Volume, structures: Structures, arguments: argparse.Namespace, path: Path
) -> dict[str, Any]:
    """Train for the views of this benchmark; returns what it took."""
    anchor = structures.names[0]
    scene = Scene(ct, structures, anchor)
    camera = random_camera(np.random.default_rng(0), scene.anchor_centre, arguments.view, arguments.pixels)
    xray = xray_of(np.zeros((arguments.pixels, arguments.pixels), np.float32), camera, arguments.view)
    workers = arguments.threads // 2
    plan = TrainingPlan(minutes=arguments.minutes, workers=workers, threads=arguments.threads - workers)
    checkpoint = path.with_name(path.name + ".checkpoint")
    start, used = time.perf_counter(), _cpu_seconds()
    model = train(
        scene,
        ct_fingerprint(ct, structures, anchor),
        ViewRange.of_xrays([xray]),
        VirtualDetector.around([xray], plan.side),
        plan,
        Monitor(None, None),
        lambda fields: write_tensors(fields, checkpoint),
        read_tensors(checkpoint, "checkpoint") if checkpoint.is_file() else None,
    )
    save_model(model, path)
    checkpoint.unlink(missing_ok=True)
    return {
        "minutes": (time.perf_counter() - start) / 60,
        "cpu_minutes": (_cpu_seconds() - used) / 60,
        "threads": arguments.threads,
        "validation_mm": model.validation_mm,
    }


class Comparison:
    """Both methods to a first camera, and the errors of what they find."""

    def __init__(self, ct: Volume, structures: Structures, arguments: argparse.Namespace, path: Path) -> None:
        self.anchor = structures.names[0]
        backend = select_backend(threads=arguments.threads)
        scene = Scene(ct, structures, self.anchor)
        self.context = Run(SoftTissue(scene), backend, Monitor(None, None), "camera")
        self.points = mask_points(structures.mask(self.anchor), ct.affine, 2000)
        self.model = load_regressor(path, ct, structures, self.anchor)
        self.wanted = [name for name in METHODS if name not in arguments.skip]

    def run(self, true: Camera, image: np.ndarray, row: dict[str, Any]) -> None:
        """Add to a test view's row the errors and times of the methods that it lacks."""
        view = row["view"]
        xray = xray_of(image, true, view)
        observation = Observation(xray.image, xray.mask, true)
        searched = SearchRange.around_view(view, SOURCE_TO_DETECTOR_MM)
        methods: dict[str, Callable[[], Any]] = {
            "learned": lambda: self.model.predict(xray)[0],
            "coarse": lambda: coarse_cameras(self.context, observation, searched)[0],
            "learned_whole": lambda: initial_camera(self.context, xray, "learned", self.model),
            "search_whole": lambda: initial_camera(self.context, xray, "search", self.model),
        }
        for name in self.wanted:
            if name not in row:
                row[name] = self._scored(methods[name], true, observation)

    def _scored(self, method: Callable[[], Any], true: Camera, observation: Observation) -> dict[str, Any]:
        """Error before and after the usual refinement, and the time before it."""
        start, used = time.perf_counter(), _cpu_seconds()
        try:
            found = method()
        except (PolyPoseError, IndexError) as error:
            return {"failed": str(error), "error_mm": None, "refined_mm": None}
        seconds, cpu_seconds = time.perf_counter() - start, _cpu_seconds() - used
        camera = found if isinstance(found, Camera) else true.with_extrinsic(found.extrinsic)
        start_at = observation.with_camera(camera)
        levels = PRESETS["default"].camera_levels
        refined = find_camera(self.context, start_at, levels)
        row = {"seconds": seconds, "cpu_seconds": cpu_seconds}
        row |= {"error_mm": self._error(true, camera), "refined_mm": self._error(true, refined)}
        return row if isinstance(found, Camera) else {**row, "sure": found.sure, "how": found.how}

    def _error(self, true: Camera, camera: Camera) -> float:
        """Mean projection error of the anchor's points in mm, in their planes."""
        return float(np.mean(np.nan_to_num(projection_error_mm(self.points, true, camera), nan=1e3)))


def table(report: dict[str, Any]) -> str:
    """Markdown: one table per CT and view, the training, and the machine."""
    parts = ["# Learned initial cameras against the search\n"]
    parts.append(
        "Error: mean distance between the anchor's projected points under the found and the true camera, in mm in the "
        f"points' planes; in means, errors above {WORST_MM:g} mm count as that. Found: below {FOUND_MM:g} mm after the "
        "refinement that every registration starts with. Seconds are those of the method itself, median.\n"
    )
    rows = report["rows"]
    for anatomy, view in sorted({(row["anatomy"], row["view"]) for row in rows}):
        mine = [row for row in rows if (row["anatomy"], row["view"]) == (anatomy, view)]
        parts.append(f"## {anatomy}, {view}, {len(mine)} views\n")
        trained = report["training"].get(f"{anatomy} {view}")
        if trained:
            parts.append(
                f"Trained for {trained['minutes']:.0f} minutes ({trained['cpu_minutes']:.0f} CPU minutes, "
                f"{trained['threads']} threads); validation {trained['validation_mm']:.1f} mm.\n"
            )
        parts.append(
            "| method | views | median mm | mean mm | worst mm | within 10 mm | found | certain and wrong "
            "| s | CPU s |\n" + "| --- " * 10 + "|"
        )
        parts += [
            _line(title, [row[method] for row in mine if method in row]) for method, title in METHODS.items()
        ]
        parts.append("")
    if "machine" in report:
        parts += ["## Measured on\n", *(f"- {name}: {value}" for name, value in report["machine"].items())]
    return "\n".join(parts) + "\n"


def _line(title: str, scored: list[dict[str, Any]]) -> str:
    """One method's row."""
    if not scored:
        return f"| {title} " + "| - " * 9 + "|"
    worst = 1e3
    errors = np.array([worst if each["error_mm"] is None else each["error_mm"] for each in scored])
    found = np.array([each["refined_mm"] is not None and each["refined_mm"] < FOUND_MM for each in scored])
    with_verdict = [each for each in scored if "sure" in each]
    wrong = sum(each["sure"] and each["refined_mm"] >= FOUND_MM for each in with_verdict)
    times = [[each[name] for each in scored if name in each] for name in ("seconds", "cpu_seconds")]
    cells = [
        title,
        f"{len(errors)}",
        f"{np.median(errors):.1f}",
        f"{np.minimum(errors, WORST_MM).mean():.1f}",
        f"{errors.max():.1f}",
        f"{(errors < 10).sum()} of {len(errors)}",
        f"{found.sum()} of {len(found)}",
        f"{wrong} of {sum(each['sure'] for each in with_verdict)}" if with_verdict else "-",
        *(f"{np.median(each):.2f}" if each else "-" for each in times),
    ]
    return "| " + " | ".join(cells) + " |"


def _cpu_seconds() -> float:
    """Of this process and of its children that have ended."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


if __name__ == "__main__":
    raise SystemExit(main())
