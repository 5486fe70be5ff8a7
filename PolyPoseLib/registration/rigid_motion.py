"""Small rigid motions in numpy, as the solver perturbs poses with them."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import rigid_inverse


def perturbation(delta: np.ndarray) -> np.ndarray:
    """(4, 4) motion that turns by the vector delta[:3] (rad) and then shifts by delta[3:] (mm)."""
    motion = np.eye(4)
    motion[:3, :3] = rotation_matrix(delta[:3])
    motion[:3, 3] = delta[3:]
    return motion


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """(3, 3) rotation by the vector (3,) rad: Rodrigues' formula, ten times faster than scipy's for a single one."""
    x, y, z = vector.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    first = math.sin(angle) / angle if angle > 1e-8 else 1.0
    half = math.sin(angle / 2) / (angle / 2) if angle > 1e-8 else 1.0
    second = half * half / 2
    return np.array(
        [
            [1 - second * (y * y + z * z), second * x * y - first * z, second * x * z + first * y],
            [second * x * y + first * z, 1 - second * (x * x + z * z), second * y * z - first * x],
            [second * x * z - first * y, second * y * z + first * x, 1 - second * (x * x + y * y)],
        ]
    )


def rotation_vectors(rotations: np.ndarray) -> np.ndarray:
    """(..., 3) rad of rotations (..., 3, 3); faster than scipy's below a right angle, and scipy's beyond."""
    twist = rotations - np.swapaxes(rotations, -1, -2)
    sines = np.stack([twist[..., 2, 1], twist[..., 0, 2], twist[..., 1, 0]], axis=-1) / 2
    cosine = (np.trace(rotations, axis1=-2, axis2=-1) - 1) / 2
    if (cosine <= 0).any():
        return Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec().reshape(sines.shape)
    sine = np.sqrt((sines * sines).sum(axis=-1))
    return sines / np.sinc(np.arctan2(sine, cosine) / np.pi)[..., None]


def about(motion: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """The same motion carried out about ``centre`` (3,) mm instead of the origin."""
    moved = motion.copy()
    moved[:3, 3] += centre - motion[:3, :3] @ centre
    return moved


def perturbation_between(first: np.ndarray, second: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(6,) the perturbation, on the left and about ``centre`` (3,) mm, that leads from one pose (4, 4) to another."""
    motion = second @ rigid_inverse(first)
    return np.r_[rotation_vectors(motion[:3, :3]), motion[:3, :3] @ centre + motion[:3, 3] - centre]


def skew(vector: np.ndarray) -> np.ndarray:
    """(3, 3) matrix of the cross product by ``vector``."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def adjoint_of_correction(pose: np.ndarray, centre: np.ndarray, camera_centre: np.ndarray) -> np.ndarray:
    """(6, 6) matrix from a camera's correction (about ``camera_centre``, fixed mm) to the pose's perturbation.

    Moving the fixed points before the pose is applied is the same as perturbing the pose on its left by this much
    about the body's ``centre`` (moving mm).
    """
    rotation = pose[:3, :3]
    lever = centre - (rotation @ camera_centre + pose[:3, 3])
    spread = np.zeros((6, 6))
    spread[:3, :3] = rotation
    spread[3:, :3] = -skew(lever) @ rotation
    spread[3:, 3:] = rotation
    return spread


def rotation_angle_deg(rotation: np.ndarray) -> float:
    """Angle of a (3, 3) rotation in degrees."""
    return float(np.degrees(Rotation.from_matrix(rotation).magnitude()))
