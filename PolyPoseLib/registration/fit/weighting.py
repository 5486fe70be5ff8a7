"""Pixel weights: where the bones of interest project, less where the tissue moves otherwise than the model."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.ndimage import distance_transform_edt

from PolyPoseLib.registration.fit.levels import pixel_size_mm
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View
from PolyPoseLib.rendering.rigid import BodyProjection

VISIBLE_LINE_INTEGRAL = 0.02
"""A bone shows in a pixel when it adds at least this much."""

MODEL_VARIANCE = 0.06
"""Variance of the normalised residual without noise, from tissue that moves otherwise than the model."""

LEAST_SCALE = 0.2
"""Smallest scale of the residual, in units of what is expected; below it nothing is an outlier."""


def projection_mask(problem: RigidProblem, state: State, view_index: int, which: Iterable[int]) -> np.ndarray:
    """(H, W) bool: pixels of a view in which one of the bodies ``which`` shows."""
    shows = np.zeros(problem.views[view_index].static.shape, bool)
    for k in which:
        mark_shown(shows, problem.projection(k, state, view_index))
    return shows


def mark_shown(shows: np.ndarray, part: BodyProjection) -> None:
    """Set the pixels of ``shows`` (H, W) bool in which a body's projection adds something that can be seen."""
    shows[part.slices] |= np.abs(part.image) > VISIBLE_LINE_INTEGRAL


def usable_projection_mask(
    problem: RigidProblem, state: State, view_index: int, which: Iterable[int]
) -> np.ndarray:
    """(H, W) bool: the same, without the pixels of the X-ray that are not used."""
    support = problem.views[view_index].contrast.support
    return projection_mask(problem, state, view_index, which) & (support > 0)


def dilated(shows: np.ndarray, reach_px: float) -> np.ndarray:
    """Pixels at most ``reach_px`` from one that is True."""
    if reach_px <= 0 or not shows.any():
        return shows
    return np.asarray(distance_transform_edt(~shows)) <= reach_px


def region_around(
    problem: RigidProblem, state: State, view_index: int, which: Iterable[int], reach_mm: float
) -> np.ndarray:
    """(H, W) bool: pixels of a view at most ``reach_mm``, at the anchor's depth, from the bodies ``which``."""
    pixel_mm = pixel_size_mm(problem.views[view_index].camera, problem.camera_centre)
    return dilated(projection_mask(problem, state, view_index, which), reach_mm / pixel_mm)


def reliability(view: View) -> np.ndarray:
    """(H, W) expected variance of the residual without noise over that with it, 0 to 1."""
    return np.broadcast_to(MODEL_VARIANCE / (MODEL_VARIANCE + view.noise_share), view.target.shape)


def robust_weight(view: View, residual: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Pixel weights inside a region: less where the X-ray is noisy, less still where its residual is large.

    The reliability times the Cauchy weights 1 / (1 + (r / s)^2) of iteratively reweighted least squares, s being twice
    the robust deviation of the residual in units of what is expected.

    Parameters
    ----------
    view : View
        The X-ray.
    residual : (H, W) ndarray
        Normalised rendering less normalised X-ray.
    region : (H, W) ndarray
        bool, where pixels count.

    Returns
    -------
    (H, W) ndarray
        float32, 0 outside the region.

    References
    ----------
    P. Holland and R. Welsch, "Robust regression using iteratively reweighted least-squares", Communications in
    Statistics A6 (1977).

    """
    region = region & (view.contrast.support > 0)
    if not region.any():
        return np.zeros(residual.shape, np.float32)
    reliable = reliability(view)
    standardised = residual * np.sqrt(reliable / MODEL_VARIANCE)
    scale = 2 * max(1.4826 * float(np.median(np.abs(standardised[region]))), LEAST_SCALE)
    weight = reliable / (1 + (standardised / scale) ** 2)
    return np.where(region, weight, 0).astype(np.float32)
