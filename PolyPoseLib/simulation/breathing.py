"""Breathing in: ribs turn about their joints with the spine, the sternum follows them, the diaphragm descends.

Liver and heart go with the diaphragm, what lies between follows the soft tissue's law, and lungs become less dense as
they grow. The measures of the ribs are those between functional residual capacity and total lung capacity (T. Wilson
and others, "Geometry and respiratory displacement of human ribs", Journal of Applied Physiology 62, 1987), scaled by
how far the diaphragm descends against the deepest breath (A. Boussuges and others, "Diaphragmatic motion studied by
M-mode ultrasonography", Chest 135, 2009). LPS: x to the left, y to the back, z to the head.
"""

from __future__ import annotations

import re
from collections.abc import Container

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.label_names import structure_of
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.diaphragm import soft_organs
from PolyPoseLib.simulation.motion import JointMotion, apply, bone_kind, joint_centre, rigid_about
from PolyPoseLib.simulation.named_motions import Anatomy, Posture, lacking

DEEPEST_MM = 64.0
"""Descent of the diaphragm's right half in the deepest breath, the mean of men and women (Boussuges 2009, standing:
70 mm, standard deviation 11, of men; 57, standard deviation 10, of women)."""

RIB_NUMBERS = (1, 3, 7, 10, 12)
PUMP_HANDLE_DEG = (11.0, 11.0, 7.0, 4.0, 2.0)
BUCKET_HANDLE_DEG = (7.0, 13.0, 10.0, 8.0, 4.0)
"""Rotation of ribs in the deepest breath about the left-right and about the front-back axis, at RIB_NUMBERS; measured
for the 3rd to the 7th (Wilson 1987), continued to both ends: upper ribs are pump handles, lower ones bucket handles,
floating ones hardly move."""

_RIB = re.compile(r"^rib_(left|right)_(\d+)$")
_CONTACT_MM = 8.0
"""Front ends of ribs lie within so much of their point nearest to the sternum."""

_FRONT_RIBS = range(1, 8)
"""Ribs that reach the sternum, by cartilages of up to _CARTILAGE_MM."""

_CARTILAGE_MM = 90.0


def breathing(anatomy: Anatomy, amplitude: float, rng: np.random.Generator) -> Posture:
    """Breathe in until the right half of the diaphragm has descended by amplitude (mm).

    Raises InputError unless every rib is a structure of its own, the spine is the anchor, and lungs are among the
    labels.
    """
    ribs = numbered_ribs(anatomy)
    fused = _holding_ribs(anatomy, ribs)
    if fused:
        raise lacking(
            "breathing", f'every rib as a structure of its own, but "{fused[0]}" holds ribs', anatomy
        )
    if not ribs or not _is_spine(anatomy.anchor):
        raise lacking(
            "breathing", "every rib as a structure of its own, and the spine as the anchor", anatomy
        )
    spine = [name for name in anatomy.structures.names if _is_spine(name)]
    lungs = anatomy.organ("lung")
    if not lungs.any():
        raise lacking("breathing", "lungs among the labels, and a label table that names them", anatomy)
    share = amplitude / DEEPEST_MM
    backbone = np.concatenate([anatomy.points[name] for name in spine])
    sides = {side: float(np.clip(rng.normal(1, 0.1), 0.6, 1.4)) for side in ("left", "right")}
    joints = {}
    for name, (side, number) in ribs.items():
        own = sides[side] * float(np.clip(rng.normal(1, 0.05), 0.8, 1.2))
        joints[name] = rib_motion(anatomy.points[name], backbone, side, number, own * share, anatomy.anchor)
    joints |= _sternum(anatomy, ribs, joints)
    joints |= _clavicles(anatomy, joints)
    return Posture(joints, soft_organs(anatomy, lungs, amplitude, rng))


def numbered_ribs(anatomy: Anatomy) -> dict[str, tuple[str, int]]:
    """{structure that is one rib: (side, number)}."""
    found = {}
    for name in anatomy.structures.names:
        rib = _RIB.match(structure_of(name, "bones") or "")
        if rib:
            found[name] = (rib[1], int(rib[2]))
    return found


def _holding_ribs(anatomy: Anatomy, ribs: Container[str]) -> list[str]:
    """Structures that hold ribs, by their names or by most of the voxels of a rib's label, but are not one of ribs."""
    names = anatomy.structures.names
    holding = {name for name in names if _is_of_ribs(name)}
    if anatomy.labels is not None:
        numbers = [number for number, name in anatomy.names.items() if _is_of_ribs(name)]
        here = np.isin(anatomy.labels, numbers)
        labels, structures = anatomy.labels[here], anatomy.structures.labels[here]
        for label in np.unique(labels):
            counts = np.bincount(structures[labels == label], minlength=len(names) + 1)
            most = int(counts.argmax())
            if most and 2 * counts[most] > counts.sum():
                holding.add(names[most - 1])
    return [name for name in names if name in holding and name not in ribs]


