"""How often a camera is found from nothing: random views around standard views of public CTs.

Every view is rotated by up to 45 degrees from a named standard view about a random axis, the anchor's centre lies up to
100 mm from the middle of the beam, and the distance varies by 20 %. The other bones are moved about their joints, soft
tissue follows Laplace's equation, ITK-RTK renders, and a detector model adds noise, scatter, saturation and rounding.
A camera counts as found when, after the usual refinement, it projects the anchor within 2 mm on average, measured in
the planes of the anchor's points.

    python Testing/Benchmarks/cameras.py --anatomy pelvis chest --views 200

Views that are in the results file already are not run again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from benchmark_cases import STRUCTURES, load_anatomy
from benchmark_tables import machine
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import PolyPoseError
from PolyPoseLib.evaluation.metrics import mask_points, projection_error_mm
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS, standard_view_rotation
from PolyPoseLib.registration.cameras.initial import initial_camera
from PolyPoseLib.registration.cameras.refine import find_camera
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.simulation import independent_projector
from PolyPoseLib.simulation.motion import draw_motions
from PolyPoseLib.simulation.posed_ct import pose_ct
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

RESULTS = Path(__file__).parent / "results"
FOUND_MM = 2.0
SOURCE_TO_DETECTOR_MM = 1020.0
SOURCE_TO_ANCHOR_MM = 750.0
DETECTOR_MM = 430.0
VIEWS_PER_POSTURE = 5


def main() -> int:
    """Run what is missing and write the results after every view."""
    arguments = parse_arguments()
    arguments.output.mkdir(parents=True, exist_ok=True)
    store = arguments.output / f"{arguments.name}.json"
    rows = json.loads(store.read_text())["rows"] if store.is_file() else []
    for anatomy in arguments.anatomy:
        done = {row["view"] for row in rows if row["anatomy"] == anatomy and row["named"] == arguments.named}
        if done >= set(range(arguments.views)):
            continue
        rows += _run_anatomy(anatomy, arguments, done, store, rows)
    print(summary(rows))
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--anatomy", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument("--views", type=int, default=200, help="of every CT")
    parser.add_argument("--pixels", type=int, default=400, help="rows and columns of an X-ray of 430 mm")
    parser.add_argument(
        "--unnamed", dest="named", action="store_false", help="do not state the standard view"
    )
    parser.add_argument("--threads", type=int, help="of the search (default: all)")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the results")
    parser.add_argument("--name", default="cameras", help="of the results file")
    return parser.parse_args()


def random_camera(rng: np.random.Generator, centre: np.ndarray, view: str, pixels: int) -> Camera:
    """A camera around a standard view of a point ``centre`` (3,) LPS mm."""
    axis, direction = rng.normal(size=(2, 3))
    turn = Rotation.from_rotvec(np.radians(rng.uniform(0, 45)) * axis / np.linalg.norm(axis))
    offset = 100 * np.cbrt(rng.uniform()) * direction / np.linalg.norm(direction)
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = turn.as_matrix() @ standard_view_rotation(view)
    distance = SOURCE_TO_ANCHOR_MM * rng.uniform(0.8, 1.2)
    extrinsic[:3, 3] = (0, 0, distance) - extrinsic[:3, :3] @ (centre + offset)
    intrinsics = intrinsics_matrix(SOURCE_TO_DETECTOR_MM, DETECTOR_MM / pixels, pixels, pixels)
    return Camera(intrinsics, extrinsic, pixels, pixels)


def view_name(number: int, rng: np.random.Generator | None = None) -> str:
    """Standard view around which view ``number`` lies; ``rng`` goes on to draw its camera."""
    rng = rng or np.random.default_rng([number, 7])
    return list(STANDARD_VIEWS)[int(rng.integers(len(STANDARD_VIEWS)))]


def random_views(
    ct: Volume, structures: Structures, anchor: str, pixels: int, wanted: set[int]
) -> Iterator[tuple[int, str, Camera, np.ndarray]]:
    """(number, standard view, true camera, measured image (H, W)) of every wanted view, the same in every run."""
    centre = structures.centroids(ct.affine)[structures.index(anchor)]
    for posture in range(1 + max(wanted, default=-1) // VIEWS_PER_POSTURE):
        numbers = range(posture * VIEWS_PER_POSTURE, (posture + 1) * VIEWS_PER_POSTURE)
        if not wanted & set(numbers):
            continue
        rng = np.random.default_rng([posture, 5])
        joints = draw_motions(structures, ct.affine, anchor, rng, 1.0, 1.0)
        poses = {name: np.linalg.inv(joint.moving_to_fixed) for name, joint in joints.items()}
        posed = pose_ct(ct, structures, poses, None, 6.0, 20.0)
        attenuation = Volume(hounsfield_to_attenuation(posed.hu), posed.grid.affine)
        for number in numbers:
            rng = np.random.default_rng([number, 7])
            if number not in wanted:
                continue
            view = view_name(number, rng)
            camera = random_camera(rng, centre, view, pixels)
            while camera.depth(attenuation.corners()).min() <= 0:
                camera = random_camera(rng, centre, view, pixels)
            clean = independent_projector.project(attenuation, camera)
            yield number, view, camera, measure(clean, XrayPhysics(), rng)


def xray_of(image: np.ndarray, true: Camera, view: str | None) -> Xray:
    """What the search gets of a view: everything but its camera's pose."""
    return Xray(
        image=image,
        mask=np.ones(image.shape, bool),
        intrinsics=true.intrinsics,
        extrinsic=None,
        camera="absent",
        pixel_spacing_mm=(
            SOURCE_TO_DETECTOR_MM / true.intrinsics[1, 1],
            SOURCE_TO_DETECTOR_MM / true.intrinsics[0, 0],
        ),
        source_to_detector_mm=SOURCE_TO_DETECTOR_MM,
        name=view or "view",
        standard_view=view,
    )


