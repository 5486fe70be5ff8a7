"""The axes of both bones of a joint: from landmarks where these suffice, else from inertia, and which of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.tracking.joint_motion import BoneAxes
from PolyPoseLib.data.tracking.joints import Joint, side_of
from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.kinematics.inertia_axes import inertia_axes
from PolyPoseLib.kinematics.landmark_axes import (
    GIVEN,
    HIP_CENTER,
    LANDMARK_NAMES,
    NEUTRAL,
    RECIPES,
    BoneLandmarks,
    MissingLandmarkError,
    RecipeEntry,
    landmark_axes,
)

OF_THE_LEG = ("grood_suntay", "isb_hip", "isb_ankle")
"""Conventions of joints whose bones' front is the patient's, however a patient lies; arms and heads turn farther."""

BACKWARD = 0.5
"""Share of a bone's front along the patient's posterior axis, beyond which it is the bone's back."""


@dataclass(frozen=True, eq=False)
class JointAxes:
    """The axes of a joint's bones, and what is to be known about them."""

    joint: Joint
    proximal: BoneAxes
    distal: BoneAxes
    warnings: tuple[str, ...]


def joint_axes(sequence: Sequence, joint: Joint) -> JointAxes:
    """The axes of a joint's bones.

    Parameters
    ----------
    sequence : Sequence
        Its CT, structures and landmarks.
    joint : Joint
        Between two of its structures.

    Returns
    -------
    JointAxes
        With a warning where landmarks are given but do not suffice, where axes of inertia stand in for them, and where
        the side is not that of the bones' names or landmarks.

    Raises
    ------
    InputError
        The landmarks of a bone coincide or lie on a line.

    """
    warnings = _odd_side(joint)
    first, second = RECIPES[joint.convention]
    near, far = (landmarks_of(sequence.landmarks, bone) for bone in (joint.proximal, joint.distal))
    if joint.convention == "isb_hip" and HIP_CENTER in far:
        near = {HIP_CENTER: far[HIP_CENTER], **near}
    proximal = _from_landmarks(near, first, joint, joint.proximal, warnings)
    distal = _from_landmarks(far, second, joint, joint.distal, warnings)
    warnings += _odd_fronts(joint, proximal, distal)
    if proximal is None:
        proximal = inertia_axes(_points(sequence, joint.proximal), joint.side)
    if distal is None:
        distal = inertia_axes(_points(sequence, joint.distal), joint.side)
        if joint.convention in NEUTRAL and proximal.source == "landmarks":
            distal = _neutral(proximal, distal, joint)
    if joint.convention != "generic" and "inertia" in (proximal.source, distal.source):
        those = " and ".join(
            f'"{bone}"'
            for bone, axes in ((joint.proximal, proximal), (joint.distal, distal))
            if axes.source == "inertia"
        )
        warnings.append(
            f'Joint "{joint.name}": the axes of {those} are those of inertia, so that changes of the angles have a '
            "meaning, but not their zero: give landmarks for that."
        )
    return JointAxes(joint, proximal, distal, tuple(warnings))


def _odd_side(joint: Joint) -> list[str]:
    """A warning where a joint's side is not that of its bones' names: signs would be those of the other side."""
    return [
        f'Joint "{joint.name}": its side is "{joint.side}", and its bone "{bone}" is named after the other: check '
        '"side".'
        for bone in (joint.proximal, joint.distal)
        if "none" not in (joint.side, side_of(bone)) and side_of(bone) != joint.side
    ]


def _odd_fronts(joint: Joint, *axes: BoneAxes | None) -> list[str]:
    """A warning where the front of a leg's bone is the patient's back: its landmarks are of the other side."""
    if joint.convention not in OF_THE_LEG or not any(each and each.matrix[1, 0] > BACKWARD for each in axes):
        return []
    return [
        f'Joint "{joint.name}": by its landmarks and its side, "{joint.side}", the front of a bone points to the '
        'patient\'s back, so that signs are wrong: check "side", and left and right of the landmarks.'
    ]


def landmarks_of(landmarks: Mapping[str, np.ndarray], bone: str) -> dict[str, np.ndarray]:
    """The landmarks of one bone by their short names: of "femur_left.hip_center", "hip_center"."""
    return {
        name[len(bone) + 1 :]: point
        for name, point in landmarks.items()
        if name.startswith(f"{bone}.") and "." not in name[len(bone) + 1 :]
    }


def require_known_landmarks(sequence: Sequence) -> None:
    """Raise InputError for a landmark of no structure, or with a name that no definition of axes asks for."""
    for name in sequence.landmarks:
        bone, _, short = name.rpartition(".")
        if not bone:
            raise InputError(
                f'The landmark "{name}" has no bone: name it after its structure, as "femur_left.hip_center".'
            )
        if bone not in sequence.structures.names:
            raise InputError(
                f'The landmark "{name}": ' + unknown_name("structure", bone, sequence.structures.names)
            )
        if short not in LANDMARK_NAMES:
            raise InputError(
                f'The landmark "{name}": ' + unknown_name("name of a landmark", short, LANDMARK_NAMES)
            )


def _from_landmarks(
    points: Mapping[str, np.ndarray],
    entries: tuple[RecipeEntry, ...],
    joint: Joint,
    bone: str,
    warnings: list[str],
) -> BoneAxes | None:
    """Axes by the first recipe whose landmarks are all given; else None, with a warning where some of them are."""
    landmarks = BoneLandmarks(points, joint.side)
    lacking = ""
    for entry in (GIVEN, *entries):
        try:
            return landmark_axes(entry.recipe(landmarks), joint.side, bone)
        except MissingLandmarkError as missing:
            own = [name for name in entry.landmarks if name in points]
            if own and own != [HIP_CENTER] and not lacking:
                lacking = str(missing)
    if lacking:
        warnings.append(
            f'Joint "{joint.name}": the landmark "{bone}.{lacking}" is missing, so that the others of "{bone}" are '
            "not used: add it."
        )
    return None


def _neutral(proximal: BoneAxes, own: BoneAxes, joint: Joint) -> BoneAxes:
    """The proximal bone's axes for the distal one, with the origin that the convention has."""
    matrix = proximal.matrix.copy()
    if joint.convention == "isb_wrist":
        matrix[:3, 3] = own.matrix[:3, 3]
    return BoneAxes(matrix, "neutral")


def _points(sequence: Sequence, bone: str) -> np.ndarray:
    """(N, 3) centres of a structure's voxels, LPS mm."""
    number = sequence.structures.index(bone) + 1
    box = find_objects(sequence.structures.labels, max_label=number)[number - 1]
    corner = np.array([part.start for part in box])
    index = np.argwhere(sequence.structures.labels[box] == number) + corner
    return sequence.ct.to_world(index[:, ::-1])
