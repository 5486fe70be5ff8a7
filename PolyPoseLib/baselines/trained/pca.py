"""Principal components of a training set's displacement fields: the subspace in which LiftReg answers."""

from __future__ import annotations

import numpy as np

VALUES_AT_ONCE = 1 << 18
"""Values of every field that are handled at once."""


def principal_components(fields: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean and principal components of fields.

    Parameters
    ----------
    fields : (N, D) array
        One field a row; any float type, not copied as a whole.
    count : int
        Components wanted; no more than N - 1 exist.

    Returns
    -------
    mean : (D,) array of float32
        Of the fields.
    components : (K, D) array of float32
        Orthogonal, each as long as the standard deviation of the fields along it, largest first; those that explain
        nothing (less than 1e-6 of the largest) are left out.

    Notes
    -----
    From the (N, N) matrix of the fields' inner products, since a field has far more values than there are fields.

    """
    number, size = fields.shape
    mean = np.empty(size, np.float32)
    products = np.zeros((number, number))
    parts = [slice(start, min(start + VALUES_AT_ONCE, size)) for start in range(0, size, VALUES_AT_ONCE)]
    for part in parts:
        values = fields[:, part].astype(np.float64)
        mean[part] = values.mean(axis=0)
        values -= values.mean(axis=0)
        products += values @ values.T
    variances, turns = np.linalg.eigh(products / max(number - 1, 1))
    order = np.argsort(variances)[::-1][: min(count, max(number - 1, 1))]
    order = [n for n in order if variances[n] > 1e-12 * max(variances.max(), 1e-30)]
    components = np.empty((len(order), size), np.float32)
    for part in parts:
        values = fields[:, part].astype(np.float64)
        components[:, part] = turns[:, order].T @ (values - values.mean(axis=0)) / np.sqrt(max(number - 1, 1))
    return mean, components
