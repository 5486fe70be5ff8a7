"""The pose of one bone in the axes of another, and how uncertain it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.rigid import rigid_inverse


@dataclass(frozen=True, eq=False)
class BonePoses:
    """One bone over F frames.

    Parameters
    ----------
    poses : (F, 4, 4) ndarray
        The rig's world (fixed) to the CT's LPS mm (moving).
    covariances : (F, 6, 6) ndarray
        Of [rotation (rad), translation (mm)], a perturbation on the left of the pose about the centroid.
    centroid : (3,) ndarray
        In the CT, LPS mm.
    axes : (4, 4) ndarray
        From the bone's axes to the CT's LPS mm; left-handed ones are allowed.

    """

    poses: np.ndarray
    covariances: np.ndarray
    centroid: np.ndarray
    axes: np.ndarray


@dataclass(frozen=True, eq=False)
class RelativeMotion:
    """The distal bone's axes in the proximal bone's.

    Parameters
    ----------
    poses : (F, 4, 4) ndarray
        From the distal bone's axes to the proximal bone's, mm.
    covariances : (F, 6, 6) ndarray
        Of [rotation (rad), translation of the distal bone's origin (mm)], in the proximal bone's axes.

    """

    poses: np.ndarray
    covariances: np.ndarray


def relative_motion(proximal: BonePoses, distal: BonePoses) -> RelativeMotion:
    """The motion of one bone in the axes of another.

    The errors of both bones count as independent, and as small: covariances are propagated to first order.

    Parameters
    ----------
    proximal, distal : BonePoses
        Of the same F frames; axes of both are right-handed, or of both left-handed.

    Returns
    -------
    RelativeMotion
        NaN where a pose is.

    """
    to_proximal, to_distal = rigid_inverse(proximal.axes), rigid_inverse(distal.axes)
    poses = to_proximal @ proximal.poses @ rigid_inverse(distal.poses) @ distal.axes
    rotations, origins = poses[:, :3, :3], poses[:, :3, 3]
    # A perturbation of the proximal bone moves the distal one about the proximal centroid; one of the distal bone
    # moves the world the other way about the distal centroid, as seen from that bone.
    turn_p, shift_p = _in_axes(proximal.axes)
    turn_d, shift_d = _in_axes(distal.axes)
    centre_p = to_proximal[:3, :3] @ proximal.centroid + to_proximal[:3, 3]
    centre_d = to_distal[:3, :3] @ distal.centroid + to_distal[:3, 3]
    from_proximal = np.zeros((len(poses), 6, 6))
    from_proximal[:, :3, :3] = turn_p
    from_proximal[:, 3:, :3] = -skews(origins - centre_p) @ turn_p
    from_proximal[:, 3:, 3:] = shift_p
    from_distal = np.zeros((len(poses), 6, 6))
    from_distal[:, :3, :3] = -rotations @ turn_d
    from_distal[:, 3:, :3] = -rotations @ skews(centre_d[None]) @ turn_d
    from_distal[:, 3:, 3:] = -rotations @ shift_d
    covariances = _carried(from_proximal, proximal.covariances) + _carried(from_distal, distal.covariances)
    return RelativeMotion(poses, covariances)


def _in_axes(axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (3, 3) that take rotation vectors and shifts of the CT to a bone's axes.

    Rotation vectors change their sign besides in left-handed axes, where a right turn is a left one.
    """
    shift = axes[:3, :3].T
    return np.sign(np.linalg.det(shift)) * shift, shift


def skews(vectors: np.ndarray) -> np.ndarray:
    """(F, 3, 3) matrices of the cross products by vectors (F, 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)


def _carried(jacobian: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    return jacobian @ covariances @ np.swapaxes(jacobian, -1, -2)
