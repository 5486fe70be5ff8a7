"""Warps on whole grids: displacement fields and their Jacobian, warped volumes and label maps.

Everything here takes and gives numpy arrays and works slab by slab, so that temporary memory stays small
whatever the size of the CT. Only displacement_field needs torch, and gets it from the warp.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import TYPE_CHECKING, Literal

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField, trilinear
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import require_grid, set_grid
from PolyPoseLib.warp.vote import LabelVote, grid_index

if TYPE_CHECKING:
    import SimpleITK as sitk
    from torch import Tensor

VOXELS_PER_SLAB = 1 << 20
"""Voxels or nodes that are handled at once; with about 270 bytes of temporaries each, 270 MiB."""

POINTS_PER_CHUNK = 1 << 17
"""Points that are handed to a warp at once."""

AnyWarp = DisplacementField | Callable[["Tensor"], "Tensor"]
"""A displacement field, or a warp itself (a PolyrigidWarp), which is then evaluated at every voxel: exact
inside bones, but far slower than a field of 4 mm on a CT of 0.8 mm."""

LabelMethod = Literal["nearest", "linear"]
"""The label of the nearest voxel, or the label of largest trilinear weight (smoother borders)."""


def displacement_field(
    warp: Callable[[Tensor], Tensor], affine: np.ndarray, shape: tuple[int, int, int], single: bool = True
) -> DisplacementField:
    """Displacement of a warp at the nodes of a grid.

    Parameters
    ----------
    warp : Callable[[Tensor], Tensor]
        Takes fixed points (N, 3) to moving points (N, 3), torch, LPS mm, such as a PolyrigidWarp.
    affine : (4, 4) array
        Index (i, j, k) to fixed LPS mm.
    shape : tuple[int, int, int]
        Nodes (k, j, i); see :func:`PolyPoseLib.geometry.grid.covering_grid`.
    single : bool
        Compute in float32, good to about 1e-4 mm, instead of float64.

    Returns
    -------
    DisplacementField
        warp(x) - x in mm at the nodes.

    Raises
    ------
    InputError
        The affine is not a grid of orthogonal axes.

    """
    import torch

    from PolyPoseLib.warp.fused import fused_displacements

    require_grid(affine, "the displacement field's grid")
    vectors = np.empty((*shape, 3), dtype=np.float32)
    flat = vectors.reshape(-1, 3)
    dtype = torch.float32 if single else torch.float64
    fused = fused_displacements(warp) if single else None
    with torch.no_grad():
        for start in range(0, len(flat), POINTS_PER_CHUNK):
            stop = min(start + POINTS_PER_CHUNK, len(flat))
            if fused is not None:
                flat[start:stop] = fused(flat_points(affine, shape, start, stop))
                continue
            points = torch.from_numpy(np.ascontiguousarray(flat_points(affine, shape, start, stop))).to(dtype)
            moved = warp(points)
            flat[start:stop] = (moved - points.to(moved.device)).cpu().numpy()
    return DisplacementField(vectors, affine)


def jacobian_determinant(field: DisplacementField) -> np.ndarray:
    """Jacobian determinant of x + u(x) at the nodes of a displacement field u.

    Central differences between nodes, one-sided at the border: det(A + du/d(i, j, k)) / det A with the grid's
    axes A, so that oblique and left-handed grids give the same values as straight ones.

    Parameters
    ----------
    field : DisplacementField
        Two nodes or more along every axis.

    Returns
    -------
    (k, j, i) array of float32
        No unit; 0 or less means folding.

    Raises
    ------
    InputError
        An axis has one node only.

    """
    if min(field.shape) < 2:
        raise InputError(
            f"A displacement field of {field.shape} nodes has no Jacobian: give 2 or more per axis."
        )
    axes = np.ascontiguousarray(field.affine[:3, :3], np.float64)
    determinant = np.empty(field.shape, dtype=np.float32)
    try:
        from PolyPoseLib.warp.determinant_kernel import fill_determinants
    except ImportError:
        return _determinant_in_slabs(field, axes, determinant)
    fill_determinants(np.require(field.vectors, np.float32, ["C", "W"]), axes, determinant)
    return determinant


def _determinant_in_slabs(field: DisplacementField, axes: np.ndarray, determinant: np.ndarray) -> np.ndarray:
    """:func:`jacobian_determinant` without numba; fills and returns ``determinant``."""
    last = field.shape[0]
    for slab in _slabs(field.shape):
        low, high = max(slab.start - 1, 0), min(slab.stop + 1, last)
        by_k, by_j, by_i = np.gradient(field.vectors[low:high], axis=(0, 1, 2))
        inner = slice(slab.start - low, slab.stop - low)
        along_i, along_j, along_k = (
            by[inner].astype(np.float64) + axes[:, n] for n, by in enumerate((by_i, by_j, by_k))
        )
        determinant[slab] = (_cross(along_i, along_j) * along_k).sum(axis=-1)
    return determinant / np.float32(np.linalg.det(axes))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product over the last axis, several times faster than numpy's on large arrays."""
    (a0, a1, a2), (b0, b1, b2) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def warp_volume(
    volume: Volume,
    warp: AnyWarp,
    reference: Volume | None = None,
    outside: float = AIR_HU,
) -> Volume:
    """A moving volume in the fixed frame, warped(x) = volume(warp(x)), trilinear.

    Parameters
    ----------
    volume : Volume
        Moving, of any type.
    warp : DisplacementField or callable
        Fixed to moving, LPS mm.
    reference : Volume, optional
        Gives the fixed grid; None takes the volume's own.
    outside : float
        Value where warp(x) lies beyond the volume's voxels (more than half a voxel from the outermost centres).

    Returns
    -------
    Volume
        float32 on the fixed grid.

    """
    import SimpleITK as sitk

    moving = volume.with_voxels(volume.voxels.astype(np.float32, copy=False))
    kernel = _compiled()
    if kernel is None:
        return _resample(moving, warp, reference, outside, sitk.sitkLinear)
    grid = volume if reference is None else reference
    out, voxels = np.empty(grid.shape, np.float32), np.ascontiguousarray(moving.voxels)
    for place, arguments in _through(warp, grid, volume.affine):
        kernel.warp_linear(voxels, *arguments, np.float32(outside), out[place])
    return Volume(out, grid.affine)


