"""Motions over time: how far every bone has gone from its place in the CT at any second.

A motion is a tree of joints, as in :mod:`PolyPoseLib.simulation.motion`, whose angles are smooth functions of time.
All of them are laws of their own, made from the labels alone: nothing here knows the registration's model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from PolyPoseLib.simulation.motion import apply

if TYPE_CHECKING:
    from PolyPoseLib.simulation.named_motions import Posture

Course = Callable[[np.ndarray], np.ndarray]
"""Seconds (F,) to numbers (F,)."""


class Motion:
    """Where bones are at any time; the base of all motions.

    `at` gives motions (F, K, 4, 4) from the CT's LPS mm to the moved patient's at seconds (F,), the bones in the
    order of `names`.
    """

    names: tuple[str, ...]

    def at(self, seconds: np.ndarray) -> np.ndarray:
        """Motions (F, K, 4, 4), moving to fixed, at seconds (F,)."""
        raise NotImplementedError


@dataclass(frozen=True)
class Joint:
    """How a bone moves against its parent.

    Attributes
    ----------
    parent : str
        Another bone; the bone itself if it stays.
    centre : (3,) array
        The joint in the CT, LPS mm.
    turns : list of ((3,) array, Course)
        Rotation vectors in radians and what they are multiplied by over time; they are added before they turn.
    slides : list of ((3,) array, Course)
        Shifts in mm likewise.

    """

    parent: str
    centre: np.ndarray
    turns: Sequence[tuple[np.ndarray, Course]] = ()
    slides: Sequence[tuple[np.ndarray, Course]] = ()

    def at(self, seconds: np.ndarray) -> np.ndarray:
        """Motions (F, 4, 4) against the parent."""
        turn, slide = (
            sum(
                (course(seconds)[:, None] * np.asarray(vector) for vector, course in parts),
                start=np.zeros((len(seconds), 3)),
            )
            for parts in (self.turns, self.slides)
        )
        motions = np.tile(np.eye(4), (len(seconds), 1, 1))
        motions[:, :3, :3] = Rotation.from_rotvec(turn).as_matrix()
        motions[:, :3, 3] = self.centre + slide - motions[:, :3, :3] @ self.centre
        return motions


@dataclass(frozen=True)
class JointedMotion(Motion):
    """Bones that hang together by joints.

    Attributes
    ----------
    names : tuple of str
        All bones.
    joints : mapping of str to Joint
        Parents before children; a bone without one goes with the whole.
    whole : Joint, optional
        What the whole patient does besides.

    """

    names: tuple[str, ...]
    joints: Mapping[str, Joint]
    whole: Joint | None = None

    def at(self, seconds: np.ndarray) -> np.ndarray:
        """Motions (F, K, 4, 4), moving to fixed, at seconds (F,)."""
        seconds = np.asarray(seconds, dtype=np.float64)
        still = np.tile(np.eye(4), (len(seconds), 1, 1))
        placed: dict[str, np.ndarray] = {}
        for name, joint in self.joints.items():
            placed[name] = placed.get(joint.parent, still) @ joint.at(seconds)
        bones = np.stack([placed.get(name, still) for name in self.names], axis=1)
        return bones if self.whole is None else self.whole.at(seconds)[:, None] @ bones


@dataclass(frozen=True)
class GivenMotion(Motion):
    """Motions of a table; between its rows rotations about the bones' middles and these middles move evenly.

    Attributes
    ----------
    names : tuple of str
        All bones.
    seconds : (F,) array
        Rising.
    motions : (F, K, 4, 4) array
        Moving to fixed, LPS mm.
    centroids : (K, 3) array
        Of the bones in the CT, LPS mm.

    """

    names: tuple[str, ...]
    seconds: np.ndarray
    motions: np.ndarray
    centroids: np.ndarray

    def at(self, seconds: np.ndarray) -> np.ndarray:
        """Motions (F, K, 4, 4), moving to fixed; before the first row and after the last one bones stand still."""
        when = np.clip(seconds, self.seconds[0], self.seconds[-1])
        found = np.tile(np.eye(4), (len(when), len(self.names), 1, 1))
        for bone, middle in enumerate(self.centroids):
            turns = self.motions[:, bone, :3, :3]
            places = turns @ middle + self.motions[:, bone, :3, 3]
            if len(self.seconds) > 1:
                turn = Slerp(self.seconds, Rotation.from_matrix(turns))(when).as_matrix()
                place = np.stack([np.interp(when, self.seconds, axis) for axis in places.T], axis=-1)
            else:
                turn, place = (np.repeat(each, len(when), axis=0) for each in (turns, places))
            found[:, bone, :3, :3], found[:, bone, :3, 3] = turn, place - turn @ middle
        return found


def scaled_posture(
    names: tuple[str, ...], posture: Posture, course: Course, whole: Joint | None = None
) -> JointedMotion:
    """A posture approached and left: every joint's rotation and shift are multiplied by a course.

    Parameters
    ----------
    names : tuple of str
        All bones.
    posture : Posture
        Where the course is 1.
    course : Course
        0 is rest.
    whole : Joint, optional
        What the whole patient does besides.

    """
    joints: dict[str, Joint] = {}
    for name, motion in posture.joints.items():
        parent = (
            posture.joints[motion.parent].moving_to_fixed if motion.parent in posture.joints else np.eye(4)
        )
        local = np.linalg.inv(parent) @ motion.moving_to_fixed
        turn = Rotation.from_matrix(local[:3, :3]).as_rotvec()
        slide = apply(local, motion.joint) - motion.joint
        own = motion.parent == name
        if not own:
            joints[name] = Joint(motion.parent, motion.joint, [(turn, course)], [(slide, course)])
    return JointedMotion(names, _parents_first(joints), whole)


@dataclass(frozen=True)
class Waves:
    """A sum of sines: a course that never stops and is smooth.

    Attributes
    ----------
    amplitudes, hertz, phases : tuple of float
        Of every sine; phases in radians.

    """

    amplitudes: tuple[float, ...]
    hertz: tuple[float, ...]
    phases: tuple[float, ...] = field(default=())

    def __call__(self, seconds: np.ndarray) -> np.ndarray:
        """Numbers (F,) at seconds (F,)."""
        phases = self.phases or (0.0,) * len(self.hertz)
        parts = zip(self.amplitudes, self.hertz, phases, strict=True)
        return sum(
            (a * np.sin(2 * np.pi * f * seconds + p) for a, f, p in parts),
            start=np.zeros(len(seconds)),
        )


def there_and_back(period_s: float) -> Course:
    """From 0 to 1 and back within a period, with a smooth turn at both ends."""
    return lambda seconds: (1 - np.cos(2 * np.pi * np.asarray(seconds) / period_s)) / 2


def _parents_first(joints: Mapping[str, Joint]) -> dict[str, Joint]:
    """The same joints, every one after its parent's."""
    ordered: dict[str, Joint] = {}
    left = dict(joints)
    while left:
        ready = [name for name, joint in left.items() if joint.parent not in left or joint.parent == name]
        for name in ready or list(left):
            ordered[name] = left.pop(name)
    return ordered
