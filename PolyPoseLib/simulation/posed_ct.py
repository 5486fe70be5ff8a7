"""The CT of the same patient in another posture: bones moved rigidly, soft tissue by its own law in between."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import binary_opening, distance_transform_edt, find_objects, map_coordinates

from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.geometry.grid import connected_components
from PolyPoseLib.simulation.elastic import solve_elastic
from PolyPoseLib.simulation.fixed_grid import FixedGrid, room_for
from PolyPoseLib.simulation.harmonic import jacobian_determinants, solve_laplace
from PolyPoseLib.simulation.motion import apply
from PolyPoseLib.simulation.nearest import nearest_known
from PolyPoseLib.simulation.soft_motion import SoftMotion, keep_mass, node_slice

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures

BODY_HU = -400.0
_KNOWN_SHARE = 0.15
"""A node's displacement is a bone's when at least this share of its cell lies inside bone."""


@dataclass(frozen=True)
class PosedCt:
    """A CT in another posture.

    Attributes
    ----------
    grid : FixedGrid
        The grid of the fixed frame.
    hu : (k, j, i) array of float32
        On the grid.
    labels : (k, j, i) array of int16
        Structure numbers on the grid.
    nodes : (3, k, j, i) array of float32
        Displacement fixed -> moving in mm on the grid's nodes, rigid within bones.
    source_labels : (k, j, i) array, optional
        Labels of the full segmentation on the grid, when one was given.
    overlap : dict[str, float]
        {structure: share of its voxels given to another}.
    folds_percent : float
        Share of nodes outside bones whose Jacobian determinant is <= 0.

    """

    grid: FixedGrid
    hu: np.ndarray
    labels: np.ndarray
    nodes: np.ndarray
    source_labels: np.ndarray | None
    overlap: dict[str, float]
    folds_percent: float


def pose_ct(
    ct: Volume,
    structures: Structures,
    fixed_to_moving: dict[str, np.ndarray],
    source_labels: np.ndarray | None = None,
    node_mm: float = 3.0,
    pad_mm: float = 20.0,
    ends: str = "cut",
    tissue: str = "harmonic",
    soft: SoftMotion | None = None,
) -> PosedCt:
    """Move the bones of a CT rigidly and let soft tissue follow.

    A fixed voxel x belongs to bone k exactly when the moving label nearest to T_k x is k; there the CT is
    sampled at T_k x. Elsewhere it is sampled at x + u(x), u the soft tissue's between the bones; where that falls
    into a bone, the surrounding soft tissue is taken, so that no bone is seen twice.

    Parameters
    ----------
    ct : Volume
        Hounsfield units.
    structures : Structures
        Labels on the CT's grid; where two bones meet, one that stays keeps the voxel, then the earlier one.
    fixed_to_moving : dict[str, np.ndarray]
        (4, 4) per structure, LPS mm; a structure that is missing stays.
    source_labels : (k, j, i) array of integers, optional
        On the CT's grid, moved likewise.
    node_mm : float
        Distance of the nodes on which the soft tissue's equation is solved.
    pad_mm : float
        Least room around the CT's grid; it grows where a bone moves farther out.
    ends : {"cut", "continued"}
        "cut" leaves air beyond the CT, "continued" repeats its end slices.
    tissue : {"harmonic", "elastic"}
        Law of the soft tissue, see :mod:`PolyPoseLib.simulation.harmonic` and :mod:`PolyPoseLib.simulation.elastic`.
    soft : SoftMotion, optional
        Displacements that soft organs are given besides, and lungs whose density follows their volume.

    Returns
    -------
    PosedCt
        On the CT's grid, widened.

    """
    poses = [fixed_to_moving.get(name, np.eye(4)) for name in structures.names]
    grid = FixedGrid.around(ct, pad_mm, node_mm, room_for(structures, ct.affine, poses))
    labels, overlap = _place_bones(structures, ct.affine, poses, grid)
    values, known = _bone_field(labels, poses, grid)
    given, held = (values, known) if soft is None else soft.add_to(values, known, grid)
    nodes = _soft_field(given, held, ct, grid, tissue)
    determinants = jacobian_determinants(np.moveaxis(nodes, 0, -1), grid.node_affine)
    folds = 100 * float((determinants[~known] <= 0).mean()) if not known.all() else 0.0
    lungs = None if soft is None else soft.lungs
    carried = [array for array in (source_labels, lungs) if array is not None]
    hu, moved = _resample(ct, structures.labels, labels, poses, nodes, grid, carried, ends == "continued")
    if lungs is not None:
        keep_mass(hu, moved.pop(), determinants, grid)
    return PosedCt(grid, hu, labels, nodes, moved[0] if moved else None, overlap, folds)


def _place_bones(
    structures: Structures, affine: np.ndarray, poses: list[np.ndarray], grid: FixedGrid
) -> tuple[np.ndarray, dict[str, float]]:
    """Structure numbers on the fixed grid, and per structure the share lost to those before it."""
    fixed = np.zeros(grid.shape, np.int16)
    overlap = {}
    boxes = find_objects(structures.labels, max_label=len(structures.names))
    still_first = sorted(range(len(poses)), key=lambda n: not np.allclose(poses[n], np.eye(4)))
    for name, number, box, pose in ((structures.names[n], n + 1, boxes[n], poses[n]) for n in still_first):
        if box is None:
            continue
        low = np.array([part.start for part in box][::-1]) - 1.0
        high = np.array([part.stop for part in box][::-1], dtype=np.float64)
        corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), -1).reshape(8, 3)
        inside = apply(np.linalg.inv(grid.affine) @ np.linalg.inv(pose) @ affine, corners)[:, ::-1]
        start = np.maximum(np.floor(inside.min(0)).astype(int), 0)
        stop = np.minimum(np.ceil(inside.max(0)).astype(int) + 1, grid.shape)
        if np.any(stop <= start):
            continue
        region = tuple(slice(a, b) for a, b in zip(start, stop, strict=True))
        index = _affine_indices(np.linalg.inv(affine) @ pose @ grid.affine, start, stop)
        mine = _nearest(structures.labels, index) == number
        taken = mine & (fixed[region] > 0)
        fixed[region][mine & ~taken] = number
        overlap[name] = float(taken.sum() / max(mine.sum(), 1))
    return fixed, overlap


def _soft_field(
    values: np.ndarray, known: np.ndarray, ct: Volume, grid: FixedGrid, tissue: str
) -> np.ndarray:
    """Displacement (3, k, j, i) LPS mm on the nodes from that of the bones."""
    spacing = np.linalg.norm(grid.node_affine[:3, :3], axis=0)[::-1]
    if tissue == "harmonic":
        return solve_laplace(values, known, spacing)
    axes = grid.node_affine[:3, :3] / spacing[::-1]
    along = np.tensordot(axes.T, values, 1).astype(np.float32)
    return np.tensordot(axes, solve_elastic(along, known, _body(ct, grid), spacing), 1).astype(np.float32)


def _body(ct: Volume, grid: FixedGrid) -> np.ndarray:
    """(k, j, i) nodes in the body: the largest piece of the CT that is not air, as it lay in the CT."""
    pieces, _count = connected_components(binary_opening(ct.voxels > BODY_HU))
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    body = (pieces == sizes.argmax()).astype(np.float32)
    index = np.stack(np.meshgrid(*map(np.arange, grid.node_shape), indexing="ij")).astype(np.float64)
    voxel = index * np.reshape(grid.factor, (3, 1, 1, 1)) - np.reshape(grid.pad, (3, 1, 1, 1))
    return map_coordinates(body, voxel, order=1) > 0.5


def _bone_field(
    labels: np.ndarray, poses: list[np.ndarray], grid: FixedGrid
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement (3, k, j, i) of the bones on the nodes, and where (k, j, i) it is one's."""
    voxels = np.argwhere(labels > 0)
    numbers = labels[tuple(voxels.T)].astype(np.int64) - 1
    cells = np.ravel_multi_index(((voxels + np.array(grid.factor) // 2) // grid.factor).T, grid.node_shape)
    count = len(poses)
    keys, hits = np.unique(cells * count + numbers, return_counts=True)
    cell, bone = keys // count, keys % count
    order = np.lexsort((hits, cell))
    last = np.r_[cell[order][1:] != cell[order][:-1], True]
    total = np.bincount(np.unique(cell, return_inverse=True)[1], weights=hits)
    winner_cell, winner = cell[order][last], bone[order][last]
    enough = total >= _KNOWN_SHARE * np.prod(grid.factor)
    winner_cell, winner = winner_cell[enough], winner[enough]
    known = np.zeros(grid.node_shape, bool)
    values = np.zeros((3, *grid.node_shape), np.float32)
    kji = np.stack(np.unravel_index(winner_cell, grid.node_shape), axis=1)
    points = apply(grid.node_affine, kji[:, ::-1].astype(np.float64))
    known[tuple(kji.T)] = True
    for number, pose in enumerate(poses):
        mine = winner == number
        values[(slice(None), *kji[mine].T)] = (apply(pose, points[mine]) - points[mine]).T
    return values, known


def _resample(
    ct: Volume,
    moving_labels: np.ndarray,
    fixed_labels: np.ndarray,
    poses: list[np.ndarray],
    nodes: np.ndarray,
    grid: FixedGrid,
    carried: list[np.ndarray],
    continued: bool,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """CT and label maps on the fixed grid, one slab of slices after another."""
    hu = np.empty(grid.shape, np.float32)
    moved = [np.zeros(grid.shape, source.dtype) for source in carried]
    to_moving = np.linalg.inv(ct.affine)
    fill = _soft_fill(ct, moving_labels, grid.factor)
    for k in range(grid.shape[0]):
        index = _affine_indices(to_moving @ grid.affine, (k, 0, 0), (k + 1, *grid.shape[1:]))
        index += np.tensordot(to_moving[:3, :3], node_slice(nodes, k, grid), axes=1)[::-1, None]
        if continued:
            np.clip(index[0], 0, ct.shape[0] - 1, out=index[0])
        here = fixed_labels[k : k + 1]
        into_bone = (_nearest(moving_labels, index) > 0) & (here == 0)
        for number in np.unique(here[here > 0]):
            mine = np.nonzero(here == number)
            points = np.stack([mine[2], mine[1], mine[0] + k], axis=1).astype(np.float64)
            index[(slice(None), *mine)] = apply(to_moving @ poses[number - 1] @ grid.affine, points)[
                :, ::-1
            ].T
        hu[k] = map_coordinates(ct.voxels, index, order=1, cval=AIR_HU, output=np.float32)[0]
        if into_bone.any():
            at = index[:, into_bone] / np.array(grid.factor)[:, None]
            hu[k][into_bone[0]] = map_coordinates(fill, at, order=1, mode="nearest")
        for source, out in zip(carried, moved, strict=True):
            out[k] = np.where(into_bone, 0, _nearest(source, index))[0]
    return hu, moved


def _soft_fill(ct: Volume, labels: np.ndarray, factor: tuple[int, int, int]) -> np.ndarray:
    """Soft tissue in the bones' place: every factor-th voxel, in bones that of the nearest outside."""
    step = tuple(slice(None, None, f) for f in factor)
    bone = labels[step] > 0
    grown = bone | (np.asarray(distance_transform_edt(~bone, sampling=factor * ct.spacing[::-1])) < 2.5)
    return np.minimum(ct.voxels[step], 150)[nearest_known(grown)].astype(np.float32)


def _affine_indices(matrix: np.ndarray, start: Iterable[int], stop: Iterable[int]) -> np.ndarray:
    """Map the indices [start, stop) in (k, j, i) by a (4, 4) on (i, j, k); gives (3, k, j, i)."""
    k, j, i = (np.arange(a, b, dtype=np.float64) for a, b in zip(start, stop, strict=True))
    rows = [
        matrix[row, 0] * i[None, None, :]
        + matrix[row, 1] * j[None, :, None]
        + matrix[row, 2] * k[:, None, None]
        + matrix[row, 3]
        for row in (2, 1, 0)
    ]
    return np.stack(rows)


def _nearest(labels: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Labels at continuous indices (3, ...) in (k, j, i); 0 outside."""
    near = np.rint(index).astype(np.int32)
    limits = np.array(labels.shape).reshape(3, *[1] * (index.ndim - 1))
    inside = np.all((near >= 0) & (near < limits), axis=0)
    np.clip(near, 0, limits - 1, out=near)
    return np.where(inside, labels[tuple(near)], 0).astype(labels.dtype)
