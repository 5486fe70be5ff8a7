"""Grids of voxels: block means, grids that cover others, and the affine as an image carries it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    import SimpleITK as sitk
    from numpy.typing import ArrayLike


def bounding_box(mask: np.ndarray) -> tuple[slice, ...] | None:
    """Smallest box of slices that holds a mask of any dimension; None when it is empty."""
    box = []
    for axis in range(mask.ndim):
        others = tuple(a for a in range(mask.ndim) if a != axis)
        filled = np.flatnonzero(mask.any(axis=others))
        if not len(filled):
            return None
        box.append(slice(int(filled[0]), int(filled[-1]) + 1))
    return tuple(box)


def grown_box(box: tuple[slice, ...], margin: ArrayLike, shape: tuple[int, ...]) -> tuple[slice, ...]:
    """A box with a margin around it, the same or one per axis, cut off at the ends of an array of a shape."""
    return tuple(
        slice(max(side.start - more, 0), min(side.stop + more, size))
        for side, more, size in zip(box, np.broadcast_to(margin, len(box)).tolist(), shape, strict=True)
    )


def connected_components(mask: np.ndarray, structure: np.ndarray | None = None) -> tuple[np.ndarray, int]:
    """Number the connected components of a mask.

    Parameters
    ----------
    mask : array of bool
        Of any dimension.
    structure : array, optional
        3 along every axis, not zero at the neighbours that count as connected; faces only by default.

    Returns
    -------
    array of int32
        0 outside the mask, and 1 to the number of components inside.
    int
        The number of components.

    """
    from scipy.ndimage import label

    numbered = label(mask, structure)
    assert isinstance(numbered, tuple)
    return numbered


@dataclass(frozen=True)
class Grid:
    """Voxels (k, j, i) float32 with their affine (4, 4), index (i, j, k) to LPS mm."""

    voxels: np.ndarray
    affine: np.ndarray

    def coarsened(self, target_mm: float) -> Grid:
        """Block means, whole factors per axis, voxels of about ``target_mm``; edges are padded with zeros."""
        factors = block_factors(self.affine, target_mm)
        if max(factors) == 1:
            return self
        return Grid(block_mean(self.voxels, factors), coarsened_affine(self.affine, factors))

    def without_zeros(self) -> Grid:
        """The smallest box that holds all voxels that are not zero; one voxel when there are none."""
        box = bounding_box(self.voxels) or (slice(0, 1),) * 3
        affine = self.affine.copy()
        affine[:3, 3] += affine[:3, :3] @ [part.start for part in reversed(box)]
        return Grid(self.voxels[box], affine)

    def padded(self) -> Grid:
        """The same with a border of zeros, one voxel wide."""
        affine = self.affine.copy()
        affine[:3, 3] -= affine[:3, :3] @ np.ones(3)
        return Grid(np.pad(self.voxels, 1), affine)


def block_factors(affine: np.ndarray, target_mm: float) -> tuple[int, int, int]:
    """How many voxels along (i, j, k) make up about ``target_mm``."""
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    i, j, k = (max(1, round(target_mm / s)) for s in spacing)
    return i, j, k


def coarsened_affine(affine: np.ndarray, factors: tuple[int, int, int]) -> np.ndarray:
    """Affine of block means: a block's centre lies half a block less half a voxel from its first voxel's."""
    scale = np.array(factors, float)
    coarse = affine.copy()
    coarse[:3, :3] = affine[:3, :3] * scale
    coarse[:3, 3] = affine[:3, 3] + affine[:3, :3] @ ((scale - 1) / 2)
    return coarse


def block_mean(voxels: np.ndarray, factors: tuple[int, int, int], outside: float = 0.0) -> np.ndarray:
    """Block means in slabs, so that no second copy of a large volume is made."""
    fi, fj, fk = factors
    if max(factors) == 1:
        return voxels.astype(np.float32)
    depth, height, width = (-(-n // f) for n, f in zip(voxels.shape, (fk, fj, fi), strict=True))
    means = np.empty((depth, height, width), np.float32)
    for k in range(depth):
        slab = voxels[k * fk : (k + 1) * fk].astype(np.float32)
        missing = ((0, fk - len(slab)), (0, height * fj - slab.shape[1]), (0, width * fi - slab.shape[2]))
        slab = np.pad(slab, missing, constant_values=outside)
        means[k] = slab.reshape(fk, height, fj, width, fi).mean(axis=(0, 2, 4))
    return means


def block_centres(labels: np.ndarray, factors: tuple[int, int, int]) -> np.ndarray:
    """The label of the voxel in each block's middle."""
    return labels[np.ix_(*block_centre_indices(labels.shape, factors))]


