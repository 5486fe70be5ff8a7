"""Axes of bones from landmarks of the CT, as Grood and Suntay (1983) and the ISB (Wu et al. 2002 and 2005) define them.

Each recipe gives an origin, one axis exactly, and a second direction that with it spans a plane; the third axis is
perpendicular to that plane. Directions are anatomical (to the side, not to the right), so that a recipe serves both
sides of the body.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.tracking.joint_motion import BoneAxes
from PolyPoseLib.errors import InputError

LEAST_SINE = 0.05
"""Of the angle between a recipe's two directions: closer ones (3 degrees) do not tell the plane that they span."""


class MissingLandmarkError(Exception):
    """A recipe needs a landmark that is not given; its text is the landmark's name."""


class BoneLandmarks:
    """The landmarks of one bone, by their short names.

    Parameters
    ----------
    points : mapping of str to (3,) array
        LPS mm.
    side : {"left", "right", "none"}
        Of the joint.

    """

    def __init__(self, points: Mapping[str, np.ndarray], side: str) -> None:
        self._points = points
        self._left = side == "left"

    def __call__(self, name: str) -> np.ndarray:
        """One landmark; raises MissingLandmarkError."""
        if name not in self._points:
            raise MissingLandmarkError(name)
        return np.asarray(self._points[name], dtype=np.float64)

    def has(self, name: str) -> bool:
        """Whether it is given."""
        return name in self._points

    def middle(self, first: str, second: str) -> np.ndarray:
        """Between two landmarks."""
        return (self(first) + self(second)) / 2

    def one_of(self, name: str, first: str, second: str) -> np.ndarray:
        """One landmark where it is given, else the middle of two others."""
        return self(name) if self.has(name) else self.middle(first, second)

    def sideways(self, stem: str) -> np.ndarray:
        """From one of a pair, "left_" and "right_" and the stem, to the other: to the joint's side, or to the right."""
        across = self(f"left_{stem}") - self(f"right_{stem}")
        return across if self._left else -across


@dataclass(frozen=True, eq=False)
class Directions:
    """An origin, an exact axis and a second direction: letters "x", "y" or "z" with vectors (3,) in mm."""

    origin: np.ndarray
    exact: tuple[str, np.ndarray]
    second: tuple[str, np.ndarray]


Recipe = Callable[[BoneLandmarks], Directions]


def given_axes(bone: BoneLandmarks) -> Directions:
    """Any bone: an origin, a point up its y axis, and one on the side of x or z."""
    origin = bone("origin")
    letter = "z" if bone.has("z_side") and not bone.has("x_side") else "x"
    return Directions(origin, ("y", bone("y_axis") - origin), (letter, bone(f"{letter}_side") - origin))


def femur_at_knee(bone: BoneLandmarks) -> Directions:
    """Grood and Suntay: from the knee to the centre of the femoral head; turned like the condyles."""
    origin = bone.one_of("knee_center", "medial_epicondyle", "lateral_epicondyle")
    top = bone("hip_center" if bone.has("hip_center") or not bone.has("shaft_proximal") else "shaft_proximal")
    condyles = ("medial_posterior_condyle", "lateral_posterior_condyle")
    medial, lateral = (
        condyles if all(map(bone.has, condyles)) else ("medial_epicondyle", "lateral_epicondyle")
    )
    return Directions(origin, ("y", top - origin), ("z", bone(lateral) - bone(medial)))


def tibia_at_knee(bone: BoneLandmarks) -> Directions:
    """Grood and Suntay: from the ankle to between the intercondylar eminences; turned like the plateaus."""
    origin = bone.one_of("knee_center", "medial_plateau", "lateral_plateau")
    malleoli = all(map(bone.has, ("medial_malleolus", "lateral_malleolus")))
    if bone.has("shaft_distal") and not malleoli and not bone.has("ankle_center"):
        bottom = bone("shaft_distal")
    else:
        bottom = bone.one_of("ankle_center", "medial_malleolus", "lateral_malleolus")
    return Directions(origin, ("y", origin - bottom), ("z", bone("lateral_plateau") - bone("medial_plateau")))


