"""Angles of three rotations that follow each other, the axes about which they turn, and gimbal lock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LOCK_DEG = 5.0
"""Within this of gimbal lock, the first and the third angle are flagged: errors of each grow more than tenfold."""

_EXACT = 1e-7
"""Sine of the distance from gimbal lock below which rounding alone decides about the first and the third angle."""


@dataclass(frozen=True, eq=False)
class Rotations:
    """F rotations taken apart.

    Parameters
    ----------
    angles : (F, 3) ndarray
        rad, in the order of the sequence. The second one is from -pi/2 to pi/2 for "zxy", from -pi to 0 for "yxy".
    axes : (F, 3, 3) ndarray
        Rows: unit vectors about which the three angles turn, in the proximal bone's axes.
    locked : (F,) ndarray
        bool: within LOCK_DEG of gimbal lock.

    """

    angles: np.ndarray
    axes: np.ndarray
    locked: np.ndarray


def taken_apart(rotations: np.ndarray, sequence: str) -> Rotations:
    """Angles of rotations about axes that move along.

    At gimbal lock itself, the third angle ("zxy") or the first one ("yxy") keeps the value of the frame before.

    Parameters
    ----------
    rotations : (F, 3, 3) ndarray
        From the distal bone's axes to the proximal bone's; NaN where there is none.
    sequence : {"zxy", "yxy"}
        Axes, each moved along by the rotations before it: R = Rz(a) Rx(b) Ry(c), or R = Ry(a) Rx(b) Ry(c).

    Returns
    -------
    Rotations
        NaN, and not locked, where a rotation is.

    Raises
    ------
    ValueError
        Another sequence.

    """
    if sequence not in ("zxy", "yxy"):
        raise ValueError(f'the sequence is "{sequence}": give "zxy" or "yxy"')
    r = np.asarray(rotations, dtype=np.float64)
    cardan = sequence == "zxy"
    if cardan:
        apart = np.hypot(r[:, 2, 0], r[:, 2, 2])
        second = np.arctan2(r[:, 2, 1], apart)
        first = np.arctan2(-r[:, 0, 1], r[:, 1, 1])
        third = np.arctan2(-r[:, 2, 0], r[:, 2, 2])
    else:
        apart = np.hypot(r[:, 0, 1], r[:, 2, 1])
        second = np.arctan2(-apart, r[:, 1, 1])
        first = np.arctan2(-r[:, 0, 1], -r[:, 2, 1])
        third = np.arctan2(-r[:, 1, 0], r[:, 1, 2])
    for f in np.flatnonzero(apart < _EXACT):
        known = np.flatnonzero(np.isfinite(apart[:f]))
        if cardan:
            third[f] = third[known[-1]] if known.size else 0.0
            left = r[f] @ _about_y(third[f]).T
            first[f] = np.arctan2(left[1, 0], left[0, 0])
        else:
            first[f] = first[known[-1]] if known.size else 0.0
            left = _about_y(first[f]).T @ r[f]
            third[f] = np.arctan2(left[0, 2], left[0, 0])
    cos, sin, zero = np.cos(first), np.sin(first), 0.0 * first
    unit = 1.0 + zero
    axes = np.stack(
        [
            np.stack([zero, zero, unit] if cardan else [zero, unit, zero], axis=-1),
            np.stack([cos, sin, zero] if cardan else [cos, zero, -sin], axis=-1),
            r[:, :, 1],
        ],
        axis=1,
    )
    with np.errstate(invalid="ignore"):
        locked = apart < np.sin(np.radians(LOCK_DEG))
    return Rotations(np.stack([first, second, third], axis=-1), axes, locked)


def unwrapped_deg(degrees: np.ndarray) -> np.ndarray:
    """Angles (F,) without jumps of a whole turn from one known frame to the next; NaN stays."""
    smooth = degrees.copy()
    known = np.isfinite(degrees)
    smooth[known] = np.unwrap(degrees[known], period=360.0)
    return smooth


def _about_y(angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
