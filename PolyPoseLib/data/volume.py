"""A voxel grid in patient space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.shear import straightened
from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    import SimpleITK as sitk

AIR_HU = -1000.0
"""Hounsfield units of air: nothing attenuates less, so padding values below it become air."""

WATER_ATTENUATION_PER_MM = 0.02
"""Linear attenuation of water in 1/mm at the effective energy of diagnostic X-rays (about 60 keV)."""


GRID_TOLERANCE_MM = 1e-2
"""Grids whose corners differ by no more count as the same."""


@dataclass(frozen=True)
class Volume:
    """Voxels and where they are; a Volume that exists is valid.

    Attributes
    ----------
    voxels
        Array indexed (k, j, i).
    affine
        (4, 4) float64, homogeneous index (i, j, k, 1) to LPS millimetres; any handedness.

    Raises
    ------
    InputError
        From the constructor: other than three dimensions, no voxels, or an affine that cannot be inverted.

    """

    voxels: np.ndarray
    affine: np.ndarray

    def __post_init__(self) -> None:
        """Validate, and fix the types."""
        voxels = np.asarray(self.voxels)
        affine = np.asarray(self.affine, dtype=np.float64)
        if voxels.ndim != 3:
            raise InputError(f"A volume must have 3 dimensions, not {voxels.ndim}: give voxels as (k, j, i).")
        if 0 in voxels.shape:
            raise InputError(f"A volume of {voxels.shape} voxels is empty: give at least one voxel per axis.")
        if affine.shape != (4, 4) or not np.all(np.isfinite(affine)):
            raise InputError(
                "The affine of a volume must be a finite 4x4 matrix from (i, j, k, 1) to LPS mm."
            )
        if not np.allclose(affine[3], [0, 0, 0, 1]):
            raise InputError("The last row of a volume's affine must be 0 0 0 1.")
        if abs(np.linalg.det(affine[:3, :3])) < 1e-12:
            raise InputError("The affine of a volume is singular: its axes or spacing are wrong.")
        object.__setattr__(self, "voxels", voxels)
        object.__setattr__(self, "affine", affine)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along (k, j, i)."""
        return self.voxels.shape

    @property
    def spacing(self) -> np.ndarray:
        """Distance between voxel centres along (i, j, k) in mm, shape (3,)."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    @property
    def bounds_center(self) -> np.ndarray:
        """Middle of the grid in LPS mm, shape (3,)."""
        return self.to_world((np.array(self.shape[::-1], dtype=np.float64) - 1) / 2)

    def to_world(self, indices: np.ndarray) -> np.ndarray:
        """Indices (..., 3) in the order (i, j, k) to LPS mm (..., 3)."""
        return np.asarray(indices, dtype=np.float64) @ self.affine[:3, :3].T + self.affine[:3, 3]

    def to_index(self, points: np.ndarray) -> np.ndarray:
        """LPS mm (..., 3) to continuous indices (..., 3) in the order (i, j, k)."""
        offset = np.asarray(points, dtype=np.float64) - self.affine[:3, 3]
        return offset @ np.linalg.inv(self.affine[:3, :3]).T

    def voxels_at(self, index: np.ndarray, outside: float) -> np.ndarray:
        """Values (N,) of the voxels nearest to indices (N, 3) in the order (i, j, k), ``outside`` beyond the grid."""
        nearest = np.rint(index)
        inside = ((nearest >= 0) & (nearest < np.array(self.shape[::-1]))).all(axis=1)
        i, j, k = nearest[inside].astype(np.int64).T
        found = np.full(len(index), outside, self.voxels.dtype)
        found[inside] = self.voxels[k, j, i]
        return found

    def corners(self) -> np.ndarray:
        """The eight corner voxels' centres in LPS mm, shape (8, 3)."""
        ends = [(0, n - 1) for n in self.shape[::-1]]
        return self.to_world(np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(8, 3))

    def same_grid(self, other: Volume, tolerance_mm: float = GRID_TOLERANCE_MM) -> bool:
        """Whether both have equal shapes and no corner differs by more than tolerance_mm."""
        return self.shape == other.shape and bool(
            np.abs(self.corners() - other.corners()).max() <= tolerance_mm
        )

    def with_voxels(self, voxels: np.ndarray) -> Volume:
        """The same grid with other voxels."""
        if voxels.shape != self.shape:
            raise InputError(f"Voxels of shape {voxels.shape} do not fit a grid of {self.shape}.")
        return Volume(voxels, self.affine)

    @classmethod
    def from_sitk(cls, image: sitk.Image) -> Volume:
        """Copy a three-dimensional scalar SimpleITK image; raises InputError for any other.

        Axes that rounding bent are made perpendicular.
        """
        import SimpleITK as sitk

        if image.GetDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 1:
            raise InputError(
                f"The image has {image.GetDimension()} dimensions and "
                f"{image.GetNumberOfComponentsPerPixel()} "
                "values per voxel: give one three-dimensional image with one value per voxel."
            )
        affine = np.eye(4)
        axes = np.array(image.GetDirection()).reshape(3, 3) @ np.diag(image.GetSpacing())
        affine[:3, :3] = straightened(axes, np.array(image.GetSize()))
        affine[:3, 3] = image.GetOrigin()
        return cls(sitk.GetArrayFromImage(image), affine)

    def to_sitk(self) -> sitk.Image:
        """The volume as a SimpleITK image; booleans become 8-bit integers."""
        import SimpleITK as sitk

        voxels = self.voxels.astype(np.uint8) if self.voxels.dtype == bool else self.voxels
        image = sitk.GetImageFromArray(voxels)
        spacing = self.spacing
        image.SetSpacing(spacing.tolist())
        image.SetDirection((self.affine[:3, :3] / spacing).ravel().tolist())
        image.SetOrigin(self.affine[:3, 3].tolist())
        return image


def hounsfield_to_attenuation(hu: np.ndarray) -> np.ndarray:
    """Linear attenuation in 1/mm: mu = mu_water (1 + HU / 1000), and 0 at and below air.

    Parameters
    ----------
    hu
        Hounsfield units, any shape.

    Returns
    -------
    numpy.ndarray
        1/mm, float32 of the same shape.

    References
    ----------
    Definition of the Hounsfield unit: DICOM PS3.3 C.11.1.1.2.

    """
    mu = np.array(hu, dtype=np.float32)
    mu -= np.float32(AIR_HU)
    np.maximum(mu, 0, out=mu)
    mu *= np.float32(WATER_ATTENUATION_PER_MM / 1000)
    return mu


def resample_labels_onto(labels: Volume, reference: Volume) -> Volume:
    """Labels on the reference's grid by nearest neighbour, 0 where they do not reach."""
    if labels.same_grid(reference):
        return Volume(labels.voxels, reference.affine)
    import SimpleITK as sitk

    resampled = sitk.Resample(
        labels.to_sitk(),
        reference.shape[::-1],
        sitk.Transform(3, sitk.sitkIdentity),
        sitk.sitkNearestNeighbor,
        reference.affine[:3, 3].tolist(),
        reference.spacing.tolist(),
        (reference.affine[:3, :3] / reference.spacing).ravel().tolist(),
        0,
    )
    return Volume(sitk.GetArrayFromImage(resampled), reference.affine)
