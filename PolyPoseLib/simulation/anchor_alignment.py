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


@dataclass(frozen=True, eq=False)
class AnchorAlignment:
    """How a bone lies in two scans.

    Attributes
    ----------
    to_first
        (4, 4) from the second scan's world to the first's, LPS mm.
    residual_mm
        Mean distance of the aligned surfaces, both ways: what no rigid motion explains (the labels' own errors).
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
    with the centroids upon each other, at 8, 4 and 2 mm.

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
    method.SetInterpolator(sitk.sitkLinear)
    method.SetOptimizerAsRegularStepGradientDescent(
        learningRate=2.0, minStep=1e-4, numberOfIterations=200, relaxationFactor=0.6
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
        _residual(first, second, to_first),
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


def _residual(first: Volume, second: Volume, to_first: np.ndarray) -> float:
    """Mean distance in mm between two surfaces once the second is carried onto the first."""
    from scipy.spatial import KDTree

    points = _border(first)
    carried = _border(second) @ to_first[:3, :3].T + to_first[:3, 3]
    there, _ = KDTree(points).query(carried)
    back, _ = KDTree(carried).query(points)
    return float((there.mean() + back.mean()) / 2)


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
