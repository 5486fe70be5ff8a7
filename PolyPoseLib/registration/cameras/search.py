"""A camera from nothing but the direction of view: exhaustive at first, then refined, with several hypotheses kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS, standard_view_rotation
from PolyPoseLib.geometry.view_grid import view_grid
from PolyPoseLib.registration.cameras.coarse_search import Candidates, CoarseSearch, compared_points
from PolyPoseLib.registration.cameras.hypotheses import (
    Hypothesis,
    distinct,
    merged,
    reasons_for_uncertainty,
    score_camera,
)
from PolyPoseLib.registration.cameras.refine import find_camera
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.run import Run

DEPTH_SHARES = (0.48, 1.0)
"""Distances that are tried, as shares of that from the source to the detector."""

VIEW_RADIUS_DEG = 52.0
"""Around a standard view: 45 degrees, and what an anchor off the axis adds."""

OFF_AXIS_DEG = 7.0
"""What an anchor away from the middle of the X-ray adds to the directions from which it is seen."""


@dataclass(frozen=True)
class Stage:
    """One step of the refinement.

    Attributes
    ----------
    level : Level
        The resolution.
    keep : int
        Hypotheses that continue.
    apart_mm : float
        How far apart they must be.
    copies : int
        Perturbed copies of each of the best two that are tried beside them.

    """

    level: Level
    keep: int
    apart_mm: float
    copies: int = 0


SAME_MM = 2.0
"""Hypotheses that are this close vote for the same camera."""

COPY_ROTATION_DEG = 8.0
COPY_SHIFT_MM = np.array([6.0, 6.0, 30.0])
"""Size of the perturbations: the distance along the axis is known worst."""


@dataclass(frozen=True)
class Density:
    """How densely cameras are tried at first.

    Attributes
    ----------
    direction_deg, roll_deg : float
        Between neighbouring directions and rolls.
    depth_ratio : float
        Of neighbouring distances.
    kept : int
        How many of the best are refined.

    """

    direction_deg: float
    roll_deg: float
    depth_ratio: float
    kept: int


USUAL = Density(8.0, 9.0, 1.12, 100)
DENSE = Density(6.0, 7.0, 1.09, 250)
"""For a second round when the first led to no certain camera."""

CONSIDERED = 30
"""Candidates per refined one among which different ones are chosen."""

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

    Attributes
    ----------
    centres : np.ndarray
        (C, 3, 3) rotations, world to camera.
    radius_deg : float
        How far from the nearest of them.
    depths_mm : tuple[float, float]
        (least, largest) distance from the source to the anchor's centre.

    """

    centres: np.ndarray
    radius_deg: float
    depths_mm: tuple[float, float]

    @classmethod
    def around_view(cls, view: str | None, source_to_detector_mm: float) -> SearchRange:
        """Around a standard view, or around all of them; raises InputError for an unknown name."""
        names = list(STANDARD_VIEWS) if view is None else [view]
        centres = np.stack([standard_view_rotation(name) for name in names])
        least, largest = (share * source_to_detector_mm for share in DEPTH_SHARES)
        return cls(centres, VIEW_RADIUS_DEG, (least, largest))

    @classmethod
    def around_camera(
        cls,
        camera: Camera,
        anchor_centre: np.ndarray,
        radius: tuple[float, float],
        source_to_detector_mm: float,
    ) -> SearchRange:
        """Around an initial camera.

        Parameters
        ----------
        camera : Camera
            The initial one.
        anchor_centre : (3,) ndarray
            LPS mm.
        radius : (float, float)
            Degrees and mm within which the true camera is expected.
        source_to_detector_mm : float
            Bounds the distance.

        """
        least, largest = (share * source_to_detector_mm for share in DEPTH_SHARES)
        depth = float(np.clip(camera.depth(anchor_centre), least, largest))
        depths = max(depth - radius[1], 0.3 * depth), depth + radius[1]
        return cls(camera.extrinsic[None, :3, :3], radius[0] + OFF_AXIS_DEG, depths)


def find_cameras(
    run: Run,
    observation: Observation,
    searched: SearchRange,
    densities: Sequence[Density] = (USUAL, DENSE),
    stages: Sequence[Stage] = STAGES,
) -> list[Hypothesis]:
    """Cameras that agree with an X-ray, best first, clearly different from each other.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observation : Observation
        The X-ray; of its camera only the intrinsics and the size count.
    searched : SearchRange
        Directions and distances.
    densities : sequence of Density
        Of the cameras tried at first; the next one only when the one before led to no certain camera.
    stages : sequence of Stage
        Of the refinement.

    Returns
    -------
    list of Hypothesis
        At least one, unless the anchor shows in none of the views that were tried.

    """
    search = _Search(run, observation)
    found: list[Hypothesis] = []
    for number, density in enumerate(densities):
        search.progress.start_round(number, len(densities))
        cameras = search.coarse(searched, density)
        refined = search.refined(cameras, stages)
        found = merged([*found, *refined], search.points, stages[-1].apart_mm, stages[-1].keep, SAME_MM)
        if found and not reasons_for_uncertainty(found):
            break
    return found


def coarse_cameras(
    run: Run, observation: Observation, searched: SearchRange, density: Density = USUAL
) -> list[Camera]:
    """Only the exhaustive part of :func:`find_cameras`, with the same parameters and one density.

    Returns
    -------
    list of Camera
        Best first; none is refined.

    """
    return _Search(run, observation).coarse(searched, density)


