"""The axis of a hinge: the middle of the round end that a bone turns about."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

_NEAR_MM = 30.0
"""Of the other bone, within which an end is round."""

_BIN_MM, _CAP_MM = 2.0, 16.0
_RADIUS_MM = (6.0, 40.0)


def hinge_centre(bone: np.ndarray, parent: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Centre (3,) in mm of the circle that a parent's end is round about, seen along x.

    A knee or an elbow does not turn about the middle of its surfaces, as they would run into each other, but about the
    middle of the condyles: the circle is fitted to the outline of that end.

    Parameters
    ----------
    bone, parent : (N, 3) array
        Voxel centres, LPS mm.
    contact : (3,) array
        Middle of the surfaces; it is returned where no circle of a joint's size fits.

    References
    ----------
    I. Kåsa, "A circle fitting procedure and its error analysis", IEEE Transactions on Instrumentation and
    Measurement 25, 1976.

    """
    towards = bone.mean(0) - parent.mean(0)
    towards[0] = 0.0
    length = np.linalg.norm(towards)
    distance, _ = KDTree(bone[:: max(1, len(bone) // 20_000)]).query(parent)
    near = parent[distance < distance.min() + _NEAR_MM] - contact
    if length < 1e-6 or len(near) < 50:
        return contact
    towards /= length
    across = np.cross([1.0, 0.0, 0.0], towards)
    height, along = near @ towards, np.rint((near @ across) / _BIN_MM).astype(int)
    outline = np.array([[_BIN_MM * place, height[along == place].max()] for place in np.unique(along)])
    outline = outline[outline[:, 1] > outline[:, 1].max() - _CAP_MM]
    if len(outline) < 5:
        return contact
    system = np.c_[2 * outline, np.ones(len(outline))]
    solution = np.linalg.lstsq(system, (outline**2).sum(1), rcond=None)[0]
    radius = np.sqrt(max(solution[2] + (solution[:2] ** 2).sum(), 0.0))
    if not _RADIUS_MM[0] < radius < _RADIUS_MM[1]:
        return contact
    return contact + solution[0] * across + solution[1] * towards
