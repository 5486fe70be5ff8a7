"""Small rigid motions in numpy, as the solver perturbs poses with them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError

RIGID_TOLERANCE = 1e-4
"""Largest entry of |R R^T - I| that is taken for rounding (four decimals in a JSON file) and corrected."""

MAX_TRANSLATION_MM = 1e7
"""Farther translations are taken for a wrong unit; with much farther ones the arithmetic overflows."""


def perturbation(delta: np.ndarray) -> np.ndarray:
    """(4, 4) motion that rotates by the vector delta[:3] (rad) and then shifts by delta[3:] (mm)."""
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
    sines = twist[..., (2, 0, 1), (1, 2, 0)] / 2
    cosine = (rotations[..., 0, 0] + rotations[..., 1, 1] + rotations[..., 2, 2] - 1) / 2
    if (cosine <= 0).any():
        return Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_rotvec().reshape(sines.shape)
    sine = np.sqrt((sines * sines).sum(axis=-1))
    return sines / np.sinc(np.arctan2(sine, cosine) / np.pi)[..., None]


def about(motion: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """The same motion carried out about ``centre`` (3,) mm instead of the origin."""
    moved = motion.copy()
    moved[:3, 3] += centre - motion[:3, :3] @ centre
    return moved


def orthonormalised(poses: np.ndarray) -> np.ndarray:
    """Rigid motions (..., 4, 4) with the nearest rotations: products of many drift away from them by rounding."""
    nearest = np.array(poses, dtype=np.float64)
    left, _, right = np.linalg.svd(nearest[..., :3, :3])
    nearest[..., :3, :3] = left @ right
    return nearest


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


def is_real_number(value: Any) -> bool:
    """Whether a value is one finite real number that float64 can hold; truth values and texts are none."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def real_array(value: ArrayLike) -> np.ndarray:
    """A float64 copy of an array or of nested lists of numbers; raises ValueError for anything else inside.

    NumPy by itself takes "3" and true for numbers. Whole numbers beyond float64 become infinite.
    """
    array = np.asarray(value) if hasattr(value, "__array__") else np.array(value, dtype=object)
    if array.dtype.kind in "fiu":
        return np.array(array, dtype=np.float64)
    numbers = [_as_float(item) for item in array.ravel().tolist()]
    return np.array(numbers, dtype=np.float64).reshape(array.shape)


def _as_float(value: Any) -> float:
    """One number of a list; raises ValueError when it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise ValueError("not a number")
    try:
        return float(value)
    except OverflowError:
        return math.inf


def require_rigid(matrix: ArrayLike, where: str = "extrinsic") -> np.ndarray:
    """Check that a matrix is a rigid motion and return it in float64 with an exactly orthonormal rotation.

    Parameters
    ----------
    matrix : (4, 4) array_like
        A rotation, a translation in mm in the last column, and the last row 0 0 0 1.
    where : str
        What the matrix is, for the message (file and field, for example).

    Returns
    -------
    (4, 4) array of float64
        A rotation within RIGID_TOLERANCE of orthonormal is replaced by the nearest rotation (polar decomposition;
        Higham, "Computing the polar decomposition", SIAM J. Sci. Stat. Comput. 1986).

    Raises
    ------
    InputError
        Wrong shape, not finite, wrong last row, not orthonormal, a reflection, or farther than
        MAX_TRANSLATION_MM.

    """
    try:
        rigid = real_array(matrix)
    except (TypeError, ValueError):
        raise InputError(f"{where} is not a table of numbers; give 4 rows of 4 numbers.") from None
    if rigid.shape != (4, 4):
        raise InputError(f"{where} has shape {rigid.shape}; give a 4x4 matrix, 4 rows of 4 numbers.")
    if not np.isfinite(rigid).all():
        raise InputError(f"{where} holds NaN or infinity; give finite numbers.")
    if not np.allclose(rigid[3], (0, 0, 0, 1), rtol=0, atol=1e-9):
        raise InputError(f"{where} has the last row {rigid[3].tolist()}; it must be 0 0 0 1.")
    if np.abs(rigid[:3, 3]).max() > MAX_TRANSLATION_MM:
        raise InputError(
            f"{where} has a translation beyond {MAX_TRANSLATION_MM / 1e6:g} km; give it in millimetres."
        )
    rotation = rigid[:3, :3]
    deviation = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if deviation > RIGID_TOLERANCE:
        raise InputError(
            f"{where} is not rigid: R R^T differs from the identity by {deviation:.3g}; its upper left 3x3 "
            "must be orthonormal, without scaling or shear."
        )
    if np.linalg.det(rotation) < 0:
        raise InputError(
            f"{where} is a reflection (det R = -1); flip one axis so that det R = +1: camera x along the "
            "columns, y down the rows, z from the source to the detector."
        )
    if deviation > 1e-12:
        left, _, right = np.linalg.svd(rotation)
        rigid[:3, :3] = left @ right
    rigid[3] = (0, 0, 0, 1)
    return rigid


def require_pose(matrix: ArrayLike, where: str = "extrinsic") -> np.ndarray:
    """Check a rigid motion that may come without its last row, as OpenCV and xreg write extrinsics.

    Parameters
    ----------
    matrix : (3, 4) or (4, 4) array_like
        A rotation and a translation in mm, and perhaps the last row 0 0 0 1.
    where : str
        What the matrix is, for the message.

    Returns
    -------
    (4, 4) array of float64
        As `require_rigid`.

    Raises
    ------
    InputError
        As `require_rigid`.

    """
    try:
        rows = real_array(matrix)
    except (TypeError, ValueError):
        rows = np.empty(0)
    return require_rigid(np.vstack([rows, (0, 0, 0, 1)]) if rows.shape == (3, 4) else matrix, where)


def rigid_inverse(matrix: ArrayLike) -> np.ndarray:
    """Invert rigid motions by transposing their rotations: [R, t] becomes [R^T, -R^T t].

    Parameters
    ----------
    matrix : (..., 4, 4) array_like
        Rigid motions.

    Returns
    -------
    (..., 4, 4) array of float64
        Their inverses.

    """
    rigid = np.asarray(matrix, dtype=np.float64)
    inverse = np.zeros_like(rigid)
    rotation = np.swapaxes(rigid[..., :3, :3], -1, -2)
    inverse[..., :3, :3] = rotation
    inverse[..., :3, 3] = -(rotation @ rigid[..., :3, 3:])[..., 0]
    inverse[..., 3, 3] = 1
    return inverse