def find(
    scene: Scene, image: np.ndarray, true: Camera, view: str | None, points: np.ndarray, backend: Backend
) -> dict:
    """Find and refine one camera; errors in mm at the anchor's points."""
    xray = xray_of(image, true, view)
    run = Run(SoftTissue(scene), backend, Monitor(None, None), "camera")
    start, used = time.perf_counter(), time.process_time()
    try:
        found = initial_camera(run, xray)
    except PolyPoseError as error:
        return {"sure": False, "error_mm": None, "seconds": time.perf_counter() - start, "how": str(error)}
    first = found.camera_of(xray)
    observation = Observation(xray.image, xray.mask, first)
    camera = find_camera(run, observation, PRESETS["default"].camera_levels)
    errors = [projection_error_mm(points, true, each) for each in (first, camera)]
    before, after = (float(np.mean(np.nan_to_num(error, nan=1e3))) for error in errors)
    return {
        "sure": found.sure,
        "error_mm": after,
        "initial_mm": before,
        "seconds": time.perf_counter() - start,
        "cpu_seconds": time.process_time() - used,
        "similarity": found.similarity,
        "runner_up": found.runner_up,
        "how": found.how,
    }


def summary(rows: list[dict]) -> str:
    """Success, time and honesty of every CT."""
    lines = []
    for anatomy, named in sorted({(row["anatomy"], row["named"]) for row in rows}):
        mine = [row for row in rows if (row["anatomy"], row["named"]) == (anatomy, named)]
        found = [row["error_mm"] is not None and row["error_mm"] <= FOUND_MM for row in mine]
        sure = [row["sure"] for row in mine]
        right = sum(s and f for s, f in zip(sure, found, strict=True))
        wrong = sum(sure) - right
        lines.append(
            f"{anatomy}, view {'named' if named else 'not named'}: {sum(found)} of {len(mine)} found "
            f"({100 * np.mean(found):.1f} %), sure of {right} of them, "
            f"{len(found) - sum(found) - wrong} failures recognised, {wrong} failures taken for sure, median "
            f"{np.median([row['seconds'] for row in mine]):.0f} s (CPU "
            f"{np.median([row.get('cpu_seconds', 0.0) for row in mine]):.0f} s)"
        )
    return "\n".join(lines)


def _run_anatomy(
    anatomy: str, arguments: argparse.Namespace, done: set[int], store: Path, before: list[dict]
) -> list[dict]:
    """Rows of the views that are missing."""
    ct, structures, _, _ = load_anatomy(anatomy)
    anchor = structures.names[0]
    scene = Scene(ct, structures, anchor)
    points = mask_points(structures.mask(anchor), ct.affine, 2000)
    backend = select_backend(threads=arguments.threads)
    rows: list[dict] = []
    wanted = set(range(arguments.views)) - done
    for number, view, true, image in random_views(ct, structures, anchor, arguments.pixels, wanted):
        found = find(scene, image, true, view if arguments.named else None, points, backend)
        row = {"anatomy": anatomy, "view": number, "standard_view": view, "named": arguments.named, **found}
        rows.append(row)
        store.write_text(json.dumps({"machine": machine(), "rows": before + rows}, indent=1) + "\n")
        print(json.dumps(row), flush=True)
    return rows


if __name__ == "__main__":
    raise SystemExit(main())