def pelvis(bone: BoneLandmarks) -> Directions:
    """Wu 2002: z along both anterior superior iliac spines (ASIS), x in their plane with the posterior ones (PSIS)."""
    front = bone.middle("left_asis", "right_asis")
    origin = bone("hip_center") if bone.has("hip_center") else front
    back = bone.middle("left_psis", "right_psis")
    return Directions(origin, ("z", bone.sideways("asis")), ("x", front - back))


def femur_at_hip(bone: BoneLandmarks) -> Directions:
    """Wu 2002: y from the middle of the epicondyles to the centre of the head, z in their plane."""
    origin = bone("hip_center")
    middle = bone.middle("medial_epicondyle", "lateral_epicondyle")
    return Directions(
        origin, ("y", origin - middle), ("z", bone("lateral_epicondyle") - bone("medial_epicondyle"))
    )


def tibia_at_ankle(bone: BoneLandmarks) -> Directions:
    """Wu 2002: z from the medial to the lateral malleolus, y in their plane with the middle of the tibial condyles."""
    origin = bone.middle("medial_malleolus", "lateral_malleolus")
    top = bone.middle("medial_plateau", "lateral_plateau")
    return Directions(
        origin, ("z", bone("lateral_malleolus") - bone("medial_malleolus")), ("y", top - origin)
    )


def vertebra(bone: BoneLandmarks) -> Directions:
    """Wu 2002: y through the middles of both endplates, origin between these; z like the bases of the pedicles."""
    lower, upper = bone("inferior_endplate"), bone("superior_endplate")
    return Directions((lower + upper) / 2, ("y", upper - lower), ("z", bone.sideways("pedicle")))


def thorax(bone: BoneLandmarks) -> Directions:
    """Wu 2005: y from between xiphoid and T8 to between suprasternal notch and C7."""
    origin = bone("suprasternal_notch")
    up = bone.middle("suprasternal_notch", "c7") - bone.middle("xiphoid_process", "t8")
    return Directions(origin, ("y", up), ("x", origin - bone("c7")))


def scapula(bone: BoneLandmarks) -> Directions:
    """Wu 2005: z from the root of the spine to the acromial angle, y in their plane with the inferior angle."""
    origin = bone("acromial_angle")
    return Directions(origin, ("z", origin - bone("trigonum_spinae")), ("y", origin - bone("inferior_angle")))


def humerus(bone: BoneLandmarks) -> Directions:
    """Wu 2005, first definition: y from the middle of the epicondyles to the centre of the head, z in their plane."""
    origin = bone("head_center")
    middle = bone.middle("medial_epicondyle", "lateral_epicondyle")
    return Directions(
        origin, ("y", origin - middle), ("z", bone("lateral_epicondyle") - bone("medial_epicondyle"))
    )


def forearm(bone: BoneLandmarks) -> Directions:
    """Wu 2005: y from the ulnar styloid to the middle of the humeral epicondyles, z in plane with the radial one."""
    origin = bone("ulnar_styloid")
    return Directions(origin, ("y", bone("elbow_center") - origin), ("z", bone("radial_styloid") - origin))


def radius(bone: BoneLandmarks) -> Directions:
    """Wu 2005: y up the shaft from the ridge between both fossae, z in the plane of ridge, radial styloid and notch."""
    origin = bone("articular_ridge")
    up = bone("shaft_proximal") - origin
    styloid, notch = bone("radial_styloid"), bone("sigmoid_notch")
    across = np.cross(np.cross(styloid - origin, notch - origin), up)
    return Directions(origin, ("y", up), ("z", across * np.sign(across @ (styloid - notch))))


def metacarpal(bone: BoneLandmarks) -> Directions:
    """Wu 2005: y from the head to the base, x to the palm; origin between both."""
    head, base = bone("head_center"), bone("base_center")
    middle = (head + base) / 2
    return Directions(middle, ("y", base - head), ("x", bone("palmar_side") - middle))


@dataclass(frozen=True, eq=False)
class RecipeEntry:
    """A recipe, what it is called, and the landmarks that it may ask for."""

    title: str
    recipe: Recipe
    landmarks: tuple[str, ...]


_EPICONDYLES = ("medial_epicondyle", "lateral_epicondyle")
_MALLEOLI = ("medial_malleolus", "lateral_malleolus")
_PLATEAUS = ("medial_plateau", "lateral_plateau")
_CONDYLES = ("medial_posterior_condyle", "lateral_posterior_condyle")

