"""What the compiled loops over normalised images take as one argument."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class ContrastView(NamedTuple):
    """One X-ray, and the background in front of which a body moves.

    Attributes
    ----------
    background : (H, W) array of float64
        Line integrals less one constant.
    background_cost : (H, W) array of float64
        Weighted squared residual of the background alone.
    total : float
        Its sum.
    mask, share, support, target, weight : (H, W) array of float32
        As in :class:`PolyPoseLib.similarity.local_contrast.LocalContrast` and
        :class:`PolyPoseLib.registration.fit.problem.View`.
    least_variance : (H, W) array of float64
        Added to the variance of every patch.
    size : int
        Odd patch width in pixels.

    """

    background: np.ndarray
    background_cost: np.ndarray
    total: float
    mask: np.ndarray
    share: np.ndarray
    support: np.ndarray
    target: np.ndarray
    weight: np.ndarray
    least_variance: np.ndarray
    size: int
