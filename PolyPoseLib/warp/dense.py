"""Warps on whole grids: displacement fields and their Jacobian, warped volumes and label maps.

Everything here takes and gives numpy arrays and works slab by slab, so that temporary memory stays small
whatever the size of the CT. Only displacement_field needs torch, and gets it from the warp.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import TYPE_CHECKING, Literal

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import require_grid, set_grid
from PolyPoseLib.warp.field_grids import POINTS_PER_CHUNK, field_on, flat_points
from PolyPoseLib.warp.vote import LabelVote, grid_index

if TYPE_CHECKING:
    import SimpleITK as sitk
    import torch
    from torch import Tensor

    from PolyPoseLib.warp.torch_resample import TorchResampling

VOXELS_PER_SLAB = 1 << 20
"""Voxels or nodes that are handled at once; with about 270 bytes of temporaries each, 270 MiB."""

AnyWarp = DisplacementField | Callable[["Tensor"], "Tensor"]
"""A displacement field, or a warp itself (a PolyrigidWarp), which is then evaluated at every voxel: exact
inside bones, but far slower than a field of 4 mm on a CT of 0.8 mm."""

LabelMethod = Literal["nearest", "linear"]
"""The label of the nearest voxel, or the label of largest trilinear weight (smoother borders)."""


def displacement_field(
    warp: Callable[[Tensor], Tensor],
    affine: np.ndarray,
    shape: tuple[int, int, int],
    single: bool = True,
    device: torch.device | None = None,
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
    device : torch.device, optional
        Where torch makes the points and the warp, such as a PolyrigidWarp whose distance maps lie there, takes them;
        None for compiled loops where these fit the warp.

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
    from PolyPoseLib.warp.torch_cells import nodes_on_device

    require_grid(affine, "the displacement field's grid")
    vectors = np.empty((*shape, 3), dtype=np.float32)
    flat = vectors.reshape(-1, 3)
    dtype = torch.float32 if single else torch.float64
    fused = fused_displacements(warp) if single and device is None else None
    with torch.no_grad():
        for start in range(0, len(flat), POINTS_PER_CHUNK):
            stop = min(start + POINTS_PER_CHUNK, len(flat))
            if fused is not None:
                flat[start:stop] = fused(flat_points(affine, shape, start, stop))
                continue
            points = nodes_on_device(affine, shape, range(start, stop), device).to(dtype)
            moved = warp(points)
            flat[start:stop] = (moved - points.to(moved.device)).cpu().numpy()
    return DisplacementField(vectors, affine)


def jacobian_determinant(field: DisplacementField, device: torch.device | None = None) -> np.ndarray:
    """Jacobian determinant of x + u(x) at the nodes of a displacement field u.

    Central differences between nodes, one-sided at the border: det(A + du/d(i, j, k)) / det A with the grid's
    axes A, so that oblique and left-handed grids give the same values as straight ones.

    Parameters
    ----------
    field : DisplacementField
        Two nodes or more along every axis.
    device : torch.device, optional
        Where torch computes it; None for compiled loops where numba is installed.

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
    if device is not None:
        from PolyPoseLib.warp.torch_inverse import TorchField

        return TorchField(field, device).determinants()
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
    device: torch.device | None = None,
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
    device : torch.device, optional
        Where torch interpolates; None for compiled loops where numba is installed, and SimpleITK otherwise.

    Returns
    -------
    Volume
        float32 on the fixed grid.

    """
    import SimpleITK as sitk

    moving = volume.with_voxels(volume.voxels.astype(np.float32, copy=False))
    loops = _loops(device)
    if loops is None:
        return _resample(moving, warp, reference, outside, sitk.sitkLinear)
    grid = volume if reference is None else reference
    out, voxels = np.empty(grid.shape, np.float32), np.ascontiguousarray(moving.voxels)
    for place, arguments in _through(warp, grid, volume.affine, device):
        loops.warp_linear(voxels, *arguments, np.float32(outside), out[place])
    return Volume(out, grid.affine)


def warp_labels(
    labels: Volume,
    warp: AnyWarp,
    reference: Volume | None = None,
    method: LabelMethod = "linear",
    device: torch.device | None = None,
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
    device : torch.device, optional
        Where torch carries out the method "linear"; None for a CPU without torch.

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
    loops = _loops(device)
    if loops is not None:
        out = np.empty(grid.shape, dtype=labels.voxels.dtype)
        moving = np.ascontiguousarray(labels.voxels)
        for place, arguments in _through(warp, grid, labels.affine, device):
            loops.warp_votes(moving, *arguments, out[place])
        return Volume(out, grid.affine)
    voter, to_index = LabelVote(labels.voxels), np.linalg.inv(labels.affine)
    out = np.empty(grid.shape, dtype=labels.voxels.dtype)
    for slab in _slabs(grid.shape, VOXELS_PER_SLAB // 4):
        vectors, affine = _slab_vectors(warp, grid, slab)
        index = grid_index(to_index @ affine, vectors.shape[:3]).reshape(3, -1)
        index += to_index[:3, :3] @ vectors.reshape(-1, 3).T
        out[slab] = voter(index).reshape(vectors.shape[:3])
    return Volume(out, grid.affine)


def _loops(device: torch.device | None) -> ModuleType | TorchResampling | None:
    """Torch on a device, or the compiled loops; None where numba is not installed."""
    if device is not None:
        from PolyPoseLib.warp.torch_resample import TorchResampling

        return TorchResampling(device)
    return _compiled()


def _compiled() -> ModuleType | None:
    """The compiled loops, where numba is installed."""
    try:
        from PolyPoseLib.warp import resample_kernel
    except ImportError:
        return None
    return resample_kernel


def _through(
    warp: AnyWarp, grid: Volume, moving: np.ndarray, device: torch.device | None
) -> Iterator[tuple[slice, tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]]:
    """The whole fixed grid for a field, slabs of it for any other warp, and what the loops need for each.

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
        vectors, affine = _slab_vectors(warp, grid, slab, device)
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


def _slab_vectors(
    warp: AnyWarp, grid: Volume, slab: slice, device: torch.device | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (k, j, i, 3) at the voxels of a slab of a grid, and the slab's affine (4, 4)."""
    affine = grid.affine.copy()
    affine[:3, 3] += grid.affine[:3, 2] * slab.start
    shape = (slab.stop - slab.start, *grid.shape[1:])
    if not isinstance(warp, DisplacementField):
        return displacement_field(warp, affine, shape, device=device).vectors, affine
    if warp.shape == grid.shape and np.array_equal(warp.affine, grid.affine):
        return warp.vectors[slab], affine
    return field_on(warp, affine, shape).vectors, affine


def _slabs(shape: tuple[int, int, int], voxels: int | None = None) -> Iterator[slice]:
    """Slices along k of about VOXELS_PER_SLAB voxels each."""
    thickness = max((voxels or VOXELS_PER_SLAB) // (shape[1] * shape[2]), 1)
    for start in range(0, shape[0], thickness):
        yield slice(start, min(start + thickness, shape[0]))


def _empty_image(shape: tuple[int, int, int], affine: np.ndarray) -> sitk.Image:
    """An image of a grid, which SimpleITK takes as the reference of a resampling."""
    import SimpleITK as sitk

    image = sitk.Image([int(n) for n in shape[::-1]], sitk.sitkUInt8)
    set_grid(image, affine)
    return image
