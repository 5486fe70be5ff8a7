"""Projection matrices (3, 4), taken apart into intrinsics and extrinsic."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import rq

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import FOCAL_RANGE_PX, require_intrinsics
from PolyPoseLib.geometry.rigid import require_rigid

LARGEST_SKEW = 0.01
"""Share of the focal length that rounding may leave as skew."""


def decompose_projection(matrix: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Intrinsics and extrinsic of a projection matrix, whatever its scale and sign.

    An RQ decomposition with positive focal lengths; the sign is chosen so that the rotation is proper.

    Parameters
    ----------
    matrix
        (3, 4), world (mm) to homogeneous pixels, up to a factor.

    Returns
    -------
    intrinsics
        K (3, 3) in pixels.
    extrinsic
        (4, 4) world to camera, mm.

    Raises
    ------
    InputError
        Not a matrix of a camera at a finite place, noticeable skew, or numbers that no camera has.

    References
    ----------
    Hartley and Zisserman, "Multiple View Geometry", 2nd edition, section 6.2.4.

    """
    projection = np.asarray(matrix, dtype=np.float64)
    if projection.shape != (3, 4) or not np.isfinite(projection).all():
        raise InputError("a projection matrix has three rows of four finite numbers.")
    projection = _of_unit_axis(projection)
    determinant = np.linalg.det(projection[:, :3])
    if abs(determinant) < 1e-9:
        raise InputError("its left 3x3 part is singular: this is no camera at a finite place.")
    projection = projection * np.sign(determinant)
    upper, rotation = _rq(projection[:, :3])
    signs = np.diag(np.where(np.diag(upper) < 0, -1.0, 1.0))
    upper, rotation = upper @ signs, signs @ rotation
    translation = np.linalg.solve(upper, projection[:, 3])
    upper = upper / upper[2, 2]
    if abs(upper[0, 1]) > LARGEST_SKEW * upper[0, 0]:
        raise InputError(
            f"its axes are skewed ({upper[0, 1]:.3g} px at a focal length of {upper[0, 0]:.4g} px): check the order of "
            "its numbers."
        )
    upper[1, 0] = upper[2, 0] = upper[2, 1] = 0.0
    extrinsic = np.eye(4)
    extrinsic[:3, :3], extrinsic[:3, 3] = rotation, translation
    return require_intrinsics(upper), require_rigid(extrinsic, "its pose")


def _rq(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Upper triangular and orthogonal factor (3, 3) of a matrix."""
    factors = rq(matrix)
    return np.asarray(factors[0]), np.asarray(factors[1])


def _of_unit_axis(matrix: np.ndarray) -> np.ndarray:
    """A projection matrix (3, 4) scaled so that the axis in its third row has the length 1; raises InputError."""
    largest = np.abs(matrix[2, :3]).max()
    if largest == 0:
        raise InputError("its left 3x3 part is singular: this is no camera at a finite place.")
    with np.errstate(over="ignore"):  # what overflows is refused, here or as a translation
        matrix = matrix / largest
    matrix = matrix / np.linalg.norm(matrix[2, :3])
    if np.abs(matrix[:, :3]).max() > FOCAL_RANGE_PX[1]:
        raise InputError(
            f"its focal lengths are beyond {FOCAL_RANGE_PX[1]:g} px: check its unit and the order of its numbers."
        )
    return matrix


def rows_downward(matrix: np.ndarray, height: int) -> np.ndarray:
    """A projection matrix (3, 4) that counted rows from the bottom, for rows counted from the top.

    Parameters
    ----------
    matrix
        (3, 4), for rows that count upward from the bottom row's centre at 0.
    height
        Rows of the image.

    """
    return np.array([[1.0, 0, 0], [0, -1, height - 1], [0, 0, 1]]) @ matrix
