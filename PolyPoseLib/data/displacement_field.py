"""A displacement field on a grid, and its value between the nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError, NotFiniteError
from PolyPoseLib.geometry.grid import require_grid, set_grid

if TYPE_CHECKING:
    import SimpleITK as sitk

POINTS_PER_CHUNK = 1 << 17
"""Points that are interpolated at once; bounds the temporary memory to about 20 MiB."""


@dataclass(frozen=True)
class DisplacementField:
    """Displacements that take fixed points to moving points: warp(x) = x + vectors(x).

    Parameters
    ----------
    vectors : (k, j, i, 3) array
        In mm along LPS x, y, z, at the nodes of a grid; kept as float32.
    affine : (4, 4) array
        Homogeneous index (i, j, k, 1) to fixed LPS mm; orthogonal axes, any handedness.

    Raises
    ------
    InputError
        A wrong shape, axes that are not orthogonal, or numbers that are not finite.

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
            raise NotFiniteError("A displacement field holds NaN or infinity: give finite vectors in mm.")
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

        Beyond the grid the value of its nearest point is taken, so the field stays continuous (ITK takes 0 there).

        Parameters
        ----------
        points : (..., 3) array
            Fixed points, LPS mm.

        Returns
        -------
        (..., 3) float64 array
            Displacements, mm.

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

    Parameters
    ----------
    values : (k, j, i, C) array
        Vectors at the nodes.
    index : (N, 3) array
        In the order (i, j, k).

    Returns
    -------
    (N, C) float64 array
        Interpolated vectors.

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
