"""A displacement field on a grid, its value between the nodes, and the ITK transform file that carries it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    import SimpleITK as sitk

TRANSFORM_ENDINGS = (".h5", ".hdf5")
"""Of the names of transform files."""

POINTS_PER_CHUNK = 1 << 17
"""Points that are interpolated at once; bounds the temporary memory to about 20 MiB."""


@dataclass(frozen=True)
class DisplacementField:
    """Displacements that take fixed points to moving points: warp(x) = x + vectors(x).

    vectors: (k, j, i, 3) float32, in mm along LPS x, y, z, at the nodes of a grid.
    affine: (4, 4) float64, homogeneous index (i, j, k, 1) to fixed LPS mm; orthogonal axes, any handedness.
    """

    vectors: np.ndarray
    affine: np.ndarray

    def __post_init__(self) -> None:
        """Check shapes and numbers; raises InputError."""
        vectors = np.asarray(self.vectors)
        affine = np.asarray(self.affine, dtype=np.float64)
        if vectors.ndim != 4 or vectors.shape[3] != 3 or 0 in vectors.shape:
            raise InputError(
                f"A displacement field has vectors of shape (k, j, i, 3), not {vectors.shape}: "
                "give one LPS vector in mm per node."
            )
        require_grid(affine, "a displacement field")
        if not np.isfinite(vectors).all():
            raise InputError("A displacement field holds NaN or infinity: give finite vectors in mm.")
        object.__setattr__(self, "vectors", vectors.astype(np.float32, copy=False))
        object.__setattr__(self, "affine", affine)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along (k, j, i)."""
        return self.vectors.shape[:3]

    @property
    def spacing(self) -> np.ndarray:
        """Distance between nodes along (i, j, k) in mm, shape (3,)."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    def sample(self, points: np.ndarray) -> np.ndarray:
        """Displacement at any points, trilinear between the nodes.

        points: (..., 3) fixed LPS mm. Returns (..., 3) float64 mm. Beyond the grid the value of its nearest
        point is taken, so the field stays continuous (ITK takes 0 there).
        """
        points = np.asarray(points, dtype=np.float64)
        flat = points.reshape(-1, 3)
        out = np.empty_like(flat)
        inverse = np.linalg.inv(self.affine)
        for start in range(0, len(flat), POINTS_PER_CHUNK):
            chunk = flat[start : start + POINTS_PER_CHUNK]
            index = chunk @ inverse[:3, :3].T + inverse[:3, 3]
            out[start : start + POINTS_PER_CHUNK] = trilinear(self.vectors, index)
        return out.reshape(points.shape)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Moving points (..., 3) of fixed points (..., 3), LPS mm."""
        return np.asarray(points, dtype=np.float64) + self.sample(points)

    def to_sitk_image(self) -> sitk.Image:
        """The field as an image of 3-vectors in float64, which is what ITK's transforms hold."""
        import SimpleITK as sitk

        image = sitk.GetImageFromArray(self.vectors.astype(np.float64), isVector=True)
        set_grid(image, self.affine)
        return image

    def to_sitk_transform(self) -> sitk.DisplacementFieldTransform:
        """The field as an ITK transform from fixed to moving points, which SimpleITK's Resample takes."""
        import SimpleITK as sitk

        return sitk.DisplacementFieldTransform(self.to_sitk_image())

    def write_transform(self, path: str | Path) -> None:
        """Write an ITK transform file (.h5) that Slicer, SimpleITK and ANTs read.

        Raises InputError when the name does not end in .h5 or .hdf5, or the file cannot be written.
        """
        import SimpleITK as sitk

        path = Path(path)
        if path.suffix.lower() not in TRANSFORM_ENDINGS:
            raise InputError(f"{path}: a displacement field is stored as HDF5; let the name end in .h5.")
        try:
            sitk.WriteTransform(self.to_sitk_transform(), str(path))
        except RuntimeError as error:
            raise InputError(
                f"{path}: cannot be written ({last_line(error)}); choose a folder you may write to."
            ) from error

    @classmethod
    def read_transform(cls, path: str | Path) -> DisplacementField:
        """Read an ITK transform file that holds one displacement field; raises InputError for any other."""
        import SimpleITK as sitk

        path = Path(path)
        if not path.is_file():
            raise InputError(f"{path}: there is no such file; give a transform written by PolyPose.")
        try:
            transform = sitk.DisplacementFieldTransform(sitk.ReadTransform(str(path)))
        except (RuntimeError, ValueError) as error:
            raise InputError(
                f"{path}: does not hold a displacement field ({last_line(error)}); "
                "give a transform.h5 written by PolyPose."
            ) from error
        return cls.from_sitk_image(transform.GetDisplacementField())

    @classmethod
    def from_sitk_image(cls, image: sitk.Image) -> DisplacementField:
        """Copy a three-dimensional SimpleITK image of 3-vectors; raises InputError for any other."""
        import SimpleITK as sitk

        if image.GetDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 3:
            raise InputError(
                f"The image has {image.GetDimension()} dimensions and "
                f"{image.GetNumberOfComponentsPerPixel()} values per voxel: a displacement field has 3 and 3."
            )
        affine = np.eye(4)
        affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) @ np.diag(image.GetSpacing())
        affine[:3, 3] = image.GetOrigin()
        return cls(sitk.GetArrayFromImage(image).astype(np.float32), affine)


def trilinear(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Trilinear interpolation of vectors at continuous indices, clamped to the grid.

    values: (k, j, i, C); index: (N, 3) in the order (i, j, k). Returns (N, C) float64.
    """
    stride = 1
    table = values.reshape(-1, values.shape[3])
    ends = []
    for axis, size in enumerate(values.shape[2::-1]):
        place = np.clip(index[:, axis], 0, size - 1)
        low = np.minimum(place.astype(np.int64), max(size - 2, 0))
        fraction = place - low
        low *= stride
        ends.append(((low, 1 - fraction), (low + stride * min(size - 1, 1), fraction)))
        stride *= size
    out = np.zeros((len(index), values.shape[3]))
    for x, weight_x in ends[0]:
        for y, weight_y in ends[1]:
            start, weight_xy = x + y, weight_x * weight_y
            for z, weight_z in ends[2]:
                out += (weight_xy * weight_z)[:, None] * table[start + z]
    return out


def require_grid(affine: np.ndarray, what: str) -> None:
    """Refuse an affine that is not a grid of orthogonal axes; raises InputError.

    affine: (4, 4); what: whose affine it is, for the sentence.
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
    shape: tuple[int, int, int],
    spacing_mm: float,
    margin_mm: float = 0.0,
    keep_coarser: bool = True,
) -> tuple[np.ndarray, tuple[int, int, int]]:
    """A grid of spacing_mm, along the same axes, that covers all voxels of another to their edges.

    affine: (4, 4), shape: (k, j, i) of the grid to cover. spacing_mm: wanted distance between nodes; margin_mm:
    covered beyond the voxels' edges. keep_coarser: an axis whose voxels are farther apart than that keeps its own
    distance, since nothing is known between them.
    Returns (affine (4, 4), shape (k, j, i)).
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


def last_line(error: Exception) -> str:
    """The last line of an ITK error, which is the one that says what happened."""
    lines = str(error).strip().splitlines()
    return lines[-1].strip() if lines else type(error).__name__
