"""How far soft tissue lies from where the warp puts it: a variance calibrated on simulated truths.

The truths' soft tissue follows other laws than the warp (Testing/Benchmarks/carry.py). Its error hardly depends on
how far bones move apart, within what joints allow; it grows from a bone's surface to a plateau some centimetres off.
Nothing here knows of breathing, a filling bladder or a scalpel.
"""

from __future__ import annotations

import numpy as np

AT_BONE_MM = 0.2
"""Standard deviation along any direction at a bone's surface."""

FAR_MM = 1.1
"""Standard deviation far from all bones."""

FAR_SHARE = 0.08
"""Standard deviation far from all bones, more, as share of the displacement by the bones' weighted motions."""

HALF_WAY_MM = 14.0
"""Distance from the nearest bone at which half of the last two is reached."""


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
    mean = np.einsum("kn,knc->nc", weight, moved)
    nearest = distance.min(axis=0)
    part = nearest / (nearest + HALF_WAY_MM)
    return AT_BONE_MM**2 + part**2 * (FAR_MM**2 + FAR_SHARE**2 * (mean**2).sum(axis=1))
