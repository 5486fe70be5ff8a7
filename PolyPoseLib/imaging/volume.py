"""A voxel grid in patient space, and the files it comes from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.imaging.shear import SHEAR_MEND, SHEAR_TOLERANCE_MM, sideways_drift, straightened

if TYPE_CHECKING:
    import SimpleITK as sitk

AIR_HU = -1000.0
"""Hounsfield units of air: nothing attenuates less, so padding values below it become air."""

WATER_ATTENUATION_PER_MM = 0.02
"""Linear attenuation of water in 1/mm at the effective energy of diagnostic X-rays (about 60 keV)."""

MAX_VOXELS = 2_000_000_000
"""Volumes with more voxels than this are refused before they are read."""

SPACING_RANGE_MM = (0.05, 20.0)
"""Spacings of a CT outside it are taken for a wrong unit."""

GRID_TOLERANCE_MM = 1e-2
"""Two grids are one when no corner differs by more than this."""


@dataclass(frozen=True)
class Volume:
    """Voxels and where they are.

    voxels: array indexed (k, j, i).
    affine: (4, 4) float64, homogeneous index (i, j, k, 1) to LPS millimetres; any handedness.
    """

    voxels: np.ndarray
    affine: np.ndarray

    def __post_init__(self) -> None:
        """Check the shapes and that the affine can be inverted; raises InputError."""
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
    def voxel_volume_mm3(self) -> float:
        """Volume of one voxel in cubic millimetres."""
        return float(abs(np.linalg.det(self.affine[:3, :3])))

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
    """Linear attenuation in 1/mm, float32 of the same shape, from Hounsfield units.

    mu = mu_water (1 + HU / 1000), the definition of the unit (DICOM C.11.1.1.2); 0 at and below air.
    """
    mu = np.array(hu, dtype=np.float32)
    mu -= np.float32(AIR_HU)
    np.maximum(mu, 0, out=mu)
    mu *= np.float32(WATER_ATTENUATION_PER_MM / 1000)
    return mu


def read_volume(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a NIfTI, NRRD, MHA file or a folder of DICOM slices.

    series chooses a DICOM series by its instance UID or its number where a folder holds several.
    Raises InputError, with the file and the mend, for anything that is not one finite three-dimensional
    image.
    """
    from PolyPoseLib.imaging import dicom_series, volume_files

    path = Path(path)
    if path.is_dir() or path.suffix.lower() in (".dcm", ".ima"):
        volume = dicom_series.read_dicom_volume(path, series)
    else:
        image = volume_files.read_scalar_image(path)
        try:
            volume = Volume.from_sitk(image)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    _check_finite(volume, path)
    return volume


def write_volume(volume: Volume, path: str | Path) -> None:
    """Write a volume to the format that the name's ending asks for; raises InputError when that fails."""
    from PolyPoseLib.imaging import volume_files

    volume_files.write_image(volume.to_sitk(), Path(path))


def read_ct(path: str | Path, series: str | int | None = None) -> Volume:
    """Read a CT in Hounsfield units as float32; values below air, such as the padding -2048, become air.

    Raises InputError when the values cannot be Hounsfield units, the spacing no CT's, or the axes are sheared.
    """
    volume = read_volume(path, series)
    if min(volume.shape) < 2:
        raise InputError(
            f"{path}: the CT has {volume.shape[2]}x{volume.shape[1]}x{volume.shape[0]} voxels, which is one "
            "slice: give the whole stack."
        )
    _check_straight(volume, path)
    _check_spacing(volume, path)
    _check_hounsfield(volume, path)
    voxels = volume.voxels.astype(np.float32)
    np.maximum(voxels, np.float32(AIR_HU), out=voxels)
    return Volume(voxels, volume.affine)


def odd_hounsfield_values(ct: Volume, name: str | Path) -> tuple[str, ...]:
    """Warnings about a CT whose values are possible but odd; name says in them whose values they are."""
    low, high = float(ct.voxels.min()), float(ct.voxels.max())
    warnings = []
    if low > -500:
        warnings.append(
            f"{name}: no voxel is air (lowest value {low:g} HU); the CT may be cropped or clipped."
        )
    if high < 200:
        warnings.append(f"{name}: no voxel is bone (highest value {high:g} HU); the CT may be clipped.")
    return tuple(warnings)


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


def _check_finite(volume: Volume, path: Path) -> None:
    """Refuse NaN and infinity."""
    if not np.issubdtype(volume.voxels.dtype, np.floating):
        return
    wrong = int(volume.voxels.size - np.count_nonzero(np.isfinite(volume.voxels)))
    if wrong:
        raise InputError(
            f"{path}: {wrong} voxels are NaN or infinite: replace them by -1000 (air) or 0 (no label) and "
            "save again."
        )


def _check_straight(volume: Volume, path: str | Path) -> None:
    """Refuse axes that are not perpendicular, as after gantry tilt: results could not be saved on such a grid."""
    drift, degrees = sideways_drift(volume.affine[:3, :3], np.array(volume.shape[::-1]))
    if drift > SHEAR_TOLERANCE_MM:
        raise InputError(
            f"{path}: its axes are sheared by {degrees:.1f} degrees (gantry tilt): {SHEAR_MEND}."
        )


def _check_spacing(volume: Volume, path: str | Path) -> None:
    """Refuse voxels of a size that no CT has."""
    low, high = SPACING_RANGE_MM
    if not ((volume.spacing >= low) & (volume.spacing <= high)).all():
        shown = " x ".join(f"{each:.4g}" for each in volume.spacing)
        raise InputError(
            f"{path}: its voxels measure {shown} mm, and a CT's from {low:g} to {high:g} mm: its unit is likely "
            "wrong (metres or centimetres, say); save it again in millimetres."
        )


def _check_hounsfield(volume: Volume, path: str | Path) -> None:
    """Refuse values that cannot be Hounsfield units."""
    low, high = float(volume.voxels.min()), float(volume.voxels.max())
    if low == high:
        raise InputError(f"{path}: every voxel is {low:g}: give the CT, not an empty image or a mask.")
    if low >= 0:
        hint = (
            "it was rescaled for display; export the original CT"
            if high <= 255
            else "its rescale intercept was not applied; add it (usually -1024) and save again"
        )
        raise InputError(
            f"{path}: its values run from {low:g} to {high:g} and so are not Hounsfield units (air is "
            f"-1000): {hint}."
        )
    if high - low <= 2:
        raise InputError(
            f"{path}: its values run from {low:g} to {high:g} and so are not Hounsfield units: "
            "it was normalised; give the original CT."
        )
