"""Another look at every bone from other starting poses, one bone at a time.

Least squares find the nearest valley only.  After the coarsest level each bone, from the anchor outwards, is started
anew: turned about its joints to either side of three axes, shifted, carried along with its neighbour, and at rest.
The start that ends at the lowest cost over one fixed region of the X-rays is kept.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import ArticulationPrior, OneBonePrior
from PolyPoseLib.registration.fit.levels import Level, Observation, pixel_size_mm, view_at
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.weighting import VISIBLE_LINE_INTEGRAL, dilated, reliability
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend
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
"""Iterations that every start gets; the best few go on with the level's own."""

KEPT = 3
"""Starts that go on."""


def restart_bones(
    scene: Scene,
    soft: SoftTissue,
    measured: Sequence[Observation],
    poses: np.ndarray,
    level: Level,
    backend: Backend,
    monitor: Monitor,
    which: Collection[int] | None = None,
    far: bool = False,
) -> np.ndarray:
    """Poses (K, 4, 4) fixed to moving, each bone's the best of several starts; cameras stand still.

    which: indices of the bones that are started anew, None for all; far: whether they are started far away as well.
    """
    views = [view_at(level, m, scene.anchor_centre) for m in measured]
    field = soft.coarse_field(poses)
    tissue = [soft.render(field, view.camera, np.eye(4), level.size_mm, backend) for view in views]
    poses = poses.copy()
    order = [link for link in chain_from_anchor(scene) if which is None or link[0] in which]
    for n, (k, neighbour) in enumerate(order):
        monitor.step("restarts", n, len(order), None)
        poses[k] = _best_start(_Bone(scene, k, level, backend), views, tissue, poses, neighbour, far)
    return poses


def chain_from_anchor(scene: Scene) -> list[tuple[int, int]]:
    """(bone, the neighbour it hangs from), nearest to the anchor first."""
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


@dataclass(frozen=True)
class _Bone:
    scene: Scene
    number: int
    level: Level
    backend: Backend


def _starts(pose: np.ndarray, carried: np.ndarray, joints: Sequence[np.ndarray]) -> Iterator[np.ndarray]:
    """The present pose, rest, the neighbour's motion, turns about each joint and shifts."""
    yield pose
    yield np.eye(4)
    yield carried
    for joint in joints:
        place = (np.linalg.inv(pose) @ np.r_[joint, 1.0])[:3]
        for axis in _AXES:
            yield pose @ about(perturbation(np.r_[np.radians(TURN_DEG) * axis, np.zeros(3)]), place)
    for axis in _AXES:
        yield pose @ perturbation(np.r_[np.zeros(3), SHIFT_MM * axis])


def _far_starts(carried: np.ndarray, joint: np.ndarray) -> Iterator[np.ndarray]:
    """The neighbour's motion with turns about the joint with it in all directions."""
    place = (np.linalg.inv(carried) @ np.r_[joint, 1.0])[:3]
    for direction in np.ndindex(3, 3, 3):
        axis = np.array(direction) - 1.0
        if axis.any():
            for degrees in FAR_TURNS_DEG:
                turn = np.radians(degrees) * axis / np.linalg.norm(axis)
                yield carried @ about(perturbation(np.r_[turn, np.zeros(3)]), place)


def _joint(bone: _Bone, neighbour: int) -> np.ndarray:
    """(3,) LPS mm in the CT, where a bone meets the neighbour that it hangs from."""
    pair = {bone.number, neighbour}
    return next(each.point for each in bone.scene.articulations if {each.first, each.second} == pair)


def _best_start(
    bone: _Bone,
    views: Sequence[View],
    tissue: Sequence[np.ndarray],
    poses: np.ndarray,
    neighbour: int,
    far: bool,
) -> np.ndarray:
    body = bone.scene.bodies(bone.level.size_mm)[bone.number]
    joints = [each.point for each in bone.scene.articulations if bone.number in (each.first, each.second)]
    starts = list(_starts(poses[bone.number], poses[neighbour], joints))
    starts += _far_starts(poses[neighbour], _joint(bone, neighbour)) if far else []
    seen = [_view_of_one_bone(bone, n, view, tissue[n], poses, starts) for n, view in enumerate(views)]
    seen = [view.cropped_to_weight() for view in seen if (view.weight > 0).any()]
    if not seen:
        return poses[neighbour]
    centre = bone.scene.anchor_centre
    joints = ArticulationPrior(
        bone.scene.articulations, bone.scene.centres, [bone.number], bone.level.joint_weight
    )
    prior = OneBonePrior(joints, bone.number, poses)
    problem = RigidProblem([body], seen, [0], [], centre, bone.level.size_mm, bone.backend, prior)
    corrections = np.stack([np.eye(4)] * len(seen))
    short = [minimise(problem, State(start[None], corrections), SolverOptions(SHORT)) for start in starts]
    best = sorted(short, key=lambda solution: solution.cost)[:KEPT]
    final = [minimise(problem, solution.state, SolverOptions(bone.level.iterations)) for solution in best]
    return min(final, key=lambda solution: solution.cost).state.poses[0]


def _view_of_one_bone(
    bone: _Bone, n: int, view: View, tissue: np.ndarray, poses: np.ndarray, starts: Sequence[np.ndarray]
) -> View:
    """A view whose static image holds everything but the bone, weighted where any start projects."""
    size = bone.level.size_mm
    static = tissue.copy()
    for k, body in enumerate(bone.scene.bodies(size)):
        if k != bone.number:
            part = project_body(body, view.camera, poses[k], size, bone.backend)
            static[part.slices] += part.image
    body = bone.scene.bodies(size)[bone.number]
    shows = np.zeros(static.shape, bool)
    for start in starts:
        part = project_body(body, view.camera, start, size, bone.backend)
        shows[part.slices] |= np.abs(part.image) > VISIBLE_LINE_INTEGRAL
    region = dilated(shows, REACH_MM / pixel_size_mm(view.camera, bone.scene.anchor_centre))
    weight = np.where(region & (view.contrast.support > 0), reliability(view), 0).astype(np.float32)
    return replace(view, static=static, weight=weight)
