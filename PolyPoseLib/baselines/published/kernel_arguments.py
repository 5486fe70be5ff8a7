"""What the compiled loops take as one argument. As a "kernel" file, a change of it makes cached code stale."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class WeightField(NamedTuple):
    """What gives the K structures' weights at a point.

    Attributes
    ----------
    maps : (K, d, h, w) array of float32
        Signed distances in mm, 2 nodes or more along every axis.
    to_grid : (3, 4) array of float32
        mm relative to the logarithms' centre to the maps' index.
    spacing : (3,) array of float32
        mm along (i, j, k).
    share : (K,) array of float32
        Of the structures in the volume of all.
    form : int
        Number of the weight form, see raw_weight.
    constant : float32
        Of the weight form, see raw_weight.

    """

    maps: np.ndarray
    to_grid: np.ndarray
    spacing: np.ndarray
    share: np.ndarray
    form: int
    constant: np.float32


class RayBlocks(NamedTuple):
    """R rays whose samples are computed in blocks of LANES.

    Attributes
    ----------
    blocks : (R + 1,) array of int64
        Numbers of the rays' first blocks; the last is the total.
    first, step : (R, 3) array of float32
        mm relative to the logarithms' centre: the first sample, and the vector to the next one.
    counts : (R,) array of int32
        Samples of each ray.
    step_mm : float
        Length of a step.

    """

    blocks: np.ndarray
    first: np.ndarray
    step: np.ndarray
    counts: np.ndarray
    step_mm: float
