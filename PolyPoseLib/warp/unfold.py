"""Folds taken out of a displacement field: soft tissue between bones that slide past each other, smoothed.

A weighted mean of motions may fold where two bones close a gap faster than tissue between them can follow. Around every
fold the displacement is relaxed towards that of its neighbours (Jacobi's iteration for Laplace's equation), bones and
what touches them excepted, in a region that grows until no fold is left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import binary_dilation, find_objects

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.geometry.grid import connected_components, grown_box
from PolyPoseLib.warp.dense import jacobian_determinant

if TYPE_CHECKING:
    import torch

LEAST_DETERMINANT = 0.05
"""Jacobian determinants are brought above this; at 0 tissue would vanish."""

ROUNDS, SWEEPS = 40, 10
"""Rounds per fold at most, and sweeps in each."""

ROUNDS_PER_NODE = 4
"""Rounds after which the region around a fold grows by a node."""

MARGIN_NODES = 14
"""Nodes around a fold that are looked at; the outermost do not move."""


def unfolded(
    field: DisplacementField,
    held: Callable[[np.ndarray], np.ndarray],
    device: torch.device | None = None,
) -> DisplacementField:
    """The field with every fold smoothed away that can be without moving what is held.

    Parameters
    ----------
    field : DisplacementField
        Fixed to moving.
    held : Callable[[np.ndarray], np.ndarray]
        Takes fixed points (N, 3) LPS mm and returns (N,) whether their displacement must stay.
    device : torch.device, optional
        Where torch looks for folds; None for compiled loops where numba is installed. What is around a fold is a
        small part of the field, and relaxed on the CPU.

    Returns
    -------
    DisplacementField
        On the same nodes; the field itself when it has no fold.

    """
    if min(field.shape) < 3:
        return field
    folded = jacobian_determinant(field, device) <= LEAST_DETERMINANT
    if not folded.any():
        return field
    vectors = field.vectors.copy()
    for box in _boxes(folded):
        part = DisplacementField(vectors[box], _moved_origin(field.affine, box))
        vectors[box] = _relaxed(part, ~held(_nodes(part)).reshape(part.shape))
    return DisplacementField(vectors, field.affine)


def _relaxed(part: DisplacementField, free: np.ndarray) -> np.ndarray:
    """Vectors (k, j, i, 3) of a part of the field after its folds were relaxed; free: (k, j, i) nodes that may move."""
    free = free.copy()
    for axis in range(3):
        edge = np.moveaxis(free, axis, 0)
        edge[0] = edge[-1] = False
    vectors = part.vectors.copy()
    for number in range(ROUNDS):
        folded = jacobian_determinant(DisplacementField(vectors, part.affine)) <= LEAST_DETERMINANT
        if not folded.any():
            break
        region = binary_dilation(folded, iterations=2 + number // ROUNDS_PER_NODE) & free
        index = np.nonzero(region)
        for _ in range(SWEEPS):
            vectors[index] = _mean_of_neighbours(vectors, index)
    return vectors


def _mean_of_neighbours(vectors: np.ndarray, index: tuple[np.ndarray, ...]) -> np.ndarray:
    """Mean (N, 3) over the six neighbours of nodes, none of which lies at the border."""
    total = np.zeros((len(index[0]), 3), np.float32)
    for axis in range(3):
        for step in (-1, 1):
            total += vectors[tuple(part + step * (n == axis) for n, part in enumerate(index))]
    return total / 6


def _boxes(folded: np.ndarray) -> Iterator[tuple[slice, ...]]:
    """Boxes around the folds, with a margin; folds that are near each other share one."""
    apart, _count = connected_components(binary_dilation(folded, iterations=MARGIN_NODES // 2))
    for box in find_objects(apart):
        yield grown_box(box, MARGIN_NODES // 2, folded.shape)


def _moved_origin(affine: np.ndarray, box: tuple[slice, ...]) -> np.ndarray:
    """Affine of a box (k, j, i) of a grid."""
    moved = affine.copy()
    moved[:3, 3] += affine[:3, :3] @ [side.start for side in reversed(box)]
    return moved


def _nodes(field: DisplacementField) -> np.ndarray:
    """(N, 3) LPS mm of a field's nodes in the order of its vectors."""
    index = np.argwhere(np.ones(field.shape, bool))[:, ::-1]
    return index @ field.affine[:3, :3].T + field.affine[:3, 3]
