"""How far soft tissue lies from where the warp puts it: a variance calibrated on simulated truths.

The truths' soft tissue follows two laws, neither of them the warp's: Laplace's equation, from which the warp differs by
1 mm, and an elastic body with a free skin, from which it differs by 2 to 3 (Testing/Benchmarks/carry.py). Nobody knows
which of them a patient follows, so the variance serves both alike. It grows with the distance from the bones and with
how far they move. Nothing here knows of breathing, a filling bladder or a scalpel.
"""

from __future__ import annotations

import numpy as np

AT_BONE_MM = 0.25
"""Standard deviation along any direction at a bone's surface."""

FAR_MM = 3.9
"""Standard deviation far from all bones."""

FAR_SHARE = 1.0
"""Standard deviation far from all bones, more, as share of the displacement by the bones' weighted motions."""

HALF_WAY_MM = 80.0
"""Distance from the nearest bone at which half of the last two is reached; few points of a body lie farther off."""


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
