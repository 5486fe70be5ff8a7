"""What is reported of a joint: angles, translations and helical axes, frame by frame, with their intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.tracking.joints import Joint

SOURCES_OF_AXES = {
    "landmarks": "from landmarks",
    "neutral": "those of the proximal bone as both lie in the CT, whose posture counts as neutral",
    "inertia": "principal axes of inertia",
}
"""Where the axes of a bone come from, and how people are told."""


@dataclass(frozen=True, eq=False)
class BoneAxes:
    """The axes of one bone: x to the front, y to the head, z to the side; to the right where the joint has no side.

    Parameters
    ----------
    matrix : (4, 4) ndarray
        From the axes' coordinates to the CT's LPS, mm: columns x, y, z and origin. Axes of a left joint are
        left-handed, the mirror image of those of a right one.
    source : str
        One of SOURCES_OF_AXES.
    note : str
        What is to be known about them, or "".

    """

    matrix: np.ndarray
    source: str
    note: str = ""


@dataclass(frozen=True)
class Quantity:
    """One angle or translation of a joint.

    Parameters
    ----------
    name : str
        As in headers of tables, such as "flexion".
    positive : str
        What positive values mean, for people.

    """

    name: str
    positive: str


@dataclass(frozen=True, eq=False)
class HelicalAxes:
    """Finite helical axes of F motions, in the axes of the proximal bone; NaN where there is none.

    Parameters
    ----------
    angles_deg, shifts_mm : (F,) ndarray
        Rotation about the axis and translation along it.
    directions : (F, 3) ndarray
        Unit vectors, by which the rotation is positive.
    points_mm : (F, 3) ndarray
        The point of the axis that is nearest to the distal bone's origin before the motion.
    angles_95_deg, shifts_95_mm : (F,) ndarray
        Half widths of the 95 % intervals.
    directions_95_deg, points_95_mm : (F,) ndarray
        The same of the direction, and of the point across the axis, where they are least certain.

    """

    angles_deg: np.ndarray
    shifts_mm: np.ndarray
    directions: np.ndarray
    points_mm: np.ndarray
    angles_95_deg: np.ndarray
    shifts_95_mm: np.ndarray
    directions_95_deg: np.ndarray
    points_95_mm: np.ndarray


@dataclass(frozen=True, eq=False)
class JointMotion:
    """The motion of one joint over F frames.

    Parameters
    ----------
    joint : Joint
        Which.
    proximal_axes, distal_axes : BoneAxes
        Of its bones.
    frames : (F,) ndarray
        Numbers of the frames in the sequence.
    seconds : (F,) ndarray
        Their times.
    angle_quantities, translation_quantities : tuple of Quantity
        Names and signs, three each.
    angles_deg : (F, 3) ndarray
        Unwrapped over time.
    translations_mm : (F, 3) ndarray
        Of the distal bone's origin.
    angles_95_deg, translations_95_mm : (F, 3) ndarray
        Half widths of the 95 % intervals.
    locked : (F,) ndarray
        bool: the first and the third axis of rotation nearly coincide (gimbal lock), which leaves their angles
        undetermined.
    doubtful : (F,) ndarray
        bool: the pose of one of both bones is flagged as uncertain.
    since_first, since_previous : HelicalAxes
        Of the motion from the first frame, and from the frame before.
    warnings : tuple of str
        What is to be known about the axes.

    """

    joint: Joint
    proximal_axes: BoneAxes
    distal_axes: BoneAxes
    frames: np.ndarray
    seconds: np.ndarray
    angle_quantities: tuple[Quantity, ...]
    translation_quantities: tuple[Quantity, ...]
    angles_deg: np.ndarray
    translations_mm: np.ndarray
    angles_95_deg: np.ndarray
    translations_95_mm: np.ndarray
    locked: np.ndarray
    doubtful: np.ndarray
    since_first: HelicalAxes
    since_previous: HelicalAxes
    warnings: tuple[str, ...] = ()
