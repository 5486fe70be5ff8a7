"""The inverse of a displacement field, and how well it inverts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import require_grid
from PolyPoseLib.warp.field_grids import flat_points

if TYPE_CHECKING:
    import torch

POINTS_AT_ONCE = 1 << 20
"""Nodes that are inverted at once."""

LEAST_STEP = 1e-3
"""Share of the error that is corrected at once, below which a point has no inverse."""


@dataclass(frozen=True)
class InverseField:
    """An inverse field and how well it inverts.

    Attributes
    ----------
    field : DisplacementField
        Moving to fixed.
    residual_mm : (k, j, i) array of float32
        Distance of warp(inverse(y)) from y at its nodes.

    """

    field: DisplacementField
    residual_mm: np.ndarray

    @property
    def largest_residual_mm(self) -> float:
        """Largest residual over all nodes in mm."""
        return float(self.residual_mm.max())


def invert_field(
    field: DisplacementField,
    affine: np.ndarray | None = None,
    shape: tuple[int, int, int] | None = None,
    tolerance_mm: float = 1e-3,
    iterations: int = 100,
    device: torch.device | None = None,
) -> InverseField:
    """Inverse of a displacement field by fixed-point iteration.

    At every node y, v <- v - s (v + u(y + v)), starting from v = -u(y), until the residual |v + u(y + v)| is
    below tolerance_mm. The step s starts at 1 and is halved at nodes whose residual grew, so that the
    iteration also converges where the field stretches a lot.

    Parameters
    ----------
    field : DisplacementField
        u, fixed to moving.
    affine : (4, 4) array, optional
        Grid of the inverse in the moving frame; None takes the field's own.
    shape : tuple[int, int, int], optional
        Its nodes (k, j, i); needed with affine.
    tolerance_mm : float
        Residual at which a node is done.
    iterations : int
        At most so many.
    device : torch.device, optional
        Where torch inverts it; None for compiled loops where numba is installed.

    Returns
    -------
    InverseField
        The inverse and the residual at every node. Where a field folds, or beyond what it covers, there is no
        inverse and the residual says so.

    Raises
    ------
    InputError
        Only one of affine and shape, or an affine that is not a grid.

    References
    ----------
    M. Chen et al., "A simple fixed-point approach to invert a deformation field", Medical Physics 2008.

    """
    if (affine is None) != (shape is None):
        raise InputError("The grid of an inverse field needs both affine and shape.")
    affine = field.affine if affine is None else np.asarray(affine, dtype=np.float64)
    shape = field.shape if shape is None else shape
    require_grid(affine, "the inverse field's grid")
    vectors = np.empty((*shape, 3), dtype=np.float32)
    residual = np.empty(shape, dtype=np.float32)
    flat_vectors, flat_residual = vectors.reshape(-1, 3), residual.reshape(-1)
    invert = partial(invert_at, field) if device is None else _inverter_on(device, field)
    for start in range(0, flat_residual.size, POINTS_AT_ONCE):
        part = slice(start, min(start + POINTS_AT_ONCE, flat_residual.size))
        points = flat_points(affine, shape, part.start, part.stop)
        flat_vectors[part], flat_residual[part] = invert(points, tolerance_mm, iterations)
    return InverseField(DisplacementField(vectors, affine), residual)


def invert_at(
    field: DisplacementField, points: np.ndarray, tolerance_mm: float = 1e-3, iterations: int = 100
) -> tuple[np.ndarray, np.ndarray]:
    """Inverse displacements (N, 3) at moving points (N, 3), and their residuals (N,) in mm; see invert_field."""
    try:
        from PolyPoseLib.warp.inverse_kernel import invert
    except ImportError:  # numba is not installed
        return invert_without_kernel(field, points, tolerance_mm, iterations)
    points = np.ascontiguousarray(points, dtype=np.float64)
    out, residual = np.empty_like(points), np.empty(len(points))
    to_nodes = np.ascontiguousarray(np.linalg.inv(field.affine)[:3])
    vectors = np.ascontiguousarray(field.vectors)
    invert(points, vectors, to_nodes, tolerance_mm, iterations, LEAST_STEP, out, residual)
    return out, residual


def _inverter_on(
    device: torch.device, field: DisplacementField
) -> Callable[[np.ndarray, float, int], tuple[np.ndarray, np.ndarray]]:
    """:func:`invert_at` of a field that is copied to a device once."""
    import torch

    from PolyPoseLib.warp.torch_inverse import TorchField

    placed = TorchField(field, device)

    def invert(points: np.ndarray, tolerance_mm: float, iterations: int) -> tuple[np.ndarray, np.ndarray]:
        places = torch.as_tensor(points, device=device)
        shift, residual = placed.inverse_at(places, tolerance_mm, iterations, LEAST_STEP)
        return shift.cpu().numpy(), residual.cpu().numpy()

    return invert


def invert_without_kernel(
    field: DisplacementField, points: np.ndarray, tolerance_mm: float, iterations: int
) -> tuple[np.ndarray, np.ndarray]:
    """The same in numpy, some ten times slower."""
    inverse = -field.sample(points)
    kept, error = inverse.copy(), np.zeros_like(inverse)
    best = np.full(len(points), np.inf)
    step = np.ones(len(points))
    active = np.arange(len(points))
    for _ in range(iterations):
        offset = inverse[active] + field.sample(points[active] + inverse[active])
        size = np.linalg.norm(offset, axis=1)
        better = size < best[active]
        step[active[~better]] *= 0.5
        improved = active[better]
        best[improved], kept[improved], error[improved] = size[better], inverse[improved], offset[better]
        active = active[(best[active] > tolerance_mm) & (step[active] > LEAST_STEP)]
        if not len(active):
            break
        inverse[active] = kept[active] - step[active, None] * error[active]
    return kept, best
