"""Where points with a covariance may lie in an image: ellipses."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.geometry.camera import Camera

CHI2_95 = 5.991464547107979
"""95 % quantile of the squared Mahalanobis distance in two dimensions."""


def projected_covariances(camera: Camera, points: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """Covariances of points in an image, to first order.

    Parameters
    ----------
    camera : Camera
        Of the image.
    points : (N, 3) array
        LPS mm.
    covariances : (N, 3, 3) array
        mm^2.

    Returns
    -------
    (N, 2, 2) array
        Of (column, row), px^2; NaN for points at or behind the source, and where a covariance is NaN.

    """
    in_camera = points @ camera.extrinsic[:3, :3].T + camera.extrinsic[:3, 3]
    depth = np.where(in_camera[:, 2] > 0, in_camera[:, 2], np.nan)
    fx, skew, fy = camera.intrinsics[0, 0], camera.intrinsics[0, 1], camera.intrinsics[1, 1]
    x, y = in_camera[:, 0] / depth, in_camera[:, 1] / depth
    zero = np.zeros_like(depth)
    slope = np.stack(
        [
            np.stack([fx / depth, skew / depth, -(fx * x + skew * y) / depth], axis=-1),
            np.stack([zero, fy / depth, -fy * y / depth], axis=-1),
        ],
        axis=-2,
    )
    slope = slope @ camera.extrinsic[:3, :3]
    return slope @ covariances @ np.swapaxes(slope, -1, -2)


def half_axes(covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half axes (2,) of the 95 % ellipse of a covariance (2, 2), ascending, and their directions, columns of (2, 2)."""
    variances, directions = np.linalg.eigh(covariance)
    return np.sqrt(CHI2_95 * variances.clip(min=0)), directions


def ellipse(centre: np.ndarray, covariance: np.ndarray, corners: int = 72) -> np.ndarray:
    """The 95 % ellipse around a centre (2,) as a closed polygon (corners, 2)."""
    lengths, directions = half_axes(covariance)
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return centre + (circle * lengths) @ directions.T
