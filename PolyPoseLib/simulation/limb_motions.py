"""Walking, bending a large joint, opening the mouth: rotations about joints that the labels show.

Axes are those of a supine or standing patient in LPS: x to the left, y to the back, z to the head.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.label_names import structure_of
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.motion import (
    JointMotion,
    bone_kind,
    joint_centre,
    joint_order,
    nearest_of,
    rigid_about,
)
from PolyPoseLib.simulation.named_motions import Anatomy, Posture, lacking

_PELVIS = ("pelvis", "hip", "sacrum")
_LOWER_LEG = ("lower_leg", "tibia")
_FOREARM = ("forearm", "radius", "ulna")

KNEE_OF_LEADING, KNEE_OF_TRAILING, HIP_OF_TRAILING = 1 / 6, 1 / 2, -1 / 3
"""Rotations over the leading hip's flexion, at heel strike of the leading leg: 30 degrees of flexion in front and 10 of
extension behind (after J. Perry and J. Burnfield, "Gait Analysis", 2010, rounded), the leading knee bent by 5. The
trailing knee's 15 are a choice."""

SPINE_SHARE = 1 / 6
"""Rotation of the spine against the pelvis over the hip's flexion: about 5 degrees of 30 (the same)."""

GLIDE_MM = 11.9
"""Largest glide of the jaw's condyles: the straight line from where they start to where they are at the widest opening,
along a curve of 14 mm (J. Travers and others, "Associations between incisor and mandibular condylar movements during
maximum mouth opening in humans", Archives of Oral Biology 45, 2000)."""

WIDEST_DEG = 30.0
"""Opening at which condyles have glided so far: a choice, as is their direction."""

GLIDE_DIRECTION = np.array([0.0, -2.0, -1.0]) / np.sqrt(5.0)
"""Forwards and half as much down."""

_SPREAD = 0.06
"""Standard deviation of rotations about the other two axes, over that about the first."""


def gait(anatomy: Anatomy, amplitude: float, rng: np.random.Generator) -> Posture:
    """A step: one hip flexes by amplitude (degrees), the other extends, knees bend, the spine turns back.

    Raises InputError unless both femora and the pelvis are structures and the pelvis is the anchor.
    """
    sides = {side: anatomy.named(f"femur_{side}") for side in ("left", "right")}
    if not all(sides.values()) or anatomy.anchor not in anatomy.find(_PELVIS):
        raise lacking("gait", "both femurs (femur_left, femur_right), and the pelvis as the anchor", anatomy)
    leading = ("left", "right")[rng.integers(2)]
    turns = {}
    for side in sides:
        ahead = side == leading
        hip = 1.0 if ahead else HIP_OF_TRAILING
        knee = KNEE_OF_LEADING if ahead else KNEE_OF_TRAILING
        wobble = rng.normal(0, _SPREAD, 2) * amplitude
        turns[sides[side][0]] = [-hip * amplitude, *wobble]
        turns |= {name: [knee * amplitude, 0, 0] for name in _of_side(anatomy.find(_LOWER_LEG), side)}
    turn = SPINE_SHARE * amplitude * (1 if leading == "left" else -1)
    spine = [name for name in anatomy.structures.names if _is_spine(name)]
    turns |= {name: [0, 0, turn / len(spine)] for name in spine}
    return Posture(articulated(anatomy, turns))


def flexion(anatomy: Anatomy, amplitude: float, rng: np.random.Generator) -> Posture:
    """Bend the hips by amplitude (degrees); where there are none the knees, and without these the elbows.

    Raises InputError when no two structures make such a joint.
    """
    hips, knees, elbows = (
        [name for name in anatomy.find(words) if name != anatomy.anchor] if anatomy.find(parents) else []
        for words, parents in ((("femur",), _PELVIS), (_LOWER_LEG, ("femur",)), (_FOREARM, ("humerus",)))
    )
    bent = hips or knees or elbows
    if not bent:
        raise lacking(
            "flexion", "a femur and the pelvis, a lower leg and a femur, or a forearm and a humerus", anatomy
        )
    sign = 1.0 if bent[0] in knees and not hips else -1.0
    wobble = {side: rng.normal(0, _SPREAD, 2) * amplitude for side in ("left", "right")}
    turns = {
        name: [sign * amplitude, *wobble["left" if "left" in name.lower() else "right"]] for name in bent
    }
    return Posture(articulated(anatomy, turns))


