"""Jacobian determinants of a displacement field in one pass over its nodes (numba, CPU)."""

import numba
import numpy as np

from PolyPoseLib.compiled import compiled


@numba.njit(inline="always")
def _slope(vectors, k, j, i, axis, component):
    """Difference per node along an array axis: central, one-sided at the border."""
    last = vectors.shape[axis] - 1
    here = (k, j, i)[axis]
    low, high = max(here - 1, 0), min(here + 1, last)
    if axis == 0:
        difference = np.float64(vectors[high, j, i, component]) - vectors[low, j, i, component]
    elif axis == 1:
        difference = np.float64(vectors[k, high, i, component]) - vectors[k, low, i, component]
    else:
        difference = np.float64(vectors[k, j, high, component]) - vectors[k, j, low, component]
    return difference / (high - low)


@compiled(parallel=True)
def fill_determinants(vectors, axes, determinants):
    """Fill det(A + du/d(i, j, k)) / det A.

    Parameters
    ----------
    vectors
        (d, h, w, 3) displacements in mm, two nodes or more along every axis.
    axes
        (3, 3) A, whose columns are the steps in mm along i, j and k.
    determinants
        (d, h, w) float32, overwritten.

    """
    depth, height, width = determinants.shape
    whole = np.linalg.det(axes)
    for k in numba.prange(depth):
        m = np.empty((3, 3))
        for j in range(height):
            for i in range(width):
                for component in range(3):
                    m[component, 0] = axes[component, 0] + _slope(vectors, k, j, i, 2, component)
                    m[component, 1] = axes[component, 1] + _slope(vectors, k, j, i, 1, component)
                    m[component, 2] = axes[component, 2] + _slope(vectors, k, j, i, 0, component)
                determinants[k, j, i] = (
                    m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
                    - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
                    + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
                ) / whole