def separate_ribs(
    groups: dict[str, list[int]], anchor: str, names: dict[int, str]
) -> tuple[dict[str, list[int]], str]:
    """Take ribs and the sternum out of structures that hold them with others.

    Parameters
    ----------
    groups : dict[str, list[int]]
        {structure: its labels}.
    anchor : str
        One of them.
    names : dict[int, str]
        Of the labels, {label: name}.

    Returns
    -------
    groups, anchor
        What is left of a structure takes the name that fits all its labels, if there is one that is not taken. An
        anchor that is one such bone takes its name.

    Raises
    ------
    InputError
        The anchor holds several ribs, or ribs and the sternum, and nothing else.

    """
    parts: dict[str, list[int]] = {}
    held = anchor
    for name, labels in groups.items():
        moving = {label: structure_of(names.get(label, ""), "bones") or "" for label in labels}
        alone = {label: kind for label, kind in moving.items() if _RIB.match(kind) or kind == "sternum"}
        rest = [label for label in labels if label not in alone]
        kinds = {structure_of(names.get(label, "")) for label in rest}
        kind = next(iter(kinds)) if alone and len(kinds) == 1 else None
        renamed = kind if kind and kind not in groups and kind not in parts else name
        if rest:
            parts.setdefault(renamed, []).extend(rest)
        if name == anchor:
            bones = set(alone.values())
            if not rest and len(bones) > 1:
                raise InputError(
                    f'The anchor "{anchor}" holds nothing but ribs and the sternum, which breathing moves apart: '
                    "choose the spine as the anchor."
                )
            held = renamed if rest else next(iter(bones), name)
        for label, bone in alone.items():
            parts.setdefault(bone, []).append(label)
    return parts, held


def rib_motion(
    rib: np.ndarray, spine: np.ndarray, side: str, number: int, share: float, parent: str
) -> JointMotion:
    """A rib's rotation about an axis through its joint with the spine.

    Parameters
    ----------
    rib, spine : (N, 3) array
        Voxel centres, LPS mm.
    side : {"left", "right"}
        Of the body.
    number : int
        1 to 12, from the head.
    share : float
        Of the deepest breath, 0 at rest.
    parent : str
        Name of the spine.

    """
    pump, bucket = (np.interp(number, RIB_NUMBERS, values) for values in (PUMP_HANDLE_DEG, BUCKET_HANDLE_DEG))
    outwards = 1.0 if side == "left" else -1.0
    # The front end rises with a turn against x on both sides, the side of the rib with one away from the middle.
    turn = share * np.radians([-pump, -outwards * bucket, 0.0])
    joint = joint_centre("rib", rib, spine)
    return JointMotion.turned(parent, joint, turn, rigid_about(joint, turn, np.zeros(3)))


def _sternum(
    anatomy: Anatomy, ribs: dict[str, tuple[str, int]], joints: dict[str, JointMotion]
) -> dict[str, JointMotion]:
    """The rigid motion of the sternum that fits where the front ends of the ribs go, in the least squares."""
    moved = {}
    for name in anatomy.find(("sternum",)):
        tree = KDTree(anatomy.points[name])
        before, after = [], []
        for rib, (_, number) in ribs.items():
            distance, _ = tree.query(anatomy.points[rib])
            if number in _FRONT_RIBS and distance.min() < _CARTILAGE_MM:
                end = anatomy.points[rib][distance < distance.min() + _CONTACT_MM].mean(0)
                before.append(end)
                after.append(apply(joints[rib].moving_to_fixed, end))
        if len(before) >= 3:
            moved[name] = _fitted(
                np.array(before), np.array(after), anatomy.points[name].mean(0), anatomy.anchor
            )
    return moved


def _fitted(before: np.ndarray, after: np.ndarray, joint: np.ndarray, parent: str) -> JointMotion:
    """The rigid motion that takes points (N, 3) to others best."""
    first, second = before.mean(0), after.mean(0)
    rotation = Rotation.align_vectors(after - second, before - first)[0]
    motion = np.eye(4)
    motion[:3, :3] = rotation.as_matrix()
    motion[:3, 3] = second - motion[:3, :3] @ first
    return JointMotion.turned(parent, joint, rotation.as_rotvec(), motion)


def _clavicles(anatomy: Anatomy, joints: dict[str, JointMotion]) -> dict[str, JointMotion]:
    """Clavicles turn about their outer ends so that the inner ones go with the sternum."""
    sternum = next((name for name in anatomy.find(("sternum",)) if name in joints), None)
    if sternum is None:
        return {}
    moved = {}
    for name in anatomy.find(("clavic",)):
        points = anatomy.points[name]
        distance, _ = KDTree(anatomy.points[sternum]).query(points)
        inner = points[distance < distance.min() + _CONTACT_MM].mean(0)
        away = np.linalg.norm(points - inner, axis=1)
        outer = points[away > away.max() - _CONTACT_MM].mean(0)
        old, new = inner - outer, apply(joints[sternum].moving_to_fixed, inner) - outer
        cross = np.cross(old, new)
        angle = float(np.arctan2(np.linalg.norm(cross), old @ new))
        axis = cross / max(float(np.linalg.norm(cross)), 1e-12)
        motion = rigid_about(outer, angle * axis, np.zeros(3))
        moved[name] = JointMotion.turned(sternum, outer, angle * axis, motion)
    return moved


def _is_spine(name: str) -> bool:
    """Whether a structure is the spine or what is left of a thorax without its ribs."""
    return bone_kind(name) == "spine" or "thorax" in name.lower()


def _is_of_ribs(name: str) -> bool:
    """Whether a name is that of a rib or of several."""
    ribs = bone_kind(name) == "rib" and "sternum" not in name.lower()
    return ribs or (structure_of(name) or "").startswith("ribs")
