"""One structure's weight before normalisation, for compiled loops (numba)."""

import numba
import numpy as np

_float = np.float32


MASS, EPSILON, RIGID = 0, 1, 2
"""Numbers of the weight forms, in the order of ``weights.WeightForm``."""


@numba.njit(fastmath=True)
def raw_weight(form, share, distance, constant):
    """As ``weights.weights`` before normalisation; constant is epsilon ("epsilon") or delta^2 ("rigid")."""
    squared = distance * distance
    if form == MASS:
        return share / (np.float32(1) + squared)
    if form == EPSILON:
        return np.float32(1) / (np.float32(1) + constant * squared)
    return share / (constant + squared)


@numba.njit(fastmath=True)
def _relative_slope(form, distance, constant):
    """f'(d) / f(d) of the weight forms."""
    squared = distance * distance
    if form == MASS:
        return -_float(2) * distance / (_float(1) + squared)
    if form == EPSILON:
        return -_float(2) * constant * distance / (_float(1) + constant * squared)
    return -_float(2) * distance / (constant + squared)
