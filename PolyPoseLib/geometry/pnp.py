"""A camera from landmarks: pairs of points in the CT and in the X-ray (perspective-n-point), outliers rejected."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

FEWEST = 4

OUTLIER_MM = 12.0
"""A landmark whose reprojection is farther off, measured at its own depth, is left out."""

CLICK_MM = 2.0
"""Precision of landmarks placed by hand, at their depth: the scale of the robust loss, and the least uncertainty."""

LEAST_WIDTH_MM = 5.0
"""Landmarks that are spread less than this across their longest line count as lying on one line."""

MOST_SUBSETS = 300
MOST_STARTS = 8


@dataclass(frozen=True)
class PnpSolution:
    """A camera from N landmarks.

    Attributes
    ----------
    camera : Camera
        The camera.
    inliers : (N,) array of bool
        Those that were used.
    errors_px, errors_mm : (N,) array
        Reprojection errors of all, in pixels and at the landmark's depth.
    covariance : (6, 6) array
        Of a small motion of the camera's frame about the inliers' centroid, [rotation (rad), translation (mm)].
    ambiguous_mm : float, optional
        Reprojection error (root mean square) of the best clearly different camera, or None when there is none:
        flat sets have two.

    """

    camera: Camera
    inliers: np.ndarray
    errors_px: np.ndarray
    errors_mm: np.ndarray
    covariance: np.ndarray
    ambiguous_mm: float | None

    @property
    def rms_mm(self) -> float:
        """Root mean square reprojection error of the inliers, at their depth."""
        return float(np.sqrt((self.errors_mm[self.inliers] ** 2).mean()))

    @property
    def radius(self) -> tuple[float, float]:
        """(degrees, mm): three standard deviations of the worst direction of rotation and of translation."""
        turn, shift = self.covariance[:3, :3], self.covariance[3:, 3:]
        worst = [np.sqrt(max(np.linalg.eigvalsh(part)[-1], 0)) for part in (turn, shift)]
        return float(3 * np.degrees(worst[0])), float(3 * worst[1])


def camera_from_landmarks(
    points: ArrayLike, pixels: ArrayLike, detector: Camera, name: str = "landmarks", seed: int = 0
) -> PnpSolution:
    """The camera that projects points to pixels.

    Poses from triples of landmarks (p3p) are scored by all, the best are refined with a robust loss, outliers are
    dropped and the rest is fitted by least squares.

    Parameters
    ----------
    points : (N, 3) array_like
        LPS mm.
    pixels : (N, 2) array_like
        [column, row].
    detector : Camera
        Intrinsics and size; its extrinsic is ignored.
    name : str
        How messages call the landmarks.
    seed : int
        Of the choice of triples when there are many.

    Returns
    -------
    PnpSolution
        The camera, its errors and its covariance.

    Raises
    ------
    InputError
        Fewer than four pairs, numbers that are not finite, points or pixels in one place or on one line, or no
        four landmarks that agree with one camera.

    """
    points, pixels = checked_landmarks(points, pixels, name)
    starts = _starts(points, pixels, detector, np.random.default_rng(seed))
    fits = sorted((_robust_fit(start, points, pixels, detector) for start in starts), key=lambda fit: fit[0])
    if not fits:
        raise _disagreement(name)
    best = detector.with_extrinsic(fits[0][1])
    inliers = _errors_mm(best, points, pixels) <= OUTLIER_MM
    if inliers.sum() < FEWEST:
        raise _disagreement(name)
    try:
        require_spread(points[inliers], pixels[inliers], name)
    except InputError as error:
        raise InputError(f"{error} {int((~inliers).sum())} others do not agree with them.") from None
    camera, covariance = _final_fit(best, points[inliers], pixels[inliers])
    errors = np.linalg.norm(camera.project(points) - pixels, axis=1)
    return PnpSolution(
        camera,
        inliers,
        np.nan_to_num(errors, nan=np.inf),
        _errors_mm(camera, points, pixels),
        covariance,
        _other_minimum(camera, fits, points[inliers], pixels[inliers]),
    )


def checked_landmarks(points: ArrayLike, pixels: ArrayLike, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and pixels (N, 2) in float64, at least four and spread out; raises InputError."""
    try:
        points, pixels = (np.asarray(part, dtype=np.float64) for part in (points, pixels))
    except (TypeError, ValueError):
        raise InputError(f"{name}: give three numbers per point and two per pixel.") from None
    count = len(points) if points.ndim else 0
    if count and (points.shape != (count, 3) or pixels.shape != (count, 2)):
        raise InputError(f"{name}: give as many pixels [column, row] as points [x, y, z].")
    if count < FEWEST:
        raise InputError(
            f"{name}: there are {count} pairs of points, but at least {FEWEST} are needed; add some."
        )
    if not (np.isfinite(points).all() and np.isfinite(pixels).all()):
        raise InputError(f"{name}: there are numbers that are not finite; correct them.")
    require_spread(points, pixels, name)
    return points, pixels


