"""Finite helical axes: any rigid motion is a rotation about one axis and a translation along it.

References
----------
C. Spoor and F. Veldpaus, "Rigid body motion calculated from spatial co-ordinates of markers", J. Biomech. 13 (1980)
391-393.
H. Woltring et al., "Finite centroid and helical axis estimation from noisy landmark measurements in the study of human
joint kinematics", J. Biomech. 18 (1985) 379-389: the axis of a small rotation is uncertain in proportion to 1 over it.

"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.joint_motion import HelicalAxes
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.kinematics.joint_coordinates import FACTOR_95
from PolyPoseLib.kinematics.relative_motion import RelativeMotion, skews

LEAST_TURN_DEG = 1.0
"""Smaller rotations have no axis that means anything: its place is uncertain by more than 50 times the poses' error."""

_STEP = 1e-5
"""rad and mm, by which derivatives are taken."""


def helical_axes(motion: RelativeMotion, before: np.ndarray) -> HelicalAxes:
    """Finite helical axes of the motions from one frame to another.

    Parameters
    ----------
    motion : RelativeMotion
        Of F frames.
    before : (F,) ndarray
        For every frame the index of the one from which its motion is counted.

    Returns
    -------
    HelicalAxes
        In the proximal bone's axes. The motion of a frame from itself is none: its angle and shift are 0, without an
        error. Direction and point are NaN where the rotation is below LEAST_TURN_DEG. The poses' errors of both frames
        count as independent.

    """
    start = motion.poses[before]
    moves = motion.poses @ rigid_inverse(start)
    origins = start[:, :3, 3]
    values = _parameters(moves, origins)
    slopes = _slopes(moves, origins)
    spread = np.einsum("fij,fjk,flk->fil", slopes, _covariances(motion, moves, before), slopes)
    same = np.asarray(before) == np.arange(len(moves))
    known = np.isfinite(moves).all(axis=(1, 2))
    for each in (values, spread):
        each[same & known] = 0.0
    with np.errstate(invalid="ignore"):
        short = values[:, 0] < np.radians(LEAST_TURN_DEG)
    values[short, 2:] = np.nan
    spread[short, 2:] = np.nan
    return HelicalAxes(
        np.degrees(values[:, 0]),
        values[:, 1],
        values[:, 2:5],
        values[:, 5:],
        np.degrees(FACTOR_95 * np.sqrt(spread[:, 0, 0])),
        FACTOR_95 * np.sqrt(spread[:, 1, 1]),
        np.degrees(_widest(spread[:, 2:5, 2:5])),
        _widest(spread[:, 5:, 5:], across=values[:, 2:5]),
    )


def _parameters(moves: np.ndarray, origins: np.ndarray) -> np.ndarray:
    """(F, 8): angle rad, shift mm, direction, and the axis's point nearest to the origins (F, 3)."""
    out = np.full((len(moves), 8), np.nan)
    known = np.isfinite(moves).all(axis=(1, 2))
    if not known.any():
        return out
    rotation, origin = moves[known, :3, :3], origins[known]
    vector = Rotation.from_matrix(rotation).as_rotvec()
    angle = np.linalg.norm(vector, axis=1)
    direction = vector / np.maximum(angle, 1e-300)[:, None]
    # Seen from the origin, so that the point comes out nearest to it.
    step = moves[known, :3, 3] + np.einsum("fij,fj->fi", rotation, origin) - origin
    shift = np.einsum("fi,fi->f", direction, step)
    across = step - shift[:, None] * direction
    with np.errstate(divide="ignore", invalid="ignore"):
        point = origin + (across + np.cross(direction, across) / np.tan(angle / 2)[:, None]) / 2
    out[known] = np.concatenate([angle[:, None], shift[:, None], direction, point], axis=1)
    return out


def _slopes(moves: np.ndarray, origins: np.ndarray) -> np.ndarray:
    """(F, 8, 6) derivatives of the parameters by a perturbation on the left of the moves, about the axes' origin."""
    slopes = np.empty((len(moves), 8, 6))
    for axis in range(6):
        delta = np.zeros(6)
        delta[axis] = _STEP
        ends = []
        for sign in (1.0, -1.0):
            nudge = np.eye(4)
            nudge[:3, :3] = Rotation.from_rotvec(sign * delta[:3]).as_matrix()
            nudge[:3, 3] = sign * delta[3:]
            ends.append(_parameters(nudge @ moves, origins))
        slopes[:, :, axis] = (ends[0] - ends[1]) / (2 * _STEP)
    return slopes


def _covariances(motion: RelativeMotion, moves: np.ndarray, before: np.ndarray) -> np.ndarray:
    """(F, 6, 6) of the moves, as perturbations on their left about the axes' origin."""
    about_origin = _about_origin(motion)
    through = np.zeros((len(moves), 6, 6))
    through[:, :3, :3] = through[:, 3:, 3:] = moves[:, :3, :3]
    through[:, 3:, :3] = skews(moves[:, :3, 3]) @ moves[:, :3, :3]
    return about_origin + through @ about_origin[before] @ np.swapaxes(through, -1, -2)


def _about_origin(motion: RelativeMotion) -> np.ndarray:
    """Covariances of [rotation, translation] about the axes' origin instead of the distal bone's."""
    moved = np.tile(np.eye(6), (len(motion.poses), 1, 1))
    moved[:, 3:, :3] = skews(motion.poses[:, :3, 3])
    return moved @ motion.covariances @ np.swapaxes(moved, -1, -2)


def _widest(covariances: np.ndarray, across: np.ndarray | None = None) -> np.ndarray:
    """(F,) half widths of 95 % intervals along the least certain direction, across vectors (F, 3) if given."""
    if across is not None:
        flat = np.eye(3) - across[:, :, None] * across[:, None, :]
        covariances = flat @ covariances @ flat
    out = np.full(len(covariances), np.nan)
    known = np.isfinite(covariances).all(axis=(1, 2))
    out[known] = FACTOR_95 * np.sqrt(np.linalg.eigvalsh(covariances[known])[:, -1].clip(min=0))
    return out
