"""What the compiled loop over the soft tissue's rays takes as arguments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class SegmentedRays(NamedTuple):
    """Rays of all P pixels, cut into segments that begin at the same distances from the source.

    Attributes
    ----------
    source : (3,) array
        LPS mm.
    directions : (P, 3) array
        Of length 1.
    near, far : (P,) array
        Distances (mm) between which a ray crosses the tissue; the same where it does not.
    first : float
        Where the first segment begins.
    step_mm : float
        Distance of samples.
    per_segment : int
        Samples.
    negligible : float
        Gradient over a segment, 1/mm, up to which it counts as none.

    """

    source: np.ndarray
    directions: np.ndarray
    near: np.ndarray
    far: np.ndarray
    first: float
    step_mm: float
    per_segment: int
    negligible: float


class DisplacedTissue(NamedTuple):
    """The soft tissue and the field that displaces it.

    Attributes
    ----------
    to_node : (3, 4) array
        Fixed LPS mm to the field's index (i, j, k).
    vectors : (k, j, i, 3) array
        Fixed to moving, mm.
    freedom : (k, j, i) array
        Share of the modes.
    to_index : (3, 4) array
        Moving LPS mm to the voxels' index.
    gradient : (D, H, W, 3) array
        1/mm^2.

    """

    to_node: np.ndarray
    vectors: np.ndarray
    freedom: np.ndarray
    to_index: np.ndarray
    gradient: np.ndarray


class CosineTables(NamedTuple):
    """to_angles: (3, 4), LPS mm to the angles of the first cosines (rad); numbers: (M, 3) multiples of each mode."""

    to_angles: np.ndarray
    numbers: np.ndarray
