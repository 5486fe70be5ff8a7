"""Harmonic interpolation: soft tissue between rigidly moved bones as the solution of Laplace's equation.

The displacement is given at the bones, has zero normal derivative at the box and is harmonic in between,
which is independent of the registration's distance-weighted blending of rigid motions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_COARSEST_NODES = 16
_COARSEST_ITERATIONS = 400


def solve_laplace(
    values: np.ndarray,
    known: np.ndarray,
    spacing: np.ndarray,
    tolerance: float = 1e-3,
    iterations: int = 80,
) -> np.ndarray:
    """Extend a vector field harmonically from the nodes where it is known to the whole grid.

    Cascadic multigrid: solved on a coarse grid first, each solution being the next finer grid's initial one, with
    conjugate gradients on every level.

    Parameters
    ----------
    values : (C, k, j, i) array of float32
        Read at known nodes only.
    known : (k, j, i) array of bool
        Where the field is known.
    spacing : (3,) array
        Node distance along (k, j, i) in mm.
    tolerance : float
        Residual relative to that of the field which is zero where unknown.
    iterations : int
        Limit of conjugate-gradient steps per level, the coarsest excepted.

    Returns
    -------
    (C, k, j, i) array of float32
        Equal to values where known; zero everywhere when nothing is known.

    References
    ----------
    F. Bornemann and P. Deuflhard, "The cascadic multigrid method for elliptic problems", Numerische Mathematik 75,
    1996.

    """
    spacing = np.asarray(spacing, dtype=np.float64)
    if not known.any():
        return np.zeros_like(values, dtype=np.float32)
    start = None
    if min(known.shape) >= 2 * _COARSEST_NODES:
        coarse_values, coarse_known = _restrict(values, known)
        coarse = solve_laplace(coarse_values, coarse_known, 2 * spacing, tolerance, iterations)
        start = _prolong(coarse, known.shape)
    else:
        iterations = _COARSEST_ITERATIONS
    return _conjugate_gradient(values, known, spacing, start, tolerance, iterations)


def _conjugate_gradient(
    values: np.ndarray,
    known: np.ndarray,
    spacing: np.ndarray,
    start: np.ndarray | None,
    tolerance: float,
    iterations: int,
) -> np.ndarray:
    """Conjugate gradients for every component at once on the unknown nodes."""
    weights = tuple(float(w) for w in (1 / spacing**2) / np.max(1 / spacing**2))
    free = ~known
    field = np.where(known, values, 0).astype(np.float32)
    scale = _dot(_negative_laplacian(field, weights) * free) ** 0.5
    if start is not None:
        field = np.where(known, field, start).astype(np.float32)
    residual = -_negative_laplacian(field, weights) * free
    direction = residual.copy()
    energy = _dot(residual)
    for _ in range(iterations):
        if np.all(energy**0.5 <= tolerance * np.maximum(scale, 1e-12)):
            break
        image = _negative_laplacian(direction, weights) * free
        curvature = _dot(direction, image)
        step = np.where(curvature > 0, energy / np.where(curvature > 0, curvature, 1), 0).astype(np.float32)
        field += step[:, None, None, None] * direction
        residual -= step[:, None, None, None] * image
        fresh = _dot(residual)
        ratio = np.where(energy > 0, fresh / np.where(energy > 0, energy, 1), 0).astype(np.float32)
        direction *= ratio[:, None, None, None]
        direction += residual
        energy = fresh
    return field


def _negative_laplacian(field: np.ndarray, weights: Sequence[float]) -> np.ndarray:
    """Seven-point operator on (C, k, j, i), zero normal derivative at the faces; weights along (k, j, i)."""
    out = np.zeros_like(field)
    for axis, weight in enumerate(weights, start=1):
        if field.shape[axis] < 2:
            continue
        step = np.diff(field, axis=axis)
        step *= np.float32(weight)
        low = [slice(None)] * 4
        high = [slice(None)] * 4
        low[axis], high[axis] = slice(0, -1), slice(1, None)
        out[tuple(low)] -= step
        out[tuple(high)] += step
    return out


def _dot(a: np.ndarray, b: np.ndarray | None = None) -> np.ndarray:
    """Scalar product per component, (C,) float64."""
    b = a if b is None else b
    return np.array([np.dot(x.ravel(), y.ravel()) for x, y in zip(a, b, strict=True)], dtype=np.float64)


def _restrict(values: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every other node; known where any node of its 2x2x2 block is, with the mean of what is known there."""
    pad = [(0, n % 2) for n in known.shape]
    known = np.pad(known, pad)
    masked = np.where(known, np.pad(values, [(0, 0), *pad]), 0).astype(np.float32)
    shape = tuple(n // 2 for n in known.shape)
    blocks = (shape[0], 2, shape[1], 2, shape[2], 2)
    count = known.reshape(blocks).sum(axis=(1, 3, 5))
    total = masked.reshape(len(values), *blocks).sum(axis=(2, 4, 6))
    return total / np.maximum(count, 1).astype(np.float32), count > 0


def _prolong(coarse: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Linear interpolation to twice the nodes; coarse node n is the middle of fine nodes 2n and 2n + 1."""
    for axis, count in enumerate(shape, start=1):
        coarse = interpolate_axis(coarse, (np.arange(count) - 0.5) / 2, axis)
    return coarse


def interpolate_axis(field: np.ndarray, position: np.ndarray, axis: int) -> np.ndarray:
    """Linear interpolation along one axis at fractional indices (N,), clamped to the ends."""
    last = field.shape[axis] - 1
    position = np.clip(position, 0, last)
    low = np.minimum(position.astype(np.int64), max(last - 1, 0))
    shape = [1] * field.ndim
    shape[axis] = len(position)
    weight = (position - low).astype(np.float32).reshape(shape)
    lower = np.take(field, low, axis=axis)
    upper = np.take(field, np.minimum(low + 1, last), axis=axis)
    return lower + weight * (upper - lower)


def jacobian_determinants(vectors: np.ndarray, affine: np.ndarray) -> np.ndarray:
    """Determinants of the map x -> x + u(x) by central differences.

    Parameters
    ----------
    vectors : (k, j, i, 3) array
        mm in world axes.
    affine : (4, 4) array
        Index (i, j, k) to mm.

    Returns
    -------
    (k, j, i) array

    """
    single = vectors.astype(np.float32)
    by_index = np.stack([np.gradient(single, axis=axis) for axis in (2, 1, 0)], axis=-1)
    gradient = by_index @ np.linalg.inv(affine[:3, :3]).astype(np.float32)
    return np.linalg.det(np.eye(3, dtype=np.float32) + gradient)
