"""Small rigid motions in numpy, as the solver perturbs poses with them."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def perturbation(delta: np.ndarray) -> np.ndarray:
    """(4, 4) motion that turns by the vector delta[:3] (rad) and then shifts by delta[3:] (mm)."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(delta[:3]).as_matrix()
    motion[:3, 3] = delta[3:]
    return motion


def about(motion: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """The same motion carried out about ``centre`` (3,) mm instead of the origin."""
    moved = motion.copy()
    moved[:3, 3] += centre - motion[:3, :3] @ centre
    return moved


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
