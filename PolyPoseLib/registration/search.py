"""A camera from nothing but the direction of view: exhaustive at first, then refined, with several hypotheses kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS, standard_view_rotation
from PolyPoseLib.geometry.view_grid import view_grid
from PolyPoseLib.registration.cameras import find_camera
from PolyPoseLib.registration.coarse_search import SIZE_MM, CoarseSearch, anchor_points
from PolyPoseLib.registration.hypotheses import Hypothesis, distinct, judge_camera
from PolyPoseLib.registration.levels import Level, Measured
from PolyPoseLib.registration.monitor import Monitor
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

DIRECTION_SPACING_DEG = 8.0
ROLL_SPACING_DEG = 9.0
DEPTH_RATIO = 1.12
"""Of neighbouring distances that are tried."""

DEPTH_SHARES = (0.48, 1.0)
"""Distances that are tried, as shares of that from the source to the detector."""

VIEW_RADIUS_DEG = 52.0
"""Around a standard view: 45 degrees, and what an anchor off the axis adds."""

OFF_AXIS_DEG = 7.0
"""What an anchor away from the middle of the X-ray adds to the directions from which it is seen."""


@dataclass(frozen=True)
class Stage:
    """One step of the refinement: its level, how many hypotheses it keeps, and how far apart (mm) they must be."""

    level: Level
    keep: int
    apart_mm: float


FIRST_KEPT = 100
FIRST_APART_MM = 8.0
STAGES = (
    Stage(Level(8.0, 60.0, 10), 16, 4.0),
    Stage(Level(5.0, 40.0, 10), 6, 3.0),
    Stage(Level(3.0, 25.0, 12), 4, 5.0),
    Stage(Level(2.5, 20.0, 12), 3, 8.0),
)
"""From the first correlations to cameras that a registration can start from."""


@dataclass(frozen=True)
class SearchRange:
    """Where to search.

    centres: (C, 3, 3) rotations, world to camera; radius_deg: how far from the nearest of them; depths_mm: (least,
    largest) distance from the source to the anchor's centre.
    """

    centres: np.ndarray
    radius_deg: float
    depths_mm: tuple[float, float]

    @classmethod
    def around_view(cls, view: str | None, source_to_detector_mm: float) -> SearchRange:
        """Around a standard view, or around all of them; raises InputError for an unknown name."""
        names = list(STANDARD_VIEWS) if view is None else [view]
        centres = np.stack([standard_view_rotation(name) for name in names])
        return cls(centres, VIEW_RADIUS_DEG, tuple(share * source_to_detector_mm for share in DEPTH_SHARES))

    @classmethod
    def around_camera(
        cls,
        camera: Camera,
        anchor_centre: np.ndarray,
        radius: tuple[float, float],
        source_to_detector_mm: float,
    ) -> SearchRange:
        """Around a guess, within its radius (degrees, mm)."""
        least, largest = (share * source_to_detector_mm for share in DEPTH_SHARES)
        depth = float(np.clip(camera.depth(anchor_centre), least, largest))
        depths = max(depth - radius[1], 0.3 * depth), depth + radius[1]
        return cls(camera.extrinsic[None, :3, :3], radius[0] + OFF_AXIS_DEG, depths)


def find_cameras(
    scene: Scene,
    measured: Measured,
    searched: SearchRange,
    backend: Backend,
    monitor: Monitor,
    stage: str,
    stages: Sequence[Stage] = STAGES,
) -> list[Hypothesis]:
    """Cameras that explain an X-ray, best first, clearly different from each other.

    Args:
        scene: the CT with its anchor.
        measured: the X-ray; of its camera only the intrinsics and the size count.
        searched: directions and distances.
        backend: renders.
        monitor: is told about the progress, and may stop the search with CancelledError.
        stage: name in the progress.
        stages: of the refinement.

    Returns:
        At least one hypothesis, unless the anchor shows in none of the views that were tried.

    """
    quiet = _Quiet(monitor, stage)
    points = anchor_points(scene.bodies(SIZE_MM)[scene.anchor], 300)
    cameras = _coarse(scene, measured, searched, points, backend, quiet)
    found: list[Hypothesis] = []
    for number, step in enumerate(stages):
        found = []
        for n, camera in enumerate(cameras):
            quiet.share = 0.5 + 0.5 * (number + n / len(cameras)) / len(stages)
            placed = Measured(measured.image, measured.mask, camera)
            refined = find_camera(scene, placed, [step.level], backend, quiet, stage)
            judged = Measured(measured.image, measured.mask, refined)
            found.append(judge_camera(scene, judged, step.level, points, backend))
        worth = np.array([hypothesis.worth for hypothesis in found])
        kept = distinct([hypothesis.camera for hypothesis in found], worth, points, step.apart_mm, step.keep)
        found = [found[n] for n in kept]
        cameras = [hypothesis.camera for hypothesis in found]
    return found


def _coarse(
    scene: Scene,
    measured: Measured,
    searched: SearchRange,
    points: np.ndarray,
    backend: Backend,
    quiet: _Quiet,
) -> list[Camera]:
    """The best cameras of the exhaustive search, each different from the others."""
    grid = view_grid(
        searched.centres,
        np.radians(searched.radius_deg),
        np.radians(DIRECTION_SPACING_DEG),
        np.radians(ROLL_SPACING_DEG),
    )
    least, largest = searched.depths_mm
    depths = np.geomspace(
        least, largest, 1 + max(1, int(np.ceil(np.log(largest / least) / np.log(DEPTH_RATIO))))
    )
    search = CoarseSearch(scene, measured, grid, depths, backend)
    extrinsics, worth = [], []
    for z, depth in enumerate(depths):
        matcher, half = search.matcher(depth)
        for d in range(len(grid.rotations)):
            quiet.step_to(0.5 * (z + d / len(grid.rotations)) / len(depths))
            found = search.run(depth, d, matcher, half)
            extrinsics.append(found.extrinsics)
            worth.append(found.worth)
    extrinsics, worth = np.concatenate(extrinsics), np.concatenate(worth)
    best = np.argsort(-worth, kind="stable")[: 30 * FIRST_KEPT]
    best = best[worth[best] > 0]
    cameras = [measured.camera.with_extrinsic(extrinsics[n]) for n in best]
    return [cameras[n] for n in distinct(cameras, worth[best], points[::10], FIRST_APART_MM, FIRST_KEPT)]


class _Quiet:
    """Stands in for the monitor within the refinement: passes on how far the whole search is, and nothing else."""

    PARTS = 100

    def __init__(self, monitor: Monitor, stage: str) -> None:
        self.monitor, self.stage, self.share = monitor, stage, 0.0

    def step(self, *_: object, **__: object) -> None:
        self.monitor.step(self.stage, int(self.share * self.PARTS), self.PARTS, None)

    def step_to(self, share: float) -> None:
        self.share = share
        self.step()