def refine_cameras(
    run: Run, observation: Observation, cameras: Sequence[Camera], stages: Sequence[Stage] = STAGES
) -> list[Hypothesis]:
    """Only the refinement of :func:`find_cameras`, from cameras that something else proposes.

    Parameters
    ----------
    run, observation, stages
        As :func:`find_cameras` takes them.
    cameras : sequence of Camera
        At least one.

    Returns
    -------
    list of Hypothesis
        Best first.

    """
    return _Search(run, observation).refined(cameras, stages)


def perturbed(camera: Camera, centre: np.ndarray, rng: np.random.Generator) -> Camera:
    """The camera turned and shifted at random, with ``centre`` (3,) LPS mm as the pivot."""
    axis = rng.normal(size=3)
    angle = np.radians(COPY_ROTATION_DEG) * np.cbrt(rng.uniform())
    extrinsic = camera.extrinsic.copy()
    middle = extrinsic[:3, :3] @ centre + extrinsic[:3, 3]
    extrinsic[:3, :3] = (
        Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix() @ extrinsic[:3, :3]
    )
    extrinsic[:3, 3] = middle + rng.uniform(-1, 1, 3) * COPY_SHIFT_MM - extrinsic[:3, :3] @ centre
    return camera.with_extrinsic(extrinsic)


class _Search:
    """Both parts of the search for one X-ray's camera."""

    def __init__(self, run: Run, observation: Observation) -> None:
        self.observation = observation
        self.points = compared_points(run.scene)
        self.progress = _SearchProgress(run)
        self.run = replace(run, monitor=self.progress)

    def coarse(self, searched: SearchRange, density: Density) -> list[Camera]:
        """The best cameras of the exhaustive search, each different from the others."""
        grid = view_grid(
            searched.centres,
            np.radians(searched.radius_deg),
            np.radians(density.direction_deg),
            np.radians(density.roll_deg),
        )
        least, largest = searched.depths_mm
        count = 1 + max(1, int(np.ceil(np.log(largest / least) / np.log(density.depth_ratio))))
        depths = np.geomspace(least, largest, count)
        search = CoarseSearch(self.run, self.observation, grid, depths)
        found: list[Candidates] = []
        for z, depth in enumerate(depths):
            matcher = search.matcher(depth)
            for d in range(len(grid.rotations)):
                self.progress.advance_to(0.5 * (z + d / len(grid.rotations)) / len(depths))
                found.append(search.run(depth, d, matcher))
        scores = np.concatenate([each.scores for each in found])
        owner = np.repeat(np.arange(len(found)), [len(each.scores) for each in found])
        number = np.concatenate([np.arange(len(each.scores)) for each in found])
        best = np.argsort(-scores, kind="stable")[: CONSIDERED * density.kept]
        best = best[scores[best] > 0]
        camera = self.observation.camera
        cameras = [camera.with_extrinsic(search.extrinsic(found[owner[n]], int(number[n]))) for n in best]
        kept = distinct(cameras, scores[best], self.points[::10], FIRST_APART_MM, density.kept)
        return [cameras[n] for n in kept]

    def refined(self, cameras: Sequence[Camera], stages: Sequence[Stage]) -> list[Hypothesis]:
        """Cameras refined level by level, fewer at each, perturbed copies of the best among them."""
        centre = self.run.scene.anchor_centre
        rng = np.random.default_rng(0)
        found = [Hypothesis(camera, 0.0, 1.0) for camera in cameras]
        for number, stage in enumerate(stages):
            if stage.copies:
                found = [replace(hypothesis, votes=1) for hypothesis in found]
                best = [hypothesis.camera for hypothesis in found[:2] for _ in range(stage.copies)]
                found += [Hypothesis(perturbed(camera, centre, rng), 0.0, 1.0) for camera in best]
            scored = []
            for n, start in enumerate(found):
                self.progress.share = 0.5 + 0.5 * (number + n / len(found)) / len(stages)
                scored.append(self._refined_at(stage.level, start))
            found = merged(scored, self.points, stage.apart_mm, stage.keep, SAME_MM)
        return found

    def _refined_at(self, level: Level, start: Hypothesis) -> Hypothesis:
        """A hypothesis refined and scored at one level."""
        camera = find_camera(self.run, self.observation.with_camera(start.camera), [level])
        scored = score_camera(self.run, self.observation.with_camera(camera), level, self.points)
        return replace(scored, votes=start.votes)


class _SearchProgress(Monitor):
    """The monitor of the refinements inside a search: each of their steps reports how far the whole search is."""

    PARTS = 200

    def __init__(self, run: Run) -> None:
        super().__init__(None, None)
        self._run, self.share = run, 0.0
        self._base, self._scale = 0.0, 1.0

    def start_round(self, number: int, of: int) -> None:
        """Rounds share the progress evenly; the last ones are often not needed."""
        self._base, self._scale, self.share = number / of, 1 / of, 0.0

    def advance_to(self, share: float) -> None:
        """Report a share (0 to 1) of this round."""
        self.share = share
        self._report()

    def step(
        self,
        stage: str,
        iteration: int,
        of: int,
        similarity: float | None,
        preview: Callable[[], str | None] | None = None,
        level_mm: float | None = None,
    ) -> None:
        """What a refinement calls before each of its iterations."""
        self._report()

    def _report(self) -> None:
        done = self._base + self._scale * self.share
        self._run.step(int(done * self.PARTS), self.PARTS)
