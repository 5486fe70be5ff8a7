"""Neighbouring bones that the X-rays contradict, such as those of a shoulder, moved together.

When a shoulder blade and the arm bone at it both lie in a wrong place, so does the soft tissue that follows them, and
neither finds back alone: its own true place is under the other's shadow and the skin's. Such bones are therefore laid
to where the CT has them beside a neighbour that is not contradicted, turned about their joint with it, and fitted
together in front of the soft tissue that follows them there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.registration.bones.restarts import chain_from_anchor, turned_about
from PolyPoseLib.registration.bones.rows import around
from PolyPoseLib.registration.fit.device_problem import as_solved
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.views import LevelViews, parts_that_count
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene

TURN_DEG = 25.0
"""Rotation of the starts about the joint."""

SHORT = 4
"""Iterations that every start gets; the best few continue with the level's own."""

KEPT = 2
"""Starts that continue."""

GAIN = 0.02
"""Share of the cost that a new place saves at least. Of a drawn arm, fits that end in one place differ by 0.003, and a
wrong place costs twice as much as the right one."""

ROUNDS = 2
"""Times that a start that continues is fitted, each time in front of the soft tissue that follows it."""


def restart_limbs(
    run: Run,
    observations: Sequence[Observation],
    poses: np.ndarray,
    level: Level,
    contradicted: Collection[int],
) -> np.ndarray:
    """Fit groups of contradicted bones together from several starts, with the cameras held.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    observations : sequence of Observation
        The X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving.
    level : Level
        The resolution, and the iterations of the best starts.
    contradicted : collection of int
        Indices of the bones that may be moved.

    Returns
    -------
    (K, 4, 4) ndarray
        The poses; those of a group are new where that lowers the cost by GAIN.

    """
    run = run.named("restarts")
    found: set[int] = set()
    groups = limbs(run.scene, contradicted)
    for group in groups:
        if found.isdisjoint(group):
            before = poses
            poses = _LimbFit(run, observations, poses, level, group).best()
            found |= set(group) if poses is not before else set()
    return poses


def limbs(scene: Scene, bones: Collection[int]) -> list[list[int]]:
    """Every one of the bones with those behind it, seen from the anchor, without a gap; at least two, small first."""
    carriers = dict(chain_from_anchor(scene))
    found: dict[tuple[int, ...], None] = {}
    for root in bones:
        limb = {root}
        for bone, carrier in carriers.items():  # carriers come before what they carry
            if bone in bones and carrier in limb:
                limb.add(bone)
        if len(limb) > 1:
            found[tuple(sorted(limb))] = None
    return sorted((list(limb) for limb in found), key=len)


def limb_starts(scene: Scene, poses: np.ndarray, group: Sequence[int]) -> Iterator[np.ndarray]:
    """Motions (4, 4) of the group: its neighbours', also turned in all directions about their joints with it."""
    for joint in scene.articulations:
        inside = (joint.first in group, joint.second in group)
        if all(inside) or not any(inside):
            continue
        neighbour = joint.second if inside[0] else joint.first
        yield poses[neighbour]
        yield from turned_about(poses[neighbour], joint, [TURN_DEG])


@dataclass(frozen=True)
class _End:
    poses: np.ndarray
    cost: float


class _LimbFit:
    """The group's cost over one region of the X-rays, in front of the soft tissue that follows the bones."""

    def __init__(
        self,
        run: Run,
        observations: Sequence[Observation],
        poses: np.ndarray,
        level: Level,
        group: Sequence[int],
    ) -> None:
        self.run, self.views, self.level = run, LevelViews(run, observations, level), level
        self.problem = self.views.structures(group)
        self.starts = [poses]
        for motion in limb_starts(run.scene, poses, group):
            moved = poses.copy()
            moved[list(group)] = motion
            self.starts.append(moved)
        numbers = range(len(observations))
        states = [State.of_poses(each, len(numbers)) for each in self.starts]
        self.weights = [around(self.problem, n, states, group).weight for n in numbers]

    def best(self) -> np.ndarray:
        """The poses (K, 4, 4) of the best end, or those of the first start where that gains little."""
        if not any((weight > 0).any() for weight in self.weights):
            return self.starts[0]
        total = len(self.starts) + (1 + KEPT) * ROUNDS
        ends = []
        for n, start in enumerate(self.starts):
            self.run.step(n, total)
            ends.append(self._fitted(start, SHORT))
        chosen = [ends[0], *sorted(ends[1:], key=lambda end: end.cost)[:KEPT]]
        for n in range(ROUNDS):
            self.run.step(len(ends) + n * len(chosen), total)
            chosen = [self._fitted(end.poses, self.level.iterations) for end in chosen]
        here, *others = chosen
        best = min(others, key=lambda end: end.cost)
        return best.poses if best.cost < (1 - GAIN) * here.cost else self.starts[0]

    def _fitted(self, poses: np.ndarray, iterations: int) -> _End:
        """Fit from poses in front of their soft tissue; the cost is that in front of the end's own."""
        problem = self._in_front_of_own_tissue(poses)
        state = State.of_poses(poses, len(problem.views))
        end = minimise(as_solved(problem), state, SolverOptions(iterations)).state
        return _End(end.poses, self._in_front_of_own_tissue(end.poses).cost(end))

    def _in_front_of_own_tissue(self, poses: np.ndarray) -> RigidProblem:
        self.views.render_soft_tissue(State.of_poses(poses, len(self.views.views)))
        views = zip(self.problem.views, self.weights, strict=True)
        weighted = [replace(view, weight=weight) for view, weight in views]
        return replace(self.problem, views=parts_that_count(weighted))
