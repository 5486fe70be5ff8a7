"""Every bone fitted again from other starting poses, one bone at a time.

Least squares find the nearest local minimum only. After the coarsest level each bone, from the anchor outwards, is
restarted: turned about its joints to either side of three axes, shifted, moved along with its neighbour, and at rest.
The start that ends at the lowest cost over one fixed region of the X-rays is kept. A bone that was fitted finely, and
is looked for elsewhere only because the X-rays match it badly, goes to a better place where they refute its own: after
processing or with distortion they match right bones badly, too, and among many starts some place is always a little
better. Where they do not tell the two apart, the joints do: the bone is where these moved less.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import Articulation, OneBonePrior
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions
from PolyPoseLib.registration.fit.lockstep import minimise_together
from PolyPoseLib.registration.fit.many_poses import at_many_poses
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View
from PolyPoseLib.registration.fit.refutation import is_refuted
from PolyPoseLib.registration.fit.views import LevelViews, problem_of_one_bone
from PolyPoseLib.registration.fit.weighting import dilated, mark_shown, reliability
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.rigid import project_body

TURN_DEG = 12.0
"""Rotation of the starts about the bone's joints."""

FAR_TURNS_DEG = (10.0, 20.0)
"""Rotations of the far starts against the neighbour that the bone hangs from."""

SHIFT_MM = 12.0
"""Shift of the starts along the patient's axes."""

_AXES = tuple(sign * axis for axis in np.eye(3) for sign in (-1.0, 1.0))

REACH_MM = 8.0
"""The X-rays count this far around every start's projection."""

SHORT = 3
"""Iterations that every start gets; the best few continue with the level's own."""

KEPT = 3
"""Starts that continue."""


EASED = 1.0
"""Squared standard deviations by which joints are less strained elsewhere before a bone goes there. Of bones far off
they were 1.1 to 28 less so at the true place, of right ones up to 0.15 at another."""


@dataclass(frozen=True)
class Search:
    """How bones are looked for.

    Attributes
    ----------
    far : bool
        Whether they are started far away as well.
    must_refute : bool
        Whether a bone leaves its pose only where the X-rays refute it or its joints are less strained elsewhere, or
        else for any lower cost.

    """

    far: bool = False
    must_refute: bool = False


def restart_bones(
    run: Run,
    observations: Sequence[Observation],
    poses: np.ndarray,
    level: Level,
    which: Collection[int] | None = None,
    search: Search = Search(),
) -> np.ndarray:
    """Fit bones one by one from several starts, with the cameras and the soft tissue held.

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
    which : collection of int, optional
        Indices of the bones that are restarted; None for all.
    search : Search
        How they are looked for.

    Returns
    -------
    (K, 4, 4) ndarray
        Each bone's pose is the best of its starts.

    """
    run = run.named("restarts")
    views = LevelViews(run, observations, level)
    problem, state = views.posed_structures(poses, run.scene.moving)
    order = [link for link in chain_from_anchor(run.scene) if which is None or link[0] in which]
    for n, (k, neighbour) in enumerate(order):
        run.step(n, len(order))
        starts = list(_starts(run.scene, state.poses, k, neighbour, search.far))
        find = first_unless_refuted if search.must_refute else best_of
        found = find(problem, state, k, starts, level.iterations)
        state = state.with_pose(k, state.poses[neighbour] if found is None else found)
    return state.poses


def chain_from_anchor(scene: Scene) -> list[tuple[int, int]]:
    """(bone, the neighbour that links it to the anchor), nearest to the anchor first."""
    reached, order = {scene.anchor}, []
    while len(order) < len(scene.names) - 1:
        for joint in sorted(scene.articulations, key=lambda each: each.slide_mm):
            if (joint.first in reached) != (joint.second in reached):
                inner, outer = joint.first, joint.second
                if inner not in reached:
                    inner, outer = outer, inner
                order.append((outer, inner))
                reached.add(outer)
                break
    return order


def _starts(scene: Scene, poses: np.ndarray, k: int, neighbour: int, far: bool) -> Iterator[np.ndarray]:
    """The present pose, rest, the neighbour's motion, turns about each joint and shifts; then the far ones."""
    pose = poses[k]
    yield pose
    yield np.eye(4)
    yield poses[neighbour]
    for other in {
        each.first + each.second - k for each in scene.companions if k in (each.first, each.second)
    }:
        yield poses[other]
    joints = [each for each in scene.articulations if k in (each.first, each.second)]
    for joint in joints:
        place = fixed_place(pose, joint)
        for axis in _AXES:
            yield pose @ about(perturbation(np.r_[np.radians(TURN_DEG) * axis, np.zeros(3)]), place)
    for axis in _AXES:
        yield pose @ perturbation(np.r_[np.zeros(3), SHIFT_MM * axis])
    if far:
        link = next(each for each in joints if neighbour in (each.first, each.second))
        yield from turned_about(poses[neighbour], link, FAR_TURNS_DEG)


