"""From how far off an initial camera is still refined to the true one.

    python Testing/Benchmarks/camera_capture.py CASE --starts 6

CASE: a folder that ``python -m PolyPoseLib simulate`` wrote. Each start is the true camera, turned about the anchor and
shifted at random until the anchor's projection is a given distance off. It is refined as a camera model's answers are,
with perturbed copies. One line per distance: how many were found (below 2 mm), and how many of the others were not
flagged as uncertain. ``PolyPoseLib.learned.camera_model.USABLE_MM`` rests on this.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from cameras import FOUND_MM
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.evaluation.metrics import projection_error_mm
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.registration.cameras.coarse_search import compared_points
from PolyPoseLib.registration.cameras.initial import learned_camera
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.select import select_backend

DISTANCES_MM = (10, 15, 20, 25, 30, 40)
TURN_DEG = 12.0
SHIFT_MM = 15.0
"""One step along a random direction away from the true camera; its length is then found by bisection."""


class Proposal:
    """Stands for a camera model: proposes one camera."""

    how = "proposed"
    warnings = ()

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def covers(self, xray: Xray) -> bool:
        """For every X-ray."""
        return True

    def starts(self, xray: Xray) -> list[Camera]:
        """The one camera."""
        return [self.camera]


def main() -> None:
    """Run all distances."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("case", type=Path)
    parser.add_argument("--starts", type=int, default=6, help="per distance (default: 6)")
    parser.add_argument("--seed", type=int, default=5)
    arguments = parser.parse_args()
    study = Study.load(arguments.case / "study.json")
    cameras = load_truth(arguments.case / "truth").cameras
    scene = Scene(study.ct, study.structures, study.anchor)
    points = np.asarray(compared_points(scene))
    run = Run(SoftTissue(scene), select_backend(), Monitor(None, None), "camera")
    rng = np.random.default_rng(arguments.seed)
    for distance in DISTANCES_MM:
        found = unnoticed = 0
        for n in range(arguments.starts):
            true, xray = cameras[n % len(cameras)], study.xrays[n % len(cameras)]
            start = camera_at(true, scene.anchor_centre, points, distance, rng)
            answer = learned_camera(run, xray, Proposal(start))
            error = projection_error_mm(points, true, true.with_extrinsic(answer.extrinsic)).mean()
            found += error < FOUND_MM
            unnoticed += error >= FOUND_MM and answer.sure
        print(
            f"{distance} mm off: found {found} of {arguments.starts}; wrong and not flagged {unnoticed}",
            flush=True,
        )


def camera_at(
    true: Camera, centre: np.ndarray, points: np.ndarray, distance_mm: float, rng: np.random.Generator
) -> Camera:
    """A camera whose projections of points are ``distance_mm`` off on average, in a random direction."""
    axis, shift = rng.normal(size=3), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    middle = true.extrinsic[:3, :3] @ centre + true.extrinsic[:3, 3]

    def moved(length: float) -> Camera:
        extrinsic = true.extrinsic.copy()
        turn = Rotation.from_rotvec(axis * length * np.radians(TURN_DEG)).as_matrix()
        extrinsic[:3, :3] = turn @ extrinsic[:3, :3]
        extrinsic[:3, 3] = middle + length * SHIFT_MM * shift - extrinsic[:3, :3] @ centre
        return true.with_extrinsic(extrinsic)

    low, high = 0.0, 10.0
    for _ in range(40):
        length = (low + high) / 2
        if projection_error_mm(points, true, moved(length)).mean() < distance_mm:
            low = length
        else:
            high = length
    return moved(low)


if __name__ == "__main__":
    main()
