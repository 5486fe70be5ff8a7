"""Rows of companions, such as ribs, of which some have slipped onto their neighbours' shadows.

Neighbouring ribs look alike, and a rib that lies on its neighbour's shadow pushes that one on to the next: no bone can
go back alone while its own shadow is taken. Where two companions have come far apart, the bones on the shorter side of
the break are therefore moved across it together, and fitted together.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.articulations import connected_groups
from PolyPoseLib.registration.fit.device_problem import as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View
from PolyPoseLib.registration.fit.refutation import is_refuted
from PolyPoseLib.registration.fit.views import LevelViews, parts_that_count
from PolyPoseLib.registration.fit.weighting import dilated, projection_mask, reliability
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene

APART_MM = 8.0
"""Companions that have moved this far against each other, in the root mean square over the points that link them, do
not both lie where they are found. Of right ribs in breathing it is 1 to 4 mm."""

LEAST_ROW = 3
"""Companions that make a row: two alone, as the forearm's bones, may cross."""

REACH_MM = 8.0
"""The X-rays count this far around every start's projection."""


@dataclass(frozen=True)
class Break:
    """Two companions that have come apart.

    Attributes
    ----------
    slipped : tuple of int
        Bones on the shorter side of the break.
    edge, across : int
        The companions, the first of them among the slipped.
    apart_mm : float
        How far they moved against each other.

    """

    slipped: tuple[int, ...]
    edge: int
    across: int
    apart_mm: float


def breaks(scene: Scene, poses: np.ndarray) -> list[Break]:
    """Where rows of companions are broken under poses (K, 4, 4), the widest first."""
    count = len(scene.names)
    apart = _apart(scene, poses)
    rows = connected_groups(apart, count)
    parts = connected_groups([pair for pair in apart if apart[pair] <= APART_MM], count)
    found = []
    for (first, second), distance in apart.items():
        row = np.flatnonzero(rows == rows[first])
        if distance <= APART_MM or len(row) < LEAST_ROW or parts[first] == parts[second]:
            continue
        sides = [(np.flatnonzero(parts == parts[a]), a, b) for a, b in ((first, second), (second, first))]
        slipped, edge, across = min(sides, key=lambda side: len(side[0]))
        found.append(Break(tuple(slipped.tolist()), edge, across, distance))
    return sorted(found, key=lambda each: -each.apart_mm)


def rejoined(
    run: Run,
    observations: Sequence[Observation],
    poses: np.ndarray,
    level: Level,
    among: Collection[int],
) -> np.ndarray:
    """Move bones back into their rows unless the X-rays refute it, with the cameras and the soft tissue held.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observations : sequence of Observation
        The X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving.
    level : Level
        The resolution, and the iterations of every start.
    among : collection of int
        Bones that may be moved.

    Returns
    -------
    (K, 4, 4) ndarray
        The poses, those of rejoined bones fitted anew.

    """
    tried: set[tuple[int, ...]] = set()
    while True:
        open_breaks = [
            each
            for each in breaks(run.scene, poses)
            if each.slipped not in tried and set(each.slipped) <= set(among)
        ]
        if not open_breaks:
            return poses
        tried.add(open_breaks[0].slipped)
        poses = _across(run, observations, poses, level, open_breaks[0])


def _across(
    run: Run, observations: Sequence[Observation], poses: np.ndarray, level: Level, place: Break
) -> np.ndarray:
    """Poses (K, 4, 4) without a break, fitted, or as they are where the X-rays refute them."""
    run.named("restarts").step(0, 1)
    slipped = list(place.slipped)
    views = LevelViews(run, observations, level)
    problem, state = views.posed_structures(poses, slipped)
    together, alike = poses.copy(), poses.copy()
    alike[slipped] = poses[place.across]
    together[slipped] = poses[slipped] @ rigid_inverse(poses[place.edge]) @ poses[place.across]
    starts = [State(each, state.corrections) for each in (poses, together, alike)]
    parts = [around(problem, n, starts, slipped) for n in range(len(problem.views))]
    problem = replace(problem, views=parts_that_count(parts))
    if not problem.views:
        return poses
    starts = [State.of_poses(start.poses, len(problem.views)) for start in starts]
    solved = as_solved(problem)
    here, *others = (minimise(solved, start, SolverOptions(level.iterations)) for start in starts)
    whole = [
        end
        for end in others
        if all(each.slipped != place.slipped for each in breaks(run.scene, end.state.poses))
    ]
    best = min(whole, key=lambda end: end.cost, default=None)
    if best is None or is_refuted(problem, here.state, best.state):
        return poses
    return best.state.poses


def around(problem: RigidProblem, n: int, starts: Sequence[State], which: Sequence[int]) -> View:
    """A view weighted where bones project at any of the starts."""
    view = problem.views[n]
    shows = np.any([projection_mask(problem, state, n, which) for state in starts], axis=0)
    region = dilated(shows, REACH_MM / pixel_size_mm(view.camera, problem.camera_centre))
    weight = np.where(region & (view.contrast.support > 0), reliability(view), 0).astype(np.float32)
    return replace(view, weight=weight)


def _apart(scene: Scene, poses: np.ndarray) -> dict[tuple[int, int], float]:
    """How far (mm) companions moved against each other, by their indices."""
    motions = np.array([rigid_inverse(pose) for pose in poses])
    squares: dict[tuple[int, int], list[float]] = {}
    for link in scene.companions:
        first, second = (
            motions[k, :3, :3] @ link.point + motions[k, :3, 3] for k in (link.first, link.second)
        )
        squares.setdefault((link.first, link.second), []).append(float(((first - second) ** 2).sum()))
    return {pair: float(np.sqrt(np.mean(each))) for pair, each in squares.items()}