def require_spread(points: np.ndarray, pixels: np.ndarray, name: str) -> None:
    """Refuse landmarks in one place or on one line; raises InputError."""
    length, width = _extent(points)
    if length < LEAST_WIDTH_MM:
        raise InputError(
            f"{name}: the points in the CT all lie in one place; choose points far from each other."
        )
    if width < max(LEAST_WIDTH_MM, 0.02 * length):
        raise InputError(
            f"{name}: the points in the CT lie on one line, about which the camera could turn freely; add a point "
            "beside it."
        )
    length, width = _extent(pixels)
    if length < 2:
        raise InputError(
            f"{name}: the pixels all lie in one place; give the position of each landmark in the X-ray."
        )
    if width < 0.005 * length:
        raise InputError(f"{name}: the pixels lie on one line; add a landmark beside it.")


def _extent(points: np.ndarray) -> tuple[float, float]:
    """Extent along the longest line and the one across it."""
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    along = centred @ axes[:2].T
    length, width = np.ptp(along, axis=0)
    return float(length), float(width)


def _disagreement(name: str) -> InputError:
    return InputError(
        f"{name}: no {FEWEST} landmarks agree with one camera to {OUTLIER_MM:g} mm; check that each pair shows "
        "the same place, points are LPS mm, pixels [column, row], and the X-ray's distance and spacing right."
    )


def _starts(
    points: np.ndarray, pixels: np.ndarray, detector: Camera, rng: np.random.Generator
) -> list[np.ndarray]:
    """Extrinsics from triples, in order of their truncated reprojection error."""
    rays = np.linalg.solve(detector.intrinsics, np.column_stack([pixels, np.ones(len(pixels))]).T).T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    triples = list(combinations(range(len(points)), 3))
    if len(triples) > MOST_SUBSETS:
        triples = [triples[n] for n in rng.choice(len(triples), MOST_SUBSETS, replace=False)]
    poses = [pose for triple in triples for pose in p3p_poses(points[list(triple)], rays[list(triple)])]
    costs = []
    for pose in poses:
        errors = _errors_mm(detector.with_extrinsic(pose), points, pixels)
        costs.append(np.minimum(errors, 2 * OUTLIER_MM).sum())
    return [poses[n] for n in np.argsort(costs, kind="stable")[:MOST_STARTS]]


def _robust_fit(
    extrinsic: np.ndarray, points: np.ndarray, pixels: np.ndarray, detector: Camera
) -> tuple[float, np.ndarray]:
    """Truncated cost (mm^2) and extrinsic after a fit with a robust loss."""
    start = detector.with_extrinsic(extrinsic)
    centre = points.mean(axis=0)

    def residual(step: np.ndarray) -> np.ndarray:
        return _residual_mm(_moved(start, step, centre), points, pixels).ravel()

    scale = (1e-2, 1e-2, 1e-2, 1.0, 1.0, 1.0)
    fit = least_squares(residual, np.zeros(6), loss="cauchy", f_scale=CLICK_MM, x_scale=scale, max_nfev=60)
    camera = _moved(start, fit.x, centre)
    errors = _errors_mm(camera, points, pixels)
    return float((np.minimum(errors, OUTLIER_MM) ** 2).sum()), camera.extrinsic