def warp_labels(
    labels: Volume,
    warp: AnyWarp,
    reference: Volume | None = None,
    method: LabelMethod = "linear",
) -> Volume:
    """A moving label map in the fixed frame, in its own integer type, 0 outside.

    Parameters
    ----------
    labels : Volume
        Moving, whole numbers.
    warp : DisplacementField or callable
        Fixed to moving, LPS mm.
    reference : Volume, optional
        Gives the fixed grid; None takes the labels' own.
    method : {"linear", "nearest"}
        "nearest" voxel, or "linear": the label, background included, whose mask interpolates to the largest
        value.

    Returns
    -------
    Volume
        Labels in their own integer type on the fixed grid.

    Raises
    ------
    InputError
        Labels that are not whole numbers, or an unknown method.

    """
    import SimpleITK as sitk

    if not (np.issubdtype(labels.voxels.dtype, np.integer) or labels.voxels.dtype == bool):
        raise InputError(f"Labels must be whole numbers, not {labels.voxels.dtype}: convert the label map.")
    if method == "nearest":
        return _resample(labels, warp, reference, 0, sitk.sitkNearestNeighbor)
    if method != "linear":
        raise InputError(f"The method {method!r} is not known; choose 'nearest' or 'linear'.")
    grid = labels if reference is None else reference
    kernel = _compiled()
    if kernel is not None:
        out = np.empty(grid.shape, dtype=labels.voxels.dtype)
        moving = np.ascontiguousarray(labels.voxels)
        for place, arguments in _through(warp, grid, labels.affine):
            kernel.warp_votes(moving, *arguments, out[place])
        return Volume(out, grid.affine)
    voter, to_index = LabelVote(labels.voxels), np.linalg.inv(labels.affine)
    out = np.empty(grid.shape, dtype=labels.voxels.dtype)
    for slab in _slabs(grid.shape, VOXELS_PER_SLAB // 4):
        vectors, affine = _slab_vectors(warp, grid, slab)
        index = grid_index(to_index @ affine, vectors.shape[:3]).reshape(3, -1)
        index += to_index[:3, :3] @ vectors.reshape(-1, 3).T
        out[slab] = voter(index).reshape(vectors.shape[:3])
    return Volume(out, grid.affine)


def _compiled() -> ModuleType | None:
    """The compiled loops, where numba is installed."""
    try:
        from PolyPoseLib.warp import resample_kernel
    except ImportError:
        return None
    return resample_kernel


def _through(
    warp: AnyWarp, grid: Volume, moving: np.ndarray
) -> Iterator[tuple[slice, tuple[np.ndarray, ...]]]:
    """The whole fixed grid for a field, slabs of it for any other warp, and what the compiled loops need for each.

    moving: (4, 4) affine of what is warped.
    """
    to_index = np.linalg.inv(moving)
    turn = np.ascontiguousarray(to_index[:3, :3])
    if isinstance(warp, DisplacementField):
        to_field = np.linalg.inv(warp.affine) @ grid.affine
        yield (
            slice(None),
            (np.ascontiguousarray(warp.vectors), to_field[:3], (to_index @ grid.affine)[:3], turn),
        )
        return
    for slab in _slabs(grid.shape):
        vectors, affine = _slab_vectors(warp, grid, slab)
        yield slab, (vectors, np.eye(4)[:3], (to_index @ affine)[:3], turn)


def _resample(
    volume: Volume,
    warp: AnyWarp,
    reference: Volume | None,
    outside: float,
    interpolator: int,
) -> Volume:
    """Resample a volume through a warp with SimpleITK, slab by slab of the fixed grid."""
    import SimpleITK as sitk

    grid = volume if reference is None else reference
    moving = volume.to_sitk()
    out = np.empty(grid.shape, dtype=volume.voxels.dtype)
    for slab in _slabs(grid.shape):
        vectors, affine = _slab_vectors(warp, grid, slab)
        transform = DisplacementField(vectors, affine).to_sitk_transform()
        # A transform's field has no value beyond its own nodes, and every voxel of the slab is one of them.
        warped = sitk.Resample(
            moving, _empty_image(vectors.shape[:3], affine), transform, interpolator, outside
        )
        out[slab] = sitk.GetArrayViewFromImage(warped)
    return Volume(out, grid.affine)


def _slab_vectors(warp: AnyWarp, grid: Volume, slab: slice) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (k, j, i, 3) at the voxels of a slab of a grid, and the slab's affine (4, 4)."""
    affine = grid.affine.copy()
    affine[:3, 3] += grid.affine[:3, 2] * slab.start
    shape = (slab.stop - slab.start, *grid.shape[1:])
    if not isinstance(warp, DisplacementField):
        return displacement_field(warp, affine, shape).vectors, affine
    if warp.shape == grid.shape and np.array_equal(warp.affine, grid.affine):
        return warp.vectors[slab], affine
    return _upsample(warp, affine, shape), affine


def field_on(field: DisplacementField, affine: np.ndarray, shape: tuple[int, int, int]) -> DisplacementField:
    """A field interpolated to the nodes of another grid, as its ``sample`` does but many times faster.

    Parameters
    ----------
    field : DisplacementField
        Fixed to moving.
    affine : (4, 4) array
        Index (i, j, k) of the other grid to fixed LPS mm.
    shape : tuple[int, int, int]
        Its nodes (k, j, i).

    Returns
    -------
    DisplacementField
        Trilinear between the field's nodes; beyond them the value of the nearest point.

    """
    return DisplacementField(_upsample(field, affine, shape), affine)


def _upsample(field: DisplacementField, affine: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """Displacements (k, j, i, 3) float32 on another grid; the value of the nearest point beyond the field."""
    to_index = np.linalg.inv(field.affine) @ affine
    scale = np.diag(to_index[:3, :3])
    if np.abs(to_index[:3, :3] - np.diag(scale)).max() > 1e-9:
        count = int(np.prod(shape))
        out = np.empty((count, 3), dtype=np.float32)
        for start in range(0, count, POINTS_PER_CHUNK):
            index = flat_points(to_index, shape, start, min(start + POINTS_PER_CHUNK, count))
            out[start : start + len(index)] = trilinear(field.vectors, index)
        return out.reshape(*shape, 3)
    # Parallel axes: trilinear interpolation is one linear interpolation after another along each axis.
    vectors = field.vectors
    for axis in range(3):
        column = 2 - axis
        place = scale[column] * np.arange(shape[axis]) + to_index[column, 3]
        vectors = _along(vectors, place, axis)
    return np.ascontiguousarray(vectors)


def _along(vectors: np.ndarray, place: np.ndarray, axis: int) -> np.ndarray:
    """Linear interpolation along one axis at continuous indices place (n,), clamped to the ends."""
    last = vectors.shape[axis] - 1
    place = np.clip(place, 0, last)
    low = np.minimum(place.astype(np.int64), max(last - 1, 0))
    shape = [1] * vectors.ndim
    shape[axis] = len(place)
    fraction = (place - low).astype(np.float32).reshape(shape)
    below = vectors.take(low, axis)
    above = vectors.take(np.minimum(low + 1, last), axis)
    above -= below
    above *= fraction
    above += below
    return above


def _slabs(shape: tuple[int, int, int], voxels: int | None = None) -> Iterator[slice]:
    """Slices along k of about VOXELS_PER_SLAB voxels each."""
    thickness = max((voxels or VOXELS_PER_SLAB) // (shape[1] * shape[2]), 1)
    for start in range(0, shape[0], thickness):
        yield slice(start, min(start + thickness, shape[0]))


def flat_points(affine: np.ndarray, shape: tuple[int, int, int], start: int, stop: int) -> np.ndarray:
    """LPS mm (N, 3) of the nodes start..stop of a grid in the order in which numpy lays out (k, j, i)."""
    rows, within = shape[1] * shape[2], affine.copy()
    first, last = start // rows, -(-stop // rows)
    within[:3, 3] += affine[:3, 2] * first
    points = grid_index(within, (last - first, *shape[1:])).reshape(3, -1).T
    return points[start - first * rows : stop - first * rows]


def _empty_image(shape: tuple[int, int, int], affine: np.ndarray) -> sitk.Image:
    """An image of a grid, which SimpleITK takes as the reference of a resampling."""
    import SimpleITK as sitk

    image = sitk.Image([int(n) for n in shape[::-1]], sitk.sitkUInt8)
    set_grid(image, affine)
    return image
