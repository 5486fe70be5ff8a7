"""A displacement field fitted to the bones' own motions, which interpolation between its nodes blurs at their edges.

Between a node in a bone and the next one beyond it, often in another bone, interpolation mixes two motions: at joint
surfaces the field then misses a bone's own motion by a millimetre and more. The nodes around bones are therefore moved
a little so that the interpolated field agrees with the bones' motions at their voxels, in the least-squares sense.
Places that two bones claim, because their motions bring them together, are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField, trilinear
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.grid import bounding_box, grown_box
from PolyPoseLib.warp.dense import jacobian_determinant
from PolyPoseLib.warp.unfold import LEAST_DETERMINANT

if TYPE_CHECKING:
    import torch

SAMPLES_PER_NODE = 2.0
"""Voxels of bones are thinned to this many along each side of the field's cells, at least."""

TOLERANCE_MM = 0.02
"""Cells in which the field agrees better than this with the bones are left alone."""

STIFFNESS = 0.02
"""Weight that holds a node in its place, against 1 of a voxel that pulls it."""

ITERATIONS = 60
"""Of the conjugate gradients."""

ROUNDS = 12
"""Times that the change is lessened where it folds the field, before the field stays as it was."""


@dataclass(frozen=True)
class _Samples:
    """Points of bones: index: (N, 3) in the field's nodes; displacement: (N, 3) mm, by their bones' motions."""

    index: np.ndarray
    displacement: np.ndarray


def fitted_to_bones(
    field: DisplacementField, labels: Volume, poses: np.ndarray, device: torch.device | None = None
) -> DisplacementField:
    """The field with nodes moved so that it agrees with the bones' motions inside bones.

    Parameters
    ----------
    field : DisplacementField
        Fixed to moving.
    labels : Volume
        Structures 1 to K in the CT.
    poses : (K, 4, 4) array
        Fixed to moving, LPS mm.
    device : torch.device, optional
        Where torch looks for folds; None for compiled loops where numba is installed.

    Returns
    -------
    DisplacementField
        On the same nodes; the field itself where it agrees with all bones.

    """
    from scipy.sparse import csr_matrix, identity
    from scipy.sparse.linalg import cg

    if min(field.shape) < 2:
        return field
    samples = _bone_samples(field, labels, poses)
    miss = samples.displacement - trilinear(field.vectors, samples.index)
    bad = np.linalg.norm(miss, axis=1) > TOLERANCE_MM
    if not bad.any():
        return field
    nodes = np.unique(_corners(samples.index[bad], field.shape)[0])
    column = np.full(int(np.prod(field.shape)), -1)
    column[nodes] = np.arange(len(nodes))
    rows = np.flatnonzero(_in_cells_at(column.reshape(field.shape) >= 0, samples.index))
    cell, weight = _corners(samples.index[rows], field.shape)
    where = np.nonzero((column[cell] >= 0) & (weight > 0))
    matrix = csr_matrix((weight[where], (where[0], column[cell[where]])), shape=(len(rows), len(nodes)))
    normal = matrix.T @ matrix + STIFFNESS * identity(len(nodes))
    change = np.zeros_like(field.vectors)
    for axis in range(3):
        found, _ = cg(normal, matrix.T @ miss[rows, axis], maxiter=ITERATIONS)
        change.reshape(-1, 3)[nodes, axis] = found
    return _without_new_folds(field, change, device)


def _without_new_folds(
    field: DisplacementField, change: np.ndarray, device: torch.device | None
) -> DisplacementField:
    """The field with the change (k, j, i, 3) in mm added, less of it where it would fold the field."""
    from scipy.ndimage import binary_dilation

    folded_before = jacobian_determinant(field, device) <= LEAST_DETERMINANT
    changed = DisplacementField(field.vectors + change, field.affine)
    folded = (jacobian_determinant(changed, device) <= LEAST_DETERMINANT) & ~folded_before
    for number in range(ROUNDS):
        if not folded.any():
            break
        reach = 1 + number // 4
        tight = bounding_box(folded)
        assert tight is not None
        box = grown_box(tight, reach + 2, folded.shape)
        around = np.asarray(binary_dilation(folded[box], iterations=reach), dtype=bool)
        change[box][around] *= 0.7 if number < ROUNDS - 1 else 0.0
        changed.vectors[box] = field.vectors[box] + change[box]
        part = DisplacementField(changed.vectors[box], field.affine)
        still = (jacobian_determinant(part, device) <= LEAST_DETERMINANT) & ~folded_before[box]
        for axis, (side, size) in enumerate(zip(box, folded.shape, strict=True)):
            # One-sided where the box is cut, but there nothing changed and nothing was folded.
            layers = np.moveaxis(still, axis, 0)
            layers[0] &= side.start == 0
            layers[-1] &= side.stop == size
        folded[box] = still
    return field if folded.any() else changed


def _bone_samples(field: DisplacementField, labels: Volume, poses: np.ndarray) -> _Samples:
    """Voxels of every bone in its fixed place that no other bone claims as well."""
    i, j, k = (max(1, int(field.spacing.min() / SAMPLES_PER_NODE / each)) for each in labels.spacing)
    thinned = labels.voxels[::k, ::j, ::i]
    inner = np.argwhere(thinned > 0)
    owner = thinned[tuple(inner.T)].astype(np.int64) - 1
    moving = labels.to_world(inner[:, ::-1] * [i, j, k])
    fixed = np.empty_like(moving)
    for n, pose in enumerate(poses):
        mine = owner == n
        fixed[mine] = (moving[mine] - pose[:3, 3]) @ pose[:3, :3]
    alone = np.ones(len(owner), bool)
    for n, pose in enumerate(poses):
        others = np.flatnonzero(alone & (owner != n))
        place = fixed[others] @ pose[:3, :3].T + pose[:3, 3]
        alone[others[labels.voxels_at(labels.to_index(place), 0) == n + 1]] = False
    to_nodes = np.linalg.inv(field.affine)
    index = fixed @ to_nodes[:3, :3].T + to_nodes[:3, 3]
    within = alone & ((index >= 0) & (index <= np.array(field.shape[::-1]) - 1)).all(axis=1)
    return _Samples(index[within], (moving - fixed)[within])


def _in_cells_at(nodes: np.ndarray, index: np.ndarray) -> np.ndarray:
    """(N,) whether places (N, 3) in (i, j, k) lie in cells of which a corner is among the nodes (k, j, i) bool."""
    cells = nodes.copy()
    for axis in range(3):
        along = np.moveaxis(cells, axis, 0)
        along[:-1] |= along[1:]
    i, j, k = index.astype(np.int64).T
    return cells[k, j, i]


def _corners(index: np.ndarray, shape: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """(N, 8) flat numbers of the nodes around places (N, 3) in (i, j, k), and their trilinear weights."""
    low = np.minimum(index.astype(np.int64), np.maximum(np.array(shape[::-1]) - 2, 0))
    part = index - low
    stride = np.array([1, shape[2], shape[1] * shape[2]])
    cells, weights = [], []
    for corner in np.ndindex(2, 2, 2):
        step = np.array(corner)
        reach = np.minimum(low + step, np.array(shape[::-1]) - 1)
        cells.append(reach @ stride)
        weights.append(np.where(step, part, 1 - part).prod(axis=1))
    return np.stack(cells, axis=1), np.stack(weights, axis=1)