def turned_about(pose: np.ndarray, joint: Articulation, turns_deg: Sequence[float]) -> Iterator[np.ndarray]:
    """A pose (4, 4) with turns about where it takes a joint, in all directions."""
    place = fixed_place(pose, joint)
    for direction in np.ndindex(3, 3, 3):
        axis = np.array(direction) - 1.0
        if axis.any():
            for degrees in turns_deg:
                turn = np.radians(degrees) * axis / np.linalg.norm(axis)
                yield pose @ about(perturbation(np.r_[turn, np.zeros(3)]), place)


def fixed_place(pose: np.ndarray, joint: Articulation) -> np.ndarray:
    """(3,) fixed LPS mm of a joint of a bone with a pose (4, 4)."""
    return (np.linalg.inv(pose) @ np.r_[joint.point, 1.0])[:3]


def best_of(
    problem: RigidProblem, state: State, k: int, starts: Sequence[np.ndarray], iterations: int
) -> np.ndarray | None:
    """The pose (4, 4) at which the best of a bone's starts ends; None where no X-ray shows the bone.

    The other bones and the cameras stand still.
    """
    ends = _ends_of(problem, state, k, starts, iterations)
    return None if ends is None else ends.poses[np.argmin(ends.costs)]


def first_unless_refuted(
    problem: RigidProblem, state: State, k: int, starts: Sequence[np.ndarray], iterations: int
) -> np.ndarray | None:
    """The pose (4, 4) at which the best of a bone's starts ends, or the first one does where that is as likely.

    It is where the X-rays do not refute it and the joints are hardly more strained there.

    None where no X-ray shows the bone. The other bones and the cameras stand still.
    """
    ends = _ends_of(problem, state, k, starts, iterations, with_first=True)
    if ends is None:
        return None
    first, best = ends.poses[0], ends.poses[np.argmin(ends.costs)]
    there, here = (State.of_poses(pose[None], len(ends.alone.views)) for pose in (first, best))
    if is_refuted(ends.alone, here, there):
        return best
    joints = ends.alone.prior
    eased = isinstance(joints, OneBonePrior) and joints.strain(first) - joints.strain(best) > EASED
    return best if eased else first


@dataclass(frozen=True)
class _Ends:
    """Where starts of a bone end. alone: the bone in front of everything else; poses: (S, 4, 4); costs: (S,)."""

    alone: RigidProblem
    poses: np.ndarray
    costs: np.ndarray


def _ends_of(
    problem: RigidProblem,
    state: State,
    k: int,
    starts: Sequence[np.ndarray],
    iterations: int,
    with_first: bool = False,
) -> _Ends | None:
    """Of the best of a bone's starts; with_first: with that of the first one before them."""
    views = [_view_of_one_bone(problem, state, n, k, starts) for n in range(len(problem.views))]
    alone = problem_of_one_bone(problem, state, k, views)
    if alone is None:
        return None
    bone = at_many_poses(alone)
    poses, costs = minimise_together(bone, np.stack(starts), SolverOptions(SHORT))
    kept = np.argsort(costs, kind="stable")[:KEPT]
    if with_first:
        kept = np.r_[0, kept[kept != 0]]
    return _Ends(alone, *minimise_together(bone, poses[kept], SolverOptions(iterations)))


def _view_of_one_bone(
    problem: RigidProblem, state: State, n: int, k: int, starts: Sequence[np.ndarray]
) -> View:
    """A view whose static image holds everything but the bone, weighted where any start projects."""
    view, body = problem.views[n], problem.bodies[k]
    static = problem.render_without(k, state, n)
    shows = np.zeros(static.shape, bool)
    for start in starts:
        mark_shown(shows, project_body(body, view.camera, start, problem.step_mm, problem.backend))
    region = dilated(shows, REACH_MM / pixel_size_mm(view.camera, problem.camera_centre))
    weight = np.where(region & (view.contrast.support > 0), reliability(view), 0).astype(np.float32)
    return replace(view, static=static, weight=weight)