def block_centre_indices(shape: tuple[int, ...], factors: tuple[int, int, int]) -> list[np.ndarray]:
    """Index of each block's middle voxel along (k, j, i); factors: of the blocks along (i, j, k)."""
    return [
        np.minimum(np.arange(-(-size // f)) * f + f // 2, size - 1)
        for size, f in zip(shape, reversed(factors), strict=True)
    ]


def require_grid(affine: np.ndarray, what: str) -> None:
    """Refuse an affine that is not a grid of orthogonal axes; raises InputError.

    Parameters
    ----------
    affine : (4, 4) array
        Index (i, j, k) to LPS mm.
    what : str
        Whose affine it is, for the sentence.

    Raises
    ------
    InputError
        Not a finite matrix, singular, or axes that are not at right angles.

    """
    if np.shape(affine) != (4, 4) or not np.isfinite(affine).all():
        raise InputError(f"The affine of {what} must be a finite 4x4 matrix from (i, j, k, 1) to LPS mm.")
    axes = affine[:3, :3]
    spacing = np.linalg.norm(axes, axis=0)
    if not np.allclose(affine[3], (0, 0, 0, 1)) or (spacing < 1e-9).any():
        raise InputError(
            f"The affine of {what} is singular or its last row is not 0 0 0 1: check its spacing."
        )
    skew = np.abs((axes / spacing).T @ (axes / spacing) - np.eye(3)).max()
    if skew > 1e-3:
        raise InputError(
            f"The axes of {what} are not at right angles (cosine {skew:.3g}): resample it onto a grid."
        )


def set_grid(image: sitk.Image, affine: np.ndarray) -> None:
    """Give a SimpleITK image the origin, spacing and direction of an affine (4, 4), LPS mm."""
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    image.SetSpacing(spacing.tolist())
    image.SetDirection((affine[:3, :3] / spacing).ravel().tolist())
    image.SetOrigin(affine[:3, 3].tolist())


def covering_grid(
    affine: np.ndarray,
    shape: tuple[int, ...],
    spacing_mm: float,
    margin_mm: float = 0.0,
    keep_coarser: bool = True,
) -> tuple[np.ndarray, tuple[int, int, int]]:
    """A grid of another spacing, along the same axes, that covers all voxels of a grid to their edges.

    Parameters
    ----------
    affine : (4, 4) array
        Of the grid to cover, index (i, j, k) to LPS mm.
    shape : tuple[int, ...]
        Its voxels along (k, j, i).
    spacing_mm : float
        Wanted distance between nodes.
    margin_mm : float
        Covered beyond the voxels' edges.
    keep_coarser : bool
        An axis whose voxels are farther apart than that keeps its own distance, since nothing is known between
        them.

    Returns
    -------
    (4, 4) array
        Affine of the grid, index (i, j, k) to LPS mm.
    tuple[int, int, int]
        Its nodes along (k, j, i).

    Raises
    ------
    InputError
        An affine that is not a grid of orthogonal axes, or a spacing that is not above 0.

    """
    require_grid(affine, "the grid to cover")
    if not (np.isfinite(spacing_mm) and spacing_mm > 0):
        raise InputError(f"A grid's spacing of {spacing_mm} mm is not possible; give a number above 0.")
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    size = np.array(shape[::-1])
    wanted = np.maximum(spacing, spacing_mm) if keep_coarser else np.full(3, float(spacing_mm))
    length = size * spacing + 2 * margin_mm
    nodes = np.ceil(length / wanted - 1e-9).astype(int) + 1
    extent = (nodes - 1) * wanted
    first = -0.5 - (margin_mm + (extent - length) / 2) / spacing
    grid = np.eye(4)
    grid[:3, :3] = affine[:3, :3] / spacing * wanted
    grid[:3, 3] = affine[:3, :3] @ first + affine[:3, 3]
    return grid, (int(nodes[2]), int(nodes[1]), int(nodes[0]))