def jaw(anatomy: Anatomy, amplitude: float, rng: np.random.Generator) -> Posture:
    """Open the mouth by amplitude (degrees): the jaw turns about its condyles, which glide forwards.

    Raises InputError unless the mandible is a structure of two halves, and not the anchor.
    """
    found = [name for name in anatomy.named("mandible") if name != anatomy.anchor]
    if not found:
        raise lacking("jaw", "the mandible, and another structure as the anchor", anatomy)
    name = found[0]
    left, right = condyles(anatomy.points[name])
    axis = (left - right) / np.linalg.norm(left - right)
    axis += [0, *rng.normal(0, _SPREAD / 3, 2)]
    axis /= np.linalg.norm(axis)
    share = np.clip(rng.normal(1, 0.15), 0.5, 1.5)
    glide = GLIDE_MM * min(share * amplitude / WIDEST_DEG, 1.0) * GLIDE_DIRECTION
    middle = (left + right) / 2
    motion = rigid_about(middle, np.radians(amplitude) * axis, glide)
    return Posture({name: JointMotion(anatomy.anchor, middle, amplitude, axis, motion)})


def condyles(mandible: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left and right condyle (3,) of a mandible's voxel centres (N, 3): the tops of the posterior quarter of each side.

    Raises InputError when the mandible has one side only.
    """
    middle = (mandible[:, 0].min() + mandible[:, 0].max()) / 2
    sides = mandible[mandible[:, 0] > middle], mandible[mandible[:, 0] <= middle]
    if not all(map(len, sides)):
        raise InputError("The mandible is one voxel wide and has no condyles: check its labels.")
    ends = []
    for side in sides:
        behind = side[side[:, 1] >= side[:, 1].min() + 0.75 * np.ptp(side[:, 1])]
        ends.append(behind[behind[:, 2] > behind[:, 2].max() - 6.0].mean(0))
    return ends[0], ends[1]


def _of_side(names: list[str], side: str) -> list[str]:
    """Names of one side of the body."""
    return [name for name in names if side in name.lower()]


def articulated(anatomy: Anatomy, turns: dict[str, list[float]]) -> dict[str, JointMotion]:
    """Motions of all structures: each turns by its rotation vector (degrees) about its joint and follows its parent.

    What hangs on the anchor but belongs to the trunk follows the spine's structure nearest to it.
    """
    points = anatomy.points
    placed = {anatomy.anchor: np.eye(4)}
    joints = {}
    for name, first in joint_order(points, anatomy.anchor):
        on_trunk = first == anatomy.anchor and _is_of_trunk(name)
        parent = nearest_of(points, name, [first, *filter(_is_spine, joints)]) if on_trunk else first
        turn = np.radians(turns.get(name, [0.0, 0.0, 0.0]))
        joint = joint_centre(name, points[name], points[parent])
        placed[name] = placed[parent] @ rigid_about(joint, turn, np.zeros(3))
        joints[name] = JointMotion.turned(parent, joint, turn, placed[name])
    return joints


def _is_spine(name: str) -> bool:
    return bone_kind(name) == "spine"


def _is_of_trunk(name: str) -> bool:
    """Whether a structure moves with the spine: ribs, shoulders, arms and the head."""
    kind = bone_kind(name)
    return (
        kind in ("rib", "girdle", "other") and structure_of(name) != "pelvis"
    ) or "humerus" in name.lower()
