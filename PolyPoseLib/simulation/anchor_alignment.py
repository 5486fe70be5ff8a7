"""The rigid motion of one bone between two scans of a patient, from its labels in both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box, set_grid
from PolyPoseLib.geometry.rigid import orthonormalised

if TYPE_CHECKING:
    import SimpleITK as sitk

_GRID_MM = 2.0
_MARGIN_MM = 16.0
_FARTHEST_MM = 12.0
"""Signed distances are cut there: what lies farther from a surface says nothing about where it is."""

_FEWEST_VOXELS = 64
_MOST_POINTS = 20_000
_POINTS = 20_000.0
"""At which the distance maps are compared, on each level."""

_FIRST_STEP_MM = 0.5
"""Of the descent: larger ones leap over to another symmetry of a nearly symmetric bone."""

_SEED = 1


@dataclass(frozen=True, eq=False)
class AnchorAlignment:
    """How a bone lies in two scans.

    Attributes
    ----------
    to_first
        (4, 4) from the second scan's world to the first's, LPS mm.
    residual_mm
        Mean distance of the aligned surfaces: what no rigid motion explains (the labels' own errors).
    moved_mm, moved_deg
        How far the bone's centroid is carried, and by what angle: what the scans' own worlds disagree by.

    """

    to_first: np.ndarray
    residual_mm: float
    moved_mm: float
    moved_deg: float


def align_anchor(first: Volume, second: Volume) -> AnchorAlignment:
    """Align one bone's mask in a second scan to its mask in a first one.

    Mean squared difference of the signed distance maps, by SimpleITK: a rigid transform about the centroid, started
    with the centroids upon each other, at 8, 4 and 2 mm. Turns of some 30 degrees are found.

    Parameters
    ----------
    first, second : Volume
        Not 0 in the bone; each in its own world.

    Raises
    ------
    InputError
        A mask is nearly empty, or the fit fails.

    Source: Y. Kozinska et al., "Automatic alignment of volumetric images using distance maps", 1997, for the measure.

    """
    import SimpleITK as sitk

    for mask in (first, second):
        if np.count_nonzero(mask.voxels) < _FEWEST_VOXELS:
            raise InputError(f"the anchor has fewer than {_FEWEST_VOXELS} voxels in one of the scans.")
    centre_first, centre_second = _centroid(first), _centroid(second)
    fixed, moving = _distances(first), _distances(second)
    transform = sitk.Euler3DTransform()
    transform.SetCenter(centre_first.tolist())
    transform.SetTranslation((centre_second - centre_first).tolist())
    method = sitk.ImageRegistrationMethod()
    method.SetMetricAsMeanSquares()
    method.SetMetricSamplingStrategy(method.RANDOM)
    points = np.prod(np.array(fixed.GetSize(), dtype=float) / [[4], [2], [1]], axis=1)
    method.SetMetricSamplingPercentagePerLevel(np.minimum(_POINTS / points, 1.0).tolist(), _SEED)
    method.SetInterpolator(sitk.sitkLinear)
    method.SetOptimizerAsRegularStepGradientDescent(
        learningRate=_FIRST_STEP_MM, minStep=1e-3, numberOfIterations=100, relaxationFactor=0.6
    )
    method.SetOptimizerScalesFromPhysicalShift()
    method.SetShrinkFactorsPerLevel([4, 2, 1])
    method.SetSmoothingSigmasPerLevel([0, 0, 0])
    method.SetNumberOfThreads(1)
    method.SetInitialTransform(transform, inPlace=True)
    try:
        method.Execute(fixed, moving)
    except RuntimeError as error:
        raise InputError("the anchor's labels in the two scans could not be aligned.") from error
    to_second = np.eye(4)
    rotation = np.array(transform.GetMatrix()).reshape(3, 3)
    to_second[:3, :3] = rotation
    to_second[:3, 3] = centre_first + transform.GetTranslation() - rotation @ centre_first
    to_first = orthonormalised(np.linalg.inv(to_second))
    carried = to_first[:3, :3] @ centre_second + to_first[:3, 3]
    cosine = np.clip((np.trace(to_first[:3, :3]) - 1) / 2, -1, 1)
    return AnchorAlignment(
        to_first,
        _residual(fixed, moving, _border(second), to_first),
        float(np.linalg.norm(carried - centre_second)),
        float(np.degrees(np.arccos(cosine))),
    )


def _centroid(mask: Volume) -> np.ndarray:
    """Mean (3,) of a mask's voxels in LPS mm."""
    return mask.to_world(np.argwhere(mask.voxels)[:, ::-1].mean(axis=0))


def _distances(mask: Volume) -> sitk.Image:
    """Signed distance in mm to a mask's surface, cut at both ends, on a coarse grid around it; float32."""
    import SimpleITK as sitk

    box = bounding_box(mask.voxels)
    assert box is not None
    margin = np.ceil(_MARGIN_MM / mask.spacing).astype(int)[::-1]
    padded = np.pad(np.asarray(mask.voxels[box], dtype=np.uint8), [(n, n) for n in margin])
    affine = mask.affine.copy()
    affine[:3, 3] = mask.to_world(
        np.array([side.start - n for side, n in zip(box, margin, strict=True)][::-1])
    )
    image = sitk.GetImageFromArray(padded)
    set_grid(image, affine)
    distance = sitk.SignedMaurerDistanceMap(
        image, insideIsPositive=False, squaredDistance=False, useImageSpacing=True
    )
    size = np.maximum(
        np.ceil((np.array(image.GetSize()) - 1) * np.array(image.GetSpacing()) / _GRID_MM).astype(int) + 1, 4
    )
    distance = sitk.Resample(
        sitk.Cast(distance, sitk.sitkFloat32),
        size.tolist(),
        sitk.Transform(3, sitk.sitkIdentity),
        sitk.sitkLinear,
        image.GetOrigin(),
        [_GRID_MM] * 3,
        image.GetDirection(),
        _FARTHEST_MM,
        sitk.sitkFloat32,
    )
    return sitk.Clamp(distance, sitk.sitkFloat32, -_FARTHEST_MM, _FARTHEST_MM)


def _residual(first: sitk.Image, second: sitk.Image, surface: np.ndarray, to_first: np.ndarray) -> float:
    """Mean mm by which two aligned surfaces differ, at points (N, 3) of the second one.

    A voxel's centre at the surface lies inside of it by some part of a voxel, so its own distance is taken off.
    """
    there = _values(first, surface @ to_first[:3, :3].T + to_first[:3, 3])
    return float(np.abs(there - _values(second, surface)).mean())


def _values(image: sitk.Image, points: np.ndarray) -> np.ndarray:
    """An image's values (N,) at points (N, 3) in mm, by linear interpolation."""
    from scipy.ndimage import map_coordinates

    grid = Volume.from_sitk(image)
    index = grid.to_index(points)[:, ::-1].T
    return map_coordinates(grid.voxels, index, order=1, mode="constant", cval=_FARTHEST_MM)


def _border(mask: Volume) -> np.ndarray:
    """Voxels (N, 3) of a mask beside its outside, in LPS mm; evenly thinned out where there are very many."""
    from scipy.ndimage import binary_erosion

    box = bounding_box(mask.voxels)
    assert box is not None
    whole = np.asarray(mask.voxels[box], dtype=bool)
    indices = np.argwhere(whole & ~np.asarray(binary_erosion(whole), dtype=bool)) + [
        side.start for side in box
    ]
    return mask.to_world(indices[:: -(-len(indices) // _MOST_POINTS)][:, ::-1])
