"""Joints and motions: about which point each bone turns, and random postures in which bones do not collide.

Everything here works on the geometry of the labels alone, independently of the registration's deformation model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import find_objects
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures

ROTATION_RANGE_DEG: dict[str, tuple[float, float]] = {
    "limb": (10.0, 18.0),
    "girdle": (3.0, 6.0),
    "spine": (3.0, 6.0),
    "rib": (1.0, 2.0),
    "other": (3.0, 6.0),
}
"""Rotation at the joint, in degrees; for the spine, of each vertebra against the anchor."""

AXIS_WEIGHTS: dict[str, tuple[float, float, float]] = {
    "limb": (1.0, 1.0, 0.5),
    "girdle": (0.5, 1.0, 0.7),
    "spine": (1.0, 0.6, 0.4),
    "rib": (1.0, 0.6, 0.6),
    "other": (1.0, 1.0, 1.0),
}
"""Spread of the rotation axis along left-right, front-back and head-foot (LPS x, y, z)."""

MAX_OVERLAP = 0.03
"""Largest share of a bone's voxels that may lie inside another moved bone."""

_LIMBS = [
    "femur",
    "humerus",
    "leg",
    "forearm",
    "tibia",
    "fibula",
    "ulna",
    "radius",
    "patella",
    "hand",
    "foot",
]
_WORDS = (
    ("limb", _LIMBS),
    ("girdle", ("clavic", "scapula")),
    ("rib", ("rib_", "ribs", "sternum")),
    ("spine", ("vertebra", "lumbar", "thoracic", "cervical", "spine")),
)
_PARENT_WORDS = {
    "femur": ("hip", "pelvis"),
    "humerus": ("scapula", "clavic"),
    "scapula": ("clavic",),
    "clavic": ("sternum",),
    "sternum": ("ribs",),
    "tibia": ("femur",),
    "fibula": ("tibia", "femur"),
    "leg": ("femur",),
    "patella": ("femur",),
    "foot": ("leg", "tibia"),
    "ulna": ("humerus",),
    "radius": ("humerus",),
    "forearm": ("humerus",),
    "hand": ("forearm", "radius"),
}
_MAX_POINTS = 20_000
_CONTACT_BAND_MM = 5.0
_HEAD_BAND_MM = 6.0
_HEAD_RADIUS_MM = (12.0, 35.0)


@dataclass(frozen=True)
class JointMotion:
    """One bone's motion and the joint it turns about.

    Attributes
    ----------
    parent : str
        The bone on the other side of the joint.
    joint : (3,) array
        LPS mm in the moving frame.
    rotation_deg : float
        Rotation at the joint, relative to the parent.
    axis : (3,) array
        Its axis, LPS.
    moving_to_fixed : (4, 4) array
        LPS mm.
    overlap : float, optional
        Share of the bone inside bones placed before it, where motions are drawn. None in named motions, which do not
        look; a case's statistics have it for both.

    """

    parent: str
    joint: np.ndarray
    rotation_deg: float
    axis: np.ndarray
    moving_to_fixed: np.ndarray
    overlap: float | None = None

    @classmethod
    def turned(
        cls, parent: str, joint: np.ndarray, turn: np.ndarray, moving_to_fixed: np.ndarray
    ) -> JointMotion:
        """Of a bone that turns at its joint by a rotation vector (3,) in radians; about z where it does not turn."""
        angle = float(np.linalg.norm(turn))
        axis = turn / angle if angle > 1e-12 else np.array([0.0, 0.0, 1.0])
        return cls(parent, joint, float(np.degrees(angle)), axis, moving_to_fixed)


def bone_kind(name: str) -> str:
    """The row of ROTATION_RANGE_DEG for a structure's name; "other" when none fits."""
    lowered = name.lower() + ("_" if name.lower().endswith("rib") else "")
    for kind, words in _WORDS:
        if any(word in lowered for word in words):
            return kind
    return "other"


