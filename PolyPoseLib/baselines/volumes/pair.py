"""The two volumes that every 3D/3D system is given: the reconstructed X-rays and the CT, on one grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import SimpleITK as sitk

from PolyPoseLib.baselines.fdk import reconstruct
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import AIR_HU, WATER_ATTENUATION_PER_MM, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import block_factors, block_mean, coarsened_affine

SPACING_MM = (2.0, 4.0)
"""The grid's spacing is the CT's finest one within these bounds; coarser fields are no motion of a system."""

LEAST_NODES = 8
"""Along every axis: pyramids halve a volume twice."""


@dataclass(frozen=True, eq=False)
class VolumePair:
    """Two volumes on one isotropic grid whose axes are LPS, so that packages cannot differ about directions.

    Attributes
    ----------
    fixed
        (k, j, i) float32, the patient at the time of the X-rays, HU.
    moving
        (k, j, i) float32, the CT, HU; air beyond it.
    origin
        (3,) LPS mm of the first voxel's centre.
    spacing_mm
        Between voxels, along all axes.

    """

    fixed: np.ndarray
    moving: np.ndarray
    origin: np.ndarray
    spacing_mm: float

    @property
    def affine(self) -> np.ndarray:
        """(4, 4) index (i, j, k) to LPS mm."""
        return _affine(self.origin, self.spacing_mm)

    def images(self) -> tuple[sitk.Image, sitk.Image]:
        """Fixed and moving as SimpleITK images."""
        return Volume(self.fixed, self.affine).to_sitk(), Volume(self.moving, self.affine).to_sitk()

    def field(self, vectors: np.ndarray) -> DisplacementField:
        """A field on this grid of vectors (k, j, i, 3) in mm along x, y, z, from fixed to moving points."""
        return DisplacementField(vectors, self.affine)

    def field_of_voxels(self, kji: np.ndarray) -> DisplacementField:
        """The same of displacements (k, j, i, 3) in voxels along k, j, i; what is beyond the grid is left out."""
        k, j, i = self.fixed.shape
        return self.field(kji[:k, :j, :i, ::-1] * self.spacing_mm)

    def padded_to(self, multiple: int) -> tuple[np.ndarray, np.ndarray]:
        """Fixed and moving with their last voxels repeated until all sides are multiples of a number.

        ConvexAdam pools by whole blocks, drops what is left, and stretches the field that it found over all of it.
        """
        more = [(0, -n % multiple) for n in self.fixed.shape]
        return np.pad(self.fixed, more, mode="edge"), np.pad(self.moving, more, mode="edge")

    def points(self) -> np.ndarray:
        """(k, j, i, 3) LPS mm of the voxels."""
        index = np.stack(np.meshgrid(*map(np.arange, self.fixed.shape), indexing="ij"), axis=-1)
        return index[..., ::-1] * self.spacing_mm + self.origin


def pair_of(study: Study, threads: int = 1) -> VolumePair:
    """The CT of a study, and the reconstruction of its X-rays, on a grid that covers the CT.

    Raises
    ------
    InputError
        As :func:`PolyPoseLib.baselines.fdk.reconstruct`, or a CT that is too thin for a pyramid.

    """
    grid = covering_lps_grid(study.ct)
    attenuation = reconstruct(study.xrays, grid, threads)
    fixed = (attenuation.voxels / WATER_ATTENUATION_PER_MM - 1.0) * 1000.0
    return VolumePair(
        fixed.astype(np.float32),
        resampled_ct(study.ct, grid),
        grid.affine[:3, 3].copy(),
        float(grid.affine[0, 0]),
    )


def covering_lps_grid(ct: Volume) -> Volume:
    """An empty isotropic grid along LPS axes that covers the CT to the edges of its voxels."""
    spacing = float(np.clip(ct.spacing.min(), *SPACING_MM))
    edges = np.array([[-0.5, n - 0.5] for n in ct.shape[::-1]])
    corners = ct.to_world(np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1).reshape(8, 3))
    low, high = corners.min(axis=0), corners.max(axis=0)
    nodes = np.ceil((high - low) / spacing - 1e-6).astype(int) + 1
    if nodes.min() < LEAST_NODES:
        raise InputError(
            f"The CT is only {(high - low).min():.0f} mm thick, {nodes.min()} voxels of {spacing:g} mm: 3D/3D systems "
            f"need {LEAST_NODES}."
        )
    origin = (low + high - (nodes - 1) * spacing) / 2
    return Volume(np.zeros(nodes[::-1], np.float32), _affine(origin, spacing))


def resampled_ct(ct: Volume, grid: Volume) -> np.ndarray:
    """The CT's HU on a grid, (k, j, i) float32: means of blocks of about its spacing, then trilinear; air beyond it."""
    factors = block_factors(ct.affine, float(grid.spacing.min()))
    coarse = Volume(block_mean(ct.voxels, factors, AIR_HU), coarsened_affine(ct.affine, factors))
    image = sitk.Resample(
        coarse.to_sitk(),
        grid.to_sitk(),
        sitk.Transform(3, sitk.sitkIdentity),
        sitk.sitkLinear,
        AIR_HU,
        sitk.sitkFloat32,
    )
    return np.maximum(sitk.GetArrayFromImage(image), AIR_HU)


def _affine(origin: np.ndarray, spacing: float) -> np.ndarray:
    """(4, 4) of an isotropic grid along LPS axes."""
    affine = np.diag([spacing, spacing, spacing, 1.0])
    affine[:3, 3] = origin
    return affine
