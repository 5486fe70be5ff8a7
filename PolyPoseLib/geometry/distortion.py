"""Lens distortion by Brown's model, with coefficients k1, k2, p1, p2[, k3] in OpenCV's order and sign.

Ideal image coordinates are mapped to distorted ones: D. C. Brown, "Decentering distortion of lenses", Photogrammetric
Engineering 32 (1966).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import map_coordinates

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import real_array

MAX_DISTORTION = 1e6
"""Coefficients of lenses are far below it."""


def require_distortion(value: Any, where: str = '"distortion"') -> tuple[float, ...]:
    """Check coefficients and return them as plain floats.

    Parameters
    ----------
    value
        A list of them, or one row or column.
    where
        Opening of the error's sentence.

    Raises
    ------
    InputError
        Other than four or five finite numbers, or numbers beyond `MAX_DISTORTION`.

    """
    try:
        coefficients = real_array(value)
    except (TypeError, ValueError):
        coefficients = np.empty(0)
    in_one_row = coefficients.size == max(coefficients.shape, default=0)
    usual = coefficients.size in (4, 5) and bool((np.abs(coefficients) <= MAX_DISTORTION).all())
    if not (in_one_row and usual):
        raise InputError(
            f"{where} must be four or five numbers up to {MAX_DISTORTION:g}: k1, k2, p1, p2 and perhaps k3."
        )
    return tuple(coefficients.ravel().tolist())


def with_positive_axes(distortion: tuple[float, ...], intrinsics: np.ndarray) -> tuple[float, ...]:
    """The same distortion for axes whose signs were taken out of K (3, 3): the tangential terms turn with them."""
    if not distortion:
        return ()
    k1, k2, p1, p2, *rest = distortion
    return (
        k1,
        k2,
        float(np.copysign(p1, p1 * intrinsics[1, 1])),
        float(np.copysign(p2, p2 * intrinsics[0, 0])),
        *rest,
    )


def distort(points: np.ndarray, distortion: ArrayLike) -> np.ndarray:
    """Distorted image coordinates of ideal ones.

    Parameters
    ----------
    points
        (..., 2), x and y at depth 1.
    distortion
        k1, k2, p1, p2[, k3].

    Returns
    -------
    numpy.ndarray
        (..., 2), x and y at depth 1.

    Raises
    ------
    InputError
        As `require_distortion`.

    """
    k1, k2, p1, p2, k3 = (*require_distortion(distortion), 0.0)[:5]
    x, y = points[..., 0], points[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )


def undistorted(
    image: np.ndarray, mask: np.ndarray, intrinsics: np.ndarray, distortion: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """An image and its mask as a camera without distortion would have seen them.

    Parameters
    ----------
    image
        (H, W); sampled linearly.
    mask
        (H, W) bool.
    intrinsics
        K (3, 3) in pixels.
    distortion
        k1, k2, p1, p2[, k3].

    Returns
    -------
    image
        (H, W) float32.
    mask
        (H, W) bool, False where the distorted image does not reach.

    Raises
    ------
    InputError
        Coefficients that are none, or that fold the image over.

    """
    where = undistortion(image.shape, intrinsics, distortion)
    return straightened(image, where), straightened_mask(mask, where)


def undistortion(shape: tuple[int, ...], intrinsics: np.ndarray, distortion: ArrayLike) -> np.ndarray:
    """Where the pixels of an image without distortion lie in the distorted one.

    Parameters
    ----------
    shape
        (H, W) of both.
    intrinsics
        K (3, 3) in pixels.
    distortion
        k1, k2, p1, p2[, k3].

    Returns
    -------
    numpy.ndarray
        (2, H, W), row and column.

    Raises
    ------
    InputError
        Coefficients that are none, or that fold the image over.

    """
    height, width = shape
    column, row = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    inverse = np.linalg.inv(intrinsics)
    ideal = np.stack([column, row, np.ones_like(row)], axis=-1) @ inverse.T
    bent = distort(ideal[..., :2], distortion)
    pixels = np.concatenate([bent, np.ones((height, width, 1))], axis=-1) @ np.asarray(intrinsics).T
    if (np.diff(pixels[..., 0], axis=1) <= 0).any() or (np.diff(pixels[..., 1], axis=0) <= 0).any():
        raise InputError(
            "the distortion folds the image over; check the order of its coefficients k1, k2, p1, p2, k3."
        )
    return np.stack([pixels[..., 1], pixels[..., 0]])


def straightened(image: np.ndarray, where: np.ndarray) -> np.ndarray:
    """An image (H, W) sampled linearly at places (2, H, W) that `undistortion` gave, float32."""
    return map_coordinates(image.astype(np.float32), where, order=1, mode="nearest")


def straightened_mask(mask: np.ndarray, where: np.ndarray) -> np.ndarray:
    """The mask (H, W) bool of an image that was sampled at places (2, H, W), False where it does not reach."""
    return map_coordinates(mask.astype(np.float32), where, order=1, mode="constant", cval=0.0) > 0.99