def rigid_about(centre: np.ndarray, rotation_vector: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """The motion x -> R (x - centre) + centre + shift, (4, 4); rotation_vector (3,) rad, others (3,) mm."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    motion[:3, 3] = centre + shift - motion[:3, :3] @ centre
    return motion


def apply(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Map points (..., 3) with a homogeneous (4, 4) matrix."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def structure_points(structures: Structures, affine: np.ndarray) -> dict[str, np.ndarray]:
    """Voxel centres (N, 3) in LPS mm of every structure; raises InputError when a structure has no voxel."""
    boxes = find_objects(structures.labels, max_label=len(structures.names))
    points = {}
    for number, (name, box) in enumerate(zip(structures.names, boxes, strict=True), start=1):
        if box is None:
            raise InputError(
                f"Structure {name!r} has no voxel in the label map: give it labels that occur there."
            )
        kji = np.argwhere(structures.labels[box] == number) + [part.start for part in box]
        points[name] = apply(affine, kji[:, ::-1].astype(np.float64))
    return points


def draw_motions(
    structures: Structures,
    affine: np.ndarray,
    anchor: str,
    rng: np.random.Generator,
    slide_mm: float = 1.0,
    scale: float = 1.0,
) -> dict[str, JointMotion]:
    """Draw a posture: every structure but the anchor turns about the joint with its parent.

    Bones are placed one after another outwards from the anchor; a draw that pushes more than MAX_OVERLAP of
    a bone into bones placed before is drawn again, then shrunk. Structures of the spine bend together, 3
    degrees next to the anchor growing to at most 6 at the far end.

    Parameters
    ----------
    structures : Structures
        Labels on the CT's grid.
    affine : (4, 4) array
        Index (i, j, k) to LPS mm of that grid.
    anchor : str
        The structure that stays.
    rng : np.random.Generator
        The generator of every random number.
    slide_mm : float
        Standard deviation per axis of an additional shift of the joint, which makes the truth no pure rotation.
    scale : float
        Factor on every rotation and shift (0 gives rest).

    Returns
    -------
    dict[str, JointMotion]
        {structure: its motion}, the anchor's at rest included.

    Raises
    ------
    InputError
        The anchor is not a structure, or a structure is empty.

    """
    if anchor not in structures.names:
        raise InputError(f"The anchor {anchor!r} is not among the structures {', '.join(structures.names)}.")
    points = structure_points(structures, affine)
    sampler = _LabelSampler(structures, affine)
    order = joint_order(points, anchor)
    spine = [name for name, _ in order if bone_kind(name) == "spine"]
    spine_turns = dict(zip(spine, _spine_turns(len(spine), rng), strict=True))
    placed = {anchor: np.eye(4)}
    motions = {
        anchor: JointMotion(anchor, points[anchor].mean(0), 0.0, np.array([0.0, 0, 1]), np.eye(4), 0.0)
    }
    for name, parent in order:
        joint = joint_centre(name, points[name], points[parent])
        few = _thin(points[name], 4000)
        shrink = 1.0
        drawn: list[tuple[float, JointMotion]] = []
        for attempt in range(60):
            if attempt >= 20:
                shrink *= 0.9
            turn = spine_turns[name] if name in spine_turns else _turn(bone_kind(name), rng)
            shift = rng.normal(0, slide_mm, 3)
            local = rigid_about(joint, turn * shrink * scale, shift * shrink * scale)
            candidate = placed[parent] @ local
            overlap = sampler.overlap(few, candidate, placed)
            angle = float(np.degrees(np.linalg.norm(turn)) * shrink * scale)
            axis = turn / max(np.linalg.norm(turn), 1e-12)
            drawn.append((overlap, JointMotion(parent, joint, angle, axis, candidate, overlap)))
            if overlap <= MAX_OVERLAP:
                break
        best = min(drawn, key=lambda each: each[0])[1]
        placed[name] = best.moving_to_fixed
        motions[name] = best
    return motions


def joint_centre(name: str, bone: np.ndarray, parent: np.ndarray) -> np.ndarray:
    """The point (3,) in mm about which a bone turns against its parent, from their voxel centres (N, 3).

    Femur and humerus: the centre of the sphere through the bone's voxels that face the parent (the head).
    Ribs: the end next to the spine, that is towards the parent's posterior part. Others: the middle of the
    contact.
    """
    if "rib" in name.lower():
        behind = parent[parent[:, 1] > np.median(bone[:, 1])]
        parent = behind if len(behind) else parent
    bone = _thin(bone, _MAX_POINTS)
    distance, _ = KDTree(_thin(parent, _MAX_POINTS)).query(bone)
    contact = bone[distance < distance.min() + _CONTACT_BAND_MM]
    if any(word in name.lower() for word in ("femur", "humerus")):
        head = _sphere_centre(bone[distance < distance.min() + _HEAD_BAND_MM])
        if head is not None and np.linalg.norm(head - contact.mean(0)) < _HEAD_RADIUS_MM[1]:
            return head
    return contact.mean(0)


def _sphere_centre(points: np.ndarray) -> np.ndarray | None:
    """Centre of the least-squares sphere (algebraic fit); None when its radius is no bone head's."""
    if len(points) < 10:
        return None
    system = np.c_[2 * points, np.ones(len(points))]
    solution, *_ = np.linalg.lstsq(system, (points**2).sum(1), rcond=None)
    radius = np.sqrt(max(solution[3] + (solution[:3] ** 2).sum(), 0))
    return solution[:3] if _HEAD_RADIUS_MM[0] < radius < _HEAD_RADIUS_MM[1] else None


def joint_order(points: dict[str, np.ndarray], anchor: str) -> list[tuple[str, str]]:
    """Structures other than the anchor with their parents, parents first."""
    thin = {name: _thin(p, 3000) for name, p in points.items()}
    trees = {name: KDTree(p) for name, p in thin.items()}

    def gap(a: str, b: str) -> float:
        return float(trees[b].query(thin[a])[0].min())

    def from_anchor(name: str) -> float:
        return float(trees[anchor].query(thin[name].mean(0))[0])

    rank = {"spine": 0, "rib": 1, "other": 1, "girdle": 3, "limb": 5}

    def order(name: str) -> tuple[float, float]:
        extra = 1 if any(word in name.lower() for word in ("scapula", "sternum", "fibula")) else 0
        return rank[bone_kind(name)] + extra, from_anchor(name)

    placed, result = [anchor], []
    for name in sorted((n for n in points if n != anchor), key=order):
        wanted = next((v for k, v in _PARENT_WORDS.items() if k in name.lower()), ())
        if bone_kind(name) == "spine":
            candidates = [n for n in placed if n == anchor or bone_kind(n) == "spine"]
        else:
            candidates = [anchor]
            for word in wanted:
                found = [n for n in placed if word in n.lower() and gap(n, name) < 30]
                if found:
                    candidates = found
                    break
        result.append((name, min(candidates, key=lambda n: gap(name, n))))
        placed.append(name)
    return result


def nearest_of(points: dict[str, np.ndarray], name: str, others: Sequence[str]) -> str:
    """The one of other structures that is nearest to a structure; points: {structure: voxel centres (N, 3)}."""
    tree = KDTree(_thin(points[name], _MAX_POINTS))
    return min(others, key=lambda other: float(tree.query(_thin(points[other], _MAX_POINTS))[0].min()))


def _turn(kind: str, rng: np.random.Generator) -> np.ndarray:
    """A random rotation vector (3,) in radians of the size that fits the kind of bone."""
    axis = rng.normal(size=3) * AXIS_WEIGHTS[kind]
    return np.radians(rng.uniform(*ROTATION_RANGE_DEG[kind])) * axis / np.linalg.norm(axis)


def _spine_turns(count: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Rotation vectors at each joint along a bending spine, from the anchor outwards."""
    if count == 0:
        return []
    low, high = ROTATION_RANGE_DEG["spine"]
    total = np.radians(rng.uniform(low + (high - low) / 2 if count > 1 else low, high))
    axis = rng.normal(size=3) * AXIS_WEIGHTS["spine"]
    axis /= np.linalg.norm(axis)
    first = np.radians(low) if count > 1 else total
    steps = [first] + [(total - first) / max(count - 1, 1)] * (count - 1)
    jitter = rng.normal(0, 0.05, (count, 3))
    return [
        step * (axis + wobble) / np.linalg.norm(axis + wobble)
        for step, wobble in zip(steps, jitter, strict=True)
    ]


def _thin(points: np.ndarray, count: int) -> np.ndarray:
    """At most about count of the points, evenly spread over the list."""
    return points[:: max(1, len(points) // count)]


class _LabelSampler:
    """Nearest label of moving points."""

    def __init__(self, structures: Structures, affine: np.ndarray) -> None:
        """Keep the label map and the map from LPS mm to its indices."""
        self.structures = structures
        self.to_index = np.linalg.inv(affine)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Labels (N,) at LPS points (N, 3); 0 outside the grid."""
        labels = self.structures.labels
        kji = np.rint(apply(self.to_index, points)[:, ::-1]).astype(np.int64)
        inside = np.all((kji >= 0) & (kji < labels.shape), axis=1)
        found = np.zeros(len(points), labels.dtype)
        found[inside] = labels[tuple(kji[inside].T)]
        return found

    def overlap(self, bone: np.ndarray, motion: np.ndarray, placed: dict[str, np.ndarray]) -> float:
        """Share of a bone's points (N, 3) that, once moved, lie inside any bone already placed."""
        moved = apply(motion, bone)
        hit = np.zeros(len(bone), bool)
        for other, other_motion in placed.items():
            number = self.structures.names.index(other) + 1
            hit |= self.at(apply(np.linalg.inv(other_motion), moved)) == number
        return float(hit.mean())
