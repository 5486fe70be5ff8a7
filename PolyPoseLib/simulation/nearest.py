"""The nearest element of an array that something is known of."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt


def nearest_known(missing: np.ndarray, spacing: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
    """Index, for every element of an array, of the nearest one that is not missing.

    Parameters
    ----------
    missing : (k, j, i) array of bool
        Not everywhere True.
    spacing : (3,) array, optional
        Distance of neighbours along (k, j, i); 1 by default.

    Returns
    -------
    tuple of (k, j, i) array of int32
        As numpy takes an index: values[nearest_known(missing)] fills the gaps.

    """
    index = np.empty((missing.ndim, *missing.shape), np.int32)
    distance_transform_edt(
        missing, sampling=spacing, return_distances=False, return_indices=True, indices=index
    )
    return tuple(index[axis] for axis in range(missing.ndim))