GIVEN = RecipeEntry("axes given", given_axes, ("origin", "y_axis", "x_side", "z_side"))

_HUMERUS = RecipeEntry("humerus", humerus, ("head_center", *_EPICONDYLES))
_VERTEBRA = RecipeEntry(
    "vertebra", vertebra, ("superior_endplate", "inferior_endplate", "left_pedicle", "right_pedicle")
)
_FEMUR_AT_KNEE = ("knee_center", "hip_center", "shaft_proximal", *_EPICONDYLES, *_CONDYLES)
_TIBIA_AT_KNEE = ("knee_center", "ankle_center", "shaft_distal", *_MALLEOLI, *_PLATEAUS)

RECIPES: dict[str, tuple[tuple[RecipeEntry, ...], tuple[RecipeEntry, ...]]] = {
    "grood_suntay": (
        (RecipeEntry("femur", femur_at_knee, _FEMUR_AT_KNEE),),
        (RecipeEntry("tibia", tibia_at_knee, _TIBIA_AT_KNEE),),
    ),
    "isb_hip": (
        (RecipeEntry("pelvis", pelvis, ("hip_center", "left_asis", "right_asis", "left_psis", "right_psis")),),
        (RecipeEntry("femur", femur_at_hip, ("hip_center", *_EPICONDYLES)),),
    ),
    "isb_ankle": ((RecipeEntry("tibia", tibia_at_ankle, (*_MALLEOLI, *_PLATEAUS)),), ()),
    "isb_spine": ((_VERTEBRA,), (_VERTEBRA,)),
    "isb_shoulder": (
        (
            RecipeEntry("scapula", scapula, ("acromial_angle", "trigonum_spinae", "inferior_angle")),
            RecipeEntry("thorax", thorax, ("suprasternal_notch", "xiphoid_process", "c7", "t8")),
        ),
        (_HUMERUS,),
    ),
    "isb_elbow": (
        (_HUMERUS,),
        (RecipeEntry("forearm", forearm, ("ulnar_styloid", "radial_styloid", "elbow_center")),),
    ),
    "isb_wrist": (
        (RecipeEntry("radius", radius, ("articular_ridge", "shaft_proximal", "radial_styloid", "sigmoid_notch")),),
        (RecipeEntry("metacarpal", metacarpal, ("head_center", "base_center", "palmar_side")),),
    ),
    "generic": ((), ()),
}  # fmt: skip
"""Of the proximal and of the distal bone, by convention."""

LANDMARK_NAMES = tuple(
    dict.fromkeys(
        name
        for entry in (GIVEN, *(each for both in RECIPES.values() for side in both for each in side))
        for name in entry.landmarks
    )
)
"""Every short name that a landmark may have."""

NEUTRAL = ("isb_ankle", "isb_wrist")
"""Conventions in which a distal bone without landmarks takes the proximal bone's axes as both lie in the neutral
posture (Wu 2002 for the calcaneus, Wu 2005 for carpal bones)."""

HIP_CENTER = "hip_center"
"""Of the femur, as it lies in the CT, it is the pelvis's origin too, which coincides with it in the neutral posture."""


def landmark_axes(directions: Directions, side: str, bone: str) -> BoneAxes:
    """Axes from a recipe's directions, left-handed for a left joint; raises InputError where these are parallel."""
    letter, along = directions.exact
    other, toward = directions.second
    length, size = float(np.linalg.norm(along)), float(np.linalg.norm(toward))
    exact = along / max(length, 1e-300)
    flat = toward - (toward @ exact) * exact
    if not (length > 1e-6 and size > 1e-6 and np.linalg.norm(flat) >= LEAST_SINE * size):  # NaN fails, too
        raise InputError(
            f'The landmarks of "{bone}" coincide or lie on a line, so that they name no axes: check their coordinates.'
        )
    axes = {letter: exact, other: flat / np.linalg.norm(flat)}
    missing = next(each for each in "xyz" if each not in axes)
    first, second = {"x": "yz", "y": "zx", "z": "xy"}[missing]
    axes[missing] = np.cross(axes[first], axes[second]) * (-1.0 if side == "left" else 1.0)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([axes["x"], axes["y"], axes["z"]], axis=-1)
    matrix[:3, 3] = directions.origin
    return BoneAxes(matrix, "landmarks")
