"""How far soft tissue lies from where the warp puts it: a variance calibrated on simulated truths.

The truths' soft tissue follows two laws, neither of them the warp's: Laplace's equation, from which the warp differs by
1 mm, and an elastic body with a free skin, from which it differs by 2 to 3 (Testing/Benchmarks/carry.py). Nobody knows
which of them a patient follows, so the variance serves both alike. It grows with the distance from the bones and with
how far they move. Where soft tissue moves by itself, as in breathing, the X-rays show a part of it only, and what is
left grows with that. Nothing here knows of a scalpel.
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

ATTACHED_MM = 15.0
"""Distance from the nearest bone at which half of the soft tissue's own motion is left, as in its fit."""

OWN_SHARE = 0.6
"""Standard deviation of its own motion that is left after the fit, as share of what the X-rays suggest; calibrated on
two breathing chests (Testing/Benchmarks/breathing.py, seeds 0 and 4)."""


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


def own_motion_variance(distance: np.ndarray, deviation_mm: np.ndarray) -> np.ndarray:
    """Variance along LPS x, y, z, mm^2, of soft tissue's own motion that the X-rays do not show.

    Parameters
    ----------
    distance : (K, N) array
        mm to every structure.
    deviation_mm : (3,) array
        How far it moves far from all bones, as the X-rays suggest.

    Returns
    -------
    (N, 3) array

    """
    squared = distance.min(axis=0) ** 2
    share = squared / (squared + ATTACHED_MM**2)
    return (OWN_SHARE * share[:, None] * deviation_mm) ** 2
