"""How well two masks, two motions, or a warp and the truth agree; every measure states its unit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import bounding_box
from PolyPoseLib.geometry.rigid import rigid_inverse

PointMap = Callable[[np.ndarray], np.ndarray]
"""Takes points (N, 3) in LPS mm to points (N, 3) in LPS mm."""


def dice(first: np.ndarray, second: np.ndarray) -> float:
    """Dice coefficient of two masks, 2 |A and B| / (|A| + |B|).

    Parameters
    ----------
    first, second : array of bool
        Of equal shape and any number of dimensions: 3D for label maps, 2D for silhouettes.

    Returns
    -------
    float
        0 to 1, no unit; NaN when both are empty.

    Raises
    ------
    InputError
        The shapes differ.

    References
    ----------
    L. Dice, "Measures of the amount of ecologic association between species", Ecology 1945.

    """
    first, second = _same_shape(first, second)
    total = int(np.count_nonzero(first)) + int(np.count_nonzero(second))
    return 2 * int(np.count_nonzero(first & second)) / total if total else float("nan")


def dice_per_label(first: np.ndarray, second: np.ndarray, names: Mapping[int, str]) -> dict[str, float]:
    """Dice coefficient of each label of two label maps.

    Parameters
    ----------
    first, second : array of integers
        Label maps of equal shape.
    names : Mapping[int, str]
        {label: name}.

    Returns
    -------
    dict[str, float]
        {name: 0 to 1}; NaN for a label that neither has.

    """
    return {name: dice(first == label, second == label) for label, name in names.items()}


def silhouette_dice(first: np.ndarray, second: np.ndarray, thickness_mm: float = 1.0) -> float:
    """2D Dice coefficient of the silhouettes of two projections of one structure.

    Parameters
    ----------
    first, second : (H, W) array
        Lengths in mm that the ray of each pixel runs inside the structure (a rendering of its mask).
    thickness_mm : float
        Pixels with at least this length are the silhouette.

    Returns
    -------
    float
        0 to 1, no unit; NaN when both silhouettes are empty.

    """
    return dice(np.asarray(first) >= thickness_mm, np.asarray(second) >= thickness_mm)


def hausdorff95(first: np.ndarray, second: np.ndarray, affine: np.ndarray) -> float:
    """95th percentile Hausdorff distance of two masks.

    The larger of the two directed 95th percentiles of distances between surface voxels' centres; a surface
    voxel has a face neighbour outside the mask or the grid.

    Parameters
    ----------
    first, second : (k, j, i) array
        Masks on one grid.
    affine : (4, 4) array
        Index (i, j, k) to LPS mm.

    Returns
    -------
    float
        mm; NaN when one of the masks is empty.

    Raises
    ------
    InputError
        The shapes differ.

    """
    from scipy.spatial import KDTree

    first, second = _same_shape(first, second)
    surfaces = [surface_points(mask, affine) for mask in (first, second)]
    if not all(len(surface) for surface in surfaces):
        return float("nan")
    there, _ = KDTree(surfaces[1]).query(surfaces[0])
    back, _ = KDTree(surfaces[0]).query(surfaces[1])
    return float(max(np.percentile(there, 95), np.percentile(back, 95)))


def surface_points(mask: np.ndarray, affine: np.ndarray) -> np.ndarray:
    """Centres (N, 3) in LPS mm of a mask's (k, j, i) voxels that have a face neighbour outside it."""
    from scipy.ndimage import binary_erosion

    box = bounding_box(mask)
    if box is None:
        return np.zeros((0, 3))
    inside = np.asarray(mask[box], dtype=bool)
    surface = inside & np.logical_not(binary_erosion(inside))
    index = np.argwhere(surface) + [side.start for side in box]
    return index[:, ::-1] @ affine[:3, :3].T + affine[:3, 3]


def mask_points(mask: np.ndarray, affine: np.ndarray, limit: int | None = None, seed: int = 0) -> np.ndarray:
    """Centres (N, 3) in LPS mm of a mask's voxels (k, j, i); at most limit of them, drawn at random."""
    flat = np.flatnonzero(mask)
    if limit is not None and len(flat) > limit:
        flat = np.random.default_rng(seed).choice(flat, limit, replace=False)
    index = np.stack(np.unravel_index(flat, mask.shape)[::-1], axis=1)
    return index @ affine[:3, :3].T + affine[:3, 3]


def target_registration_error(
    points: np.ndarray, truth: ArrayLike | PointMap, found: ArrayLike | PointMap
) -> np.ndarray:
    """Distance between where the true and the found map take each point.

    Parameters
    ----------
    points : (N, 3) array
        Fixed LPS mm.
    truth, found : (4, 4) array_like or callable
        Rigid motions, or functions from (N, 3) to (N, 3); fixed to moving, LPS mm. Take points at the structure's
        true place (see structure_errors).

    Returns
    -------
    (N,) array
        mm.

    References
    ----------
    J. Fitzpatrick et al., "Predicting error in rigid-body point-based registration", IEEE TMI 1998.

    """
    points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    return np.linalg.norm(_apply(truth, points) - _apply(found, points), axis=1)


