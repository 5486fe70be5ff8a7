"""Angles and translations of a joint by a convention, with their 95 % intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.kinematics.angles import Rotations, taken_apart, unwrapped_deg
from PolyPoseLib.kinematics.conventions import Convention
from PolyPoseLib.kinematics.relative_motion import RelativeMotion

FACTOR_95 = 1.959963984540054
"""Standard deviations of half the 95 % interval of a normal distribution."""

WIDEST_DEG = 180.0
"""Half width of an interval of an angle of which nothing is known."""


@dataclass(frozen=True, eq=False)
class JointCoordinates:
    """Angles (F, 3) deg and translations (F, 3) mm with half widths of their intervals, and where angles are locked."""

    angles_deg: np.ndarray
    translations_mm: np.ndarray
    angles_95_deg: np.ndarray
    translations_95_mm: np.ndarray
    locked: np.ndarray


def joint_coordinates(motion: RelativeMotion, convention: Convention) -> JointCoordinates:
    """Describe a relative motion by a convention.

    Parameters
    ----------
    motion : RelativeMotion
        Of F frames.
    convention : Convention
        Sequence, signs, and axes of translations.

    Returns
    -------
    JointCoordinates
        Angles are unwrapped over time. Intervals are first order; those of the first and the third angle grow without
        bound toward gimbal lock, and end at WIDEST_DEG.

    """
    rotations = taken_apart(motion.poses[:, :3, :3], convention.sequence)
    origins = motion.poses[:, :3, 3]
    signs = np.array(convention.angle_signs)
    angles = np.degrees(rotations.angles) * signs
    angles = np.stack([unwrapped_deg(column) for column in angles.T], axis=-1)
    translations = origins
    if convention.along_joint:
        translations = np.einsum("fij,fj->fi", rotations.axes, origins)
    translations = translations * np.array(convention.translation_signs)
    per_angle = _inverse_of_axes(rotations)
    half_angles = np.degrees(_half_widths(per_angle, motion.covariances[:, :3, :3]))
    per_shift = _shift_derivatives(rotations, per_angle, origins, convention.along_joint)
    return JointCoordinates(
        angles,
        translations,
        np.minimum(half_angles, WIDEST_DEG),
        _half_widths(per_shift, motion.covariances),
        rotations.locked,
    )


def _inverse_of_axes(rotations: Rotations) -> np.ndarray:
    """(F, 3, 3) derivatives of the angles by a small rotation vector in the proximal bone's axes.

    A rotation vector is the sum of the angles' changes times their axes e1, e2, e3. Of these, e2 is perpendicular to
    both others: the inverse is in closed form, and finite at gimbal lock only for e2.
    """
    first, second, third = np.moveaxis(rotations.axes, 1, 0)
    volume = np.einsum("fi,fi->f", first, np.cross(second, third))[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.stack([np.cross(second, third) / volume, second, np.cross(first, second) / volume], axis=1)


def _shift_derivatives(
    rotations: Rotations, per_angle: np.ndarray, origins: np.ndarray, along_joint: bool
) -> np.ndarray:
    """(F, 3, 6) derivatives of the translations by [rotation, shift of the distal origin]."""
    slopes = np.zeros((len(origins), 3, 6))
    if not along_joint:
        slopes[:, :, 3:] = np.eye(3)
        return slopes
    first, second, third = np.moveaxis(rotations.axes, 1, 0)
    slopes[:, :, 3:] = rotations.axes
    # The floating axis is turned by the first angle about the first axis; the third axis moves with the distal bone.
    turned = np.einsum("fi,fi->f", np.cross(first, second), origins)
    slopes[:, 1, :3] = turned[:, None] * per_angle[:, 0]
    slopes[:, 2, :3] = np.cross(third, origins)
    return slopes


def _half_widths(jacobian: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """(F, N) half widths of 95 % intervals."""
    known = np.all(np.isfinite(covariances), axis=(1, 2))
    with np.errstate(invalid="ignore", over="ignore"):
        variances = np.einsum("fij,fjk,fik->fi", jacobian, covariances, jacobian)
        # Infinite slopes at gimbal lock leave no number, and an interval without an end.
        variances[known[:, None] & np.isnan(variances)] = np.inf
        return FACTOR_95 * np.sqrt(np.maximum(variances, 0.0))
