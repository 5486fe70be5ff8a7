"""The two volumes that every 3D/3D system is given: the reconstructed X-rays and the CT, on one grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import SimpleITK as sitk

from PolyPoseLib.baselines.fdk import reconstruct
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import AIR_HU, WATER_ATTENUATION_PER_MM, Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
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
        (k, j, i) float32, the patient at the time of the X-rays, HU within the range of the moving volume.
    moving
        (k, j, i) float32, the CT, HU; air beyond it.
    origin
        (3,) LPS mm of the first voxel's centre.
    spacing_mm
        Between voxels, along all axes.
    seen
        (k, j, i) bool, the voxels of the fixed volume that all X-rays show; the rest of it is no measurement.

    """

    fixed: np.ndarray
    moving: np.ndarray
    origin: np.ndarray
    spacing_mm: float
    seen: np.ndarray

    @property
    def affine(self) -> np.ndarray:
        """(4, 4) index (i, j, k) to LPS mm."""
        return _affine(self.origin, self.spacing_mm)

    def images(self) -> tuple[sitk.Image, sitk.Image]:
        """Fixed and moving as SimpleITK images."""
        return Volume(self.fixed, self.affine).to_sitk(), Volume(self.moving, self.affine).to_sitk()

    def seen_image(self) -> sitk.Image:
        """The mask as a SimpleITK image, float32, 1 where the fixed volume is seen and 0 elsewhere."""
        return Volume(self.seen.astype(np.float32), self.affine).to_sitk()

    def field(self, vectors: np.ndarray) -> DisplacementField:
        """A field on this grid of vectors (k, j, i, 3) in mm along x, y, z, from fixed to moving points."""
        return DisplacementField(vectors, self.affine)

    def field_of_voxels(self, kji: np.ndarray) -> DisplacementField:
        """The same of displacements (k, j, i, 3) in voxels along k, j, i; what is beyond the grid is left out."""
        k, j, i = self.fixed.shape
        return self.field(kji[:k, :j, :i, ::-1] * self.spacing_mm)

    def padded_to(self, multiple: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Fixed, moving and seen with their last voxels repeated until all sides are multiples of a number.

        ConvexAdam pools by whole blocks, drops what is left, and stretches the field that it found over all of it.
        """
        more = [(0, -n % multiple) for n in self.fixed.shape]
        fixed, moving, seen = (
            np.pad(each, more, mode="edge") for each in (self.fixed, self.moving, self.seen)
        )
        return fixed, moving, seen

    def points(self) -> np.ndarray:
        """(k, j, i, 3) LPS mm of the voxels."""
        index = np.stack(np.meshgrid(*map(np.arange, self.fixed.shape), indexing="ij"), axis=-1)
        return index[..., ::-1] * self.spacing_mm + self.origin


def pair_of(study: Study, threads: int = 1) -> VolumePair:
    """The CT of a study, and the reconstruction of its X-rays, on a grid that covers the CT.

    From few views a reconstruction swings far below air and above bone, by which correlations would be ruled: it is
    clipped to what the CT has, from air to its densest voxel.

    Raises
    ------
    InputError
        As :func:`PolyPoseLib.baselines.fdk.reconstruct`, a CT that is too thin for a pyramid, or X-rays of which no
        part of the CT is in all.

    """
    grid = covering_lps_grid(study.ct)
    attenuation = reconstruct(study.xrays, grid, threads)
    fixed = (attenuation.voxels / WATER_ATTENUATION_PER_MM - 1.0) * 1000.0
    moving = resampled_ct(study.ct, grid)
    seen = seen_by_all(study.xrays, grid)
    if not seen.any():
        raise InputError(
            "No part of the CT is in all of the X-rays, and a cone-beam reconstruction needs X-rays of the same part: "
            "leave out those that show another one, or check their cameras."
        )
    return VolumePair(
        np.clip(fixed, AIR_HU, moving.max()).astype(np.float32),
        moving,
        grid.affine[:3, 3].copy(),
        float(grid.affine[0, 0]),
        seen,
    )


def seen_by_all(xrays: Sequence[Xray], grid: Volume) -> np.ndarray:
    """Voxels (k, j, i) bool of a grid whose centres fall on a pixel within the mask of every X-ray.

    Parameters
    ----------
    xrays
        With an extrinsic.
    grid
        In LPS mm; its voxels are not looked at.

    """
    seen = np.ones(grid.shape, bool)
    index = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), axis=-1)
    points = grid.to_world(index[..., ::-1])
    for xray in xrays:
        assert xray.extrinsic is not None
        camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
        # Behind the source pixels are not numbers, which are on no detector either.
        pixels = np.nan_to_num(np.rint(camera.project(points)), nan=-1.0)
        column, row = np.moveaxis(pixels, -1, 0)
        inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
        seen &= inside
        seen[seen] = xray.mask[row[seen].astype(int), column[seen].astype(int)]
    return seen


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