def structure_errors(
    labels: np.ndarray,
    affine: np.ndarray,
    names: tuple[str, ...],
    truth: ArrayLike,
    found: ArrayLike | PointMap,
    limit: int | None = 20_000,
) -> dict[str, dict[str, float]]:
    """Target registration error of every structure over its voxels.

    Parameters
    ----------
    labels : (k, j, i) array
        n belongs to names[n-1], in the moving frame.
    affine : (4, 4) array
        Index (i, j, k) to LPS mm.
    names : tuple[str, ...]
        Of the K structures.
    truth : (K, 4, 4) array_like
        True motions, fixed to moving; a structure's voxels lie at truth^-1 in the fixed frame.
    found : (K, 4, 4) array_like or callable
        Motions, or one function from fixed to moving points (N, 3), such as a displacement field.
    limit : int, optional
        Voxels per structure, drawn with a fixed seed; None for all.

    Returns
    -------
    dict[str, dict[str, float]]
        {name: {"mean", "p95", "max"}} in mm; NaN for a structure without voxels.

    Raises
    ------
    InputError
        The numbers of names and motions differ.

    """
    truth = np.asarray(truth, dtype=np.float64)
    maps = [found] * len(names) if callable(found) else list(np.asarray(found, dtype=np.float64))
    if len(truth) != len(names) or len(maps) != len(names):
        raise InputError(
            f"There are {len(names)} structures, {len(truth)} true and {len(maps)} found motions: "
            "give one 4x4 matrix for each structure."
        )
    errors = {}
    for n, name in enumerate(names):
        moving = mask_points(labels == n + 1, affine, limit)
        fixed = _apply(rigid_inverse(truth[n]), moving)
        errors[name] = summary(target_registration_error(fixed, truth[n], maps[n]))
    return errors


def summary(errors: np.ndarray) -> dict[str, float]:
    """Mean, 95th percentile and maximum of errors (N,), in their unit; NaN when there are none."""
    if not len(errors):
        return dict.fromkeys(("mean", "p95", "max"), float("nan"))
    return {
        "mean": float(np.mean(errors)),
        "p95": float(np.percentile(errors, 95)),
        "max": float(np.max(errors)),
    }


def fold_percentage(determinant: np.ndarray) -> float:
    """Share of voxels whose Jacobian determinant is 0 or less, in percent.

    Parameters
    ----------
    determinant : array
        Of the warp fixed to moving, of any shape (no unit). A determinant that is not finite counts as a fold.

    Returns
    -------
    float
        0 to 100 percent.

    """
    determinant = np.asarray(determinant)
    return 100.0 * float(np.count_nonzero(~(determinant > 0))) / max(determinant.size, 1)


def sd_log_jacobian(determinant: np.ndarray) -> float:
    """Standard deviation of ln |J| over voxels with a determinant above 0.

    Folded voxels have no logarithm: they are left out here and counted by fold_percentage.

    Parameters
    ----------
    determinant : array
        Of the warp fixed to moving, of any shape (no unit).

    Returns
    -------
    float
        No unit; 0 for a rigid motion, NaN when every voxel is folded.

    """
    determinant = np.asarray(determinant, dtype=np.float64)
    kept = determinant[determinant > 0]
    return float(np.std(np.log(kept))) if kept.size else float("nan")


def projection_error_mm(
    points: np.ndarray,
    truth: Camera,
    found: Camera | None = None,
    found_points: np.ndarray | None = None,
    scale: Literal["structure", "detector"] = "structure",
    pixel_spacing_mm: tuple[float, float] | None = None,
) -> np.ndarray:
    """Distance between the projections of points under the true and the found camera or place.

    Parameters
    ----------
    points : (N, 3) array
        True fixed LPS mm.
    truth : Camera
        The true camera.
    found : Camera, optional
        The found one; the true camera by default.
    found_points : (N, 3) array, optional
        Where the found registration has those points, fixed LPS mm; the true points by default.
    scale : {"structure", "detector"}
        "structure" measures in the plane through each true point parallel to the detector (pixels times depth
        over focal length); "detector" on the detector.
    pixel_spacing_mm : tuple[float, float], optional
        Between rows, between columns (DICOM's order); needed for "detector".

    Returns
    -------
    (N,) array
        mm; NaN for a point behind a source.

    Raises
    ------
    InputError
        "detector" without pixel_spacing_mm, another scale, or numbers of points that differ.

    """
    points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    other = points if found_points is None else np.asarray(found_points, dtype=np.float64).reshape(-1, 3)
    camera = truth if found is None else found
    if len(other) != len(points):
        raise InputError(f"There are {len(points)} points and {len(other)} found points; give one for each.")
    if scale == "structure":
        per_pixel = truth.depth(points)[:, None] / np.array([truth.intrinsics[0, 0], truth.intrinsics[1, 1]])
    elif scale == "detector":
        if pixel_spacing_mm is None:
            raise InputError(
                "The error on the detector needs pixel_spacing_mm, (between rows, columns) in mm."
            )
        per_pixel = np.array([pixel_spacing_mm[1], pixel_spacing_mm[0]], dtype=np.float64)
    else:
        raise InputError(f"The scale {scale!r} is not known; choose 'structure' or 'detector'.")
    return np.linalg.norm((truth.project(points) - camera.project(other)) * per_pixel, axis=1)


def _apply(motion: ArrayLike | PointMap, points: np.ndarray) -> np.ndarray:
    """Points (N, 3) under a (4, 4) motion or a function."""
    if callable(motion):
        return np.asarray(motion(points), dtype=np.float64)
    matrix = np.asarray(motion, dtype=np.float64)
    if matrix.shape != (4, 4):
        raise InputError(
            f"A motion of shape {matrix.shape} cannot move points: give a 4x4 matrix or a function."
        )
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _same_shape(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    first, second = np.asarray(first, dtype=bool), np.asarray(second, dtype=bool)
    if first.shape != second.shape:
        raise InputError(
            f"Masks of shape {first.shape} and {second.shape} do not compare: resample one onto the other."
        )
    return first, second