def _final_fit(start: Camera, points: np.ndarray, pixels: np.ndarray) -> tuple[Camera, np.ndarray]:
    """Least squares over landmarks that agree, and the covariance (6, 6) from its Jacobian."""
    centre = points.mean(axis=0)

    def residual(step: np.ndarray) -> np.ndarray:
        return _residual_mm(_moved(start, step, centre), points, pixels).ravel()

    scale = (1e-2, 1e-2, 1e-2, 1.0, 1.0, 1.0)
    fit = least_squares(residual, np.zeros(6), x_scale=scale, max_nfev=200)
    freedom = max(fit.fun.size - 6, 1)
    variance = max(float(fit.fun @ fit.fun) / freedom, (CLICK_MM / 2) ** 2)
    return _moved(start, fit.x, centre), variance * np.linalg.pinv(fit.jac.T @ fit.jac)


def _moved(camera: Camera, step: np.ndarray, centre: np.ndarray) -> Camera:
    """Rotate the camera's frame by step[:3] rad about ``centre`` and shift it by step[3:] mm, in camera axes."""
    turn = Rotation.from_rotvec(step[:3]).as_matrix()
    middle = camera.extrinsic[:3, :3] @ centre + camera.extrinsic[:3, 3]
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = turn @ camera.extrinsic[:3, :3]
    extrinsic[:3, 3] = middle + step[3:] - extrinsic[:3, :3] @ centre
    return camera.with_extrinsic(extrinsic)


def _residual_mm(camera: Camera, points: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """(N, 2) reprojection errors in mm at a common depth; points behind the source are far off."""
    depth = max(float(np.median(camera.depth(points))), 1.0)
    error = camera.project(points) - pixels
    return np.nan_to_num(error, nan=1e4) * depth / np.diag(camera.intrinsics)[:2]


def _errors_mm(camera: Camera, points: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """(N,) lengths of the reprojection errors in mm at each point's depth."""
    error = (camera.project(points) - pixels) / np.diag(camera.intrinsics)[:2]
    return np.nan_to_num(np.linalg.norm(error, axis=1) * camera.depth(points), nan=1e4)


def _other_minimum(
    camera: Camera, fits: list[tuple[float, np.ndarray]], points: np.ndarray, pixels: np.ndarray
) -> float | None:
    """Smallest root mean square error (mm) of fits that are rotated by more than 5 degrees."""
    others = []
    for _, extrinsic in fits:
        rotation_angle = Rotation.from_matrix(extrinsic[:3, :3] @ camera.extrinsic[:3, :3].T).magnitude()
        if rotation_angle > np.radians(5):
            errors = _errors_mm(camera.with_extrinsic(extrinsic), points, pixels)
            others.append(float(np.sqrt((errors**2).mean())))
    return min(others) if others else None


def p3p_poses(points: np.ndarray, rays: np.ndarray) -> list[np.ndarray]:
    """Up to four extrinsics (4, 4) that put three world points on three rays.

    Parameters
    ----------
    points : (3, 3) array
        World mm, one a row.
    rays : (3, 3) array
        Unit vectors in camera axes, one a row, with positive z.

    Returns
    -------
    list[np.ndarray]
        (4, 4) poses, world to camera, with all points in front of the camera. Complex roots are taken by their real
        part, for noise makes double roots complex; the caller refines.

    References
    ----------
    R. Haralick et al., "Review and analysis of solutions of the three point perspective pose estimation problem",
    IJCV 1994 (the solution of J. Grunert, 1841).

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
