"""Grids whose axes are not perpendicular: how far that moves their voxels, and what to do about it.

Rounding bends the axes by hundredths of a millimetre over the whole grid; gantry tilt, which slices keep when they are
stacked without resampling, by tens of millimetres.
"""

from __future__ import annotations

import numpy as np

SHEAR_TOLERANCE_MM = 1.0
"""Largest sideways drift over the whole grid that rounding may cause."""

SHEAR_FIX = (
    "resample the CT to a straight grid first, for example by Slicer's Acquisition Geometry Regularization"
)

_PERPENDICULAR = 1e-7
"""Cosines below it are left as they are."""


def sideways_drift(axes: np.ndarray, sizes: np.ndarray) -> tuple[float, float]:
    """How far two of a grid's axes depart from perpendicular, for the worst pair.

    The drift is that of the shorter axis' last voxel when the longer axis is kept.

    Parameters
    ----------
    axes
        (3, 3), in its columns the steps along (i, j, k) in mm, none of them zero.
    sizes
        (3,) voxels along (i, j, k).

    Returns
    -------
    drift
        Millimetres.
    angle
        Degrees from perpendicular.

    """
    steps = np.linalg.norm(axes, axis=0)
    cosines = np.abs(_cosines(axes))
    extents = steps * (np.asarray(sizes, dtype=np.float64) - 1)
    drifts = cosines * np.minimum.outer(extents, extents)
    worst = np.unravel_index(np.argmax(drifts), drifts.shape)
    return float(drifts[worst]), float(np.degrees(np.arcsin(min(cosines[worst], 1.0))))


def straightened(axes: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Axes made perpendicular where rounding bent them, the longest kept; sheared ones stay as they are.

    Parameters
    ----------
    axes
        (3, 3), in its columns the steps along (i, j, k) in mm.
    sizes
        (3,) voxels along (i, j, k).

    """
    steps = np.linalg.norm(axes, axis=0)
    if not (steps > 0).all() or np.abs(_cosines(axes)).max() < _PERPENDICULAR:
        return axes
    if sideways_drift(axes, sizes)[0] > SHEAR_TOLERANCE_MM:
        return axes
    order = np.argsort(-steps * (np.asarray(sizes) - 1), kind="stable")
    directions, signs = np.linalg.qr((axes / steps)[:, order])
    directions = directions * np.sign(np.diag(signs))  # the decomposition may turn an axis round
    straight = np.empty((3, 3))
    straight[:, order] = directions
    return straight * steps


def _cosines(axes: np.ndarray) -> np.ndarray:
    """(3, 3) cosines between the axes, 0 on the diagonal."""
    directions = axes / np.linalg.norm(axes, axis=0)
    return directions.T @ directions * (1 - np.eye(3))
