"""How far soft tissue lies from where the warp puts it: a variance calibrated on simulated truths."""

from __future__ import annotations

import numpy as np


def soft_tissue_variance(distance: np.ndarray, weight: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Variance along any direction, mm^2, of the warp's own error at points of soft tissue.

    Parameters
    ----------
    distance, weight : (K, N) array
        mm to every structure, and the weights of their motions.
    moved : (K, N, 3) array
        mm, how far the motion of every structure would displace the point.

    Returns
    -------
    (N,) array

    """
    mean = (weight[:, :, None] * moved).sum(axis=0)
    spread = (weight * ((moved - mean) ** 2).sum(axis=2)).sum(axis=0)
    nearest = distance.min(axis=0)
    return 0.5**2 + (nearest / (nearest + 20)) ** 2 * (spread + (0.2**2) * (mean**2).sum(axis=1))
