"""Camera poses from three points: Grunert's solution (Haralick et al., Int. J. Computer Vision 13, 1994)."""

from __future__ import annotations

import numpy as np


def p3p_poses(points: np.ndarray, rays: np.ndarray) -> list[np.ndarray]:
    """Up to four extrinsics (4, 4) that put three world points on three rays.

    Args:
        points: (3, 3) world mm, one a row.
        rays: (3, 3) unit vectors in camera axes, one a row, with positive z.

    Returns:
        Poses with all points in front of the camera.  Complex roots are taken by their real part, for noise makes
        double roots complex; the caller refines.

    """
    a2, b2, c2 = (float(((points[m] - points[n]) ** 2).sum()) for m, n in ((1, 2), (0, 2), (0, 1)))
    if min(a2, b2, c2) < 1e-9:
        return []
    alpha, beta, gamma = float(rays[1] @ rays[2]), float(rays[0] @ rays[2]), float(rays[0] @ rays[1])
    q = (a2 - c2) / b2
    p = (a2 + c2) / b2
    coefficients = (
        (q - 1) ** 2 - 4 * c2 / b2 * alpha**2,
        4 * (q * (1 - q) * beta - (1 - p) * alpha * gamma + 2 * c2 / b2 * alpha**2 * beta),
        2
        * (
            q**2
            - 1
            + 2 * q**2 * beta**2
            + 2 * (b2 - c2) / b2 * alpha**2
            - 4 * p * alpha * beta * gamma
            + 2 * (b2 - a2) / b2 * gamma**2
        ),
        4 * (-q * (1 + q) * beta + 2 * a2 / b2 * gamma**2 * beta - (1 - p) * alpha * gamma),
        (1 + q) ** 2 - 4 * a2 / b2 * gamma**2,
    )
    poses = []
    for root in np.roots(coefficients):
        v = float(root.real)
        divisor = 2 * (gamma - v * alpha)
        spread = 1 + v * v - 2 * v * beta
        if v <= 0 or abs(divisor) < 1e-12 or spread <= 1e-15:
            continue
        u = ((q - 1) * v * v - 2 * q * beta * v + 1 + q) / divisor
        if u <= 0:
            continue
        first = np.sqrt(b2 / spread)
        poses.append(_align(points, rays * np.array([[first], [u * first], [v * first]])))
    return poses


def _align(points: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(4, 4) rigid motion nearest to taking points (3, 3) to points seen in camera axes (Kabsch, 1976)."""
    middle, middle_seen = points.mean(axis=0), seen.mean(axis=0)
    left, _, right = np.linalg.svd((seen - middle_seen).T @ (points - middle))
    handed = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = left @ handed @ right
    extrinsic[:3, 3] = middle_seen - extrinsic[:3, :3] @ middle
    return extrinsic
