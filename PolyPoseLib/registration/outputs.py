"""From poses and cameras to what a result holds: the dense transform, warped volumes and renderings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.ndimage import map_coordinates

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.registration.fit.levels import pixel_size_mm
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import WORKING_MM
from PolyPoseLib.rendering.rigid import project_body
from PolyPoseLib.warp.composition import compose_warped_ct, compose_warped_labels
from PolyPoseLib.warp.dense import AnyWarp, displacement_field, warp_labels, warp_volume
from PolyPoseLib.warp.inverse import invert_field
from PolyPoseLib.warp.on_bones import fitted_to_bones
from PolyPoseLib.warp.polyrigid import PolyrigidWarp
from PolyPoseLib.warp.unfold import unfolded
from PolyPoseLib.warp.weights import distance_maps

TRANSFORM_MM = 3.0
"""Grid of the transform that is handed out."""

COARSEST_MM = 4.0
"""No grid of a transform is coarser."""

MARGIN_MM = 20.0
"""How far the transform reaches beyond the CT: anatomy moves out of it."""

LARGEST_RENDERING = 1024
"""Renderings are made at most this many pixels wide and interpolated to larger X-rays."""

EXACT_WORK = 3e7
"""Voxels times structures up to which volumes are warped point by point instead of through the transform."""


@dataclass(frozen=True)
class Warped:
    """The dense transform, and what it makes of the study's volumes.

    Attributes
    ----------
    transform : DisplacementField
        Fixed to moving.
    ct : Volume
        HU, in the fixed frame.
    labels : Volume
        In the fixed frame, numbered as in the study's segmentation.
    inverse : DisplacementField
        Moving to fixed, of ``transform``.

    """

    transform: DisplacementField
    ct: Volume
    labels: Volume
    inverse: DisplacementField


def warp_study(
    study: Study, soft: SoftTissue, poses: np.ndarray, spacing_mm: float, composed: bool, unfold: bool = True
) -> Warped:
    """The dense transform, and the CT and its labels in the fixed frame.

    Parameters
    ----------
    study : Study
        The CT and its segmentation.
    soft : SoftTissue
        Gives the warp, and the device on which torch computes it if torch does.
    poses : (K, 4, 4) ndarray
        Fixed to moving.
    spacing_mm : float
        Grid of the transform.
    composed : bool
        Lay every bone rigidly over the warped soft tissue instead of warping everything alike.
    unfold : bool
        Relax folds out of the soft tissue, and fit the transform to the bones where the warp keeps them rigid.

    Returns
    -------
    Warped
        On grids that cover the CT.

    """
    device, resampling = soft.device, _resampling_device(soft.device)
    distances = distance_maps(study.structures, study.ct.affine).to(device)
    exact = soft.warp(distances, poses)
    affine, shape, aligned = transform_grid(study.ct, spacing_mm)
    as_posed = soft.moved(displacement_field(exact, affine, shape, device=device))
    near = _near_bone(exact, affine)
    without_folds = unfolded(as_posed, near, resampling) if unfold else as_posed
    transform = without_folds
    bones = Volume(study.structures.labels, study.ct.affine)
    if unfold and exact.form == "rigid" and exact.frame == "moving":
        transform = fitted_to_bones(without_folds, bones, poses, resampling)
    small = study.ct.voxels.size * len(study.structures.names) <= EXACT_WORK
    is_exact = without_folds is as_posed and soft.coefficients is None
    warp: AnyWarp = exact if small and not aligned and is_exact else transform
    inverse = invert_field(transform, device=resampling).field
    labels = warped_source(study)
    if composed:
        ct = compose_warped_ct(study.ct, study.structures, poses, warp, device=resampling)
        carried = compose_warped_labels(labels, study.structures, poses, warp, device=resampling)
        return Warped(transform, ct, carried, inverse)
    ct, carried = warp_volume(study.ct, warp, device=resampling), warp_labels(labels, warp, device=resampling)
    return Warped(transform, ct, carried, inverse)


def warped_source(study: Study) -> Volume:
    """The label map that is warped: the study's own, or its structures."""
    return study.source_segmentation or Volume(study.structures.labels, study.ct.affine)


def _resampling_device(device: torch.device | None) -> torch.device | None:
    """Where torch resamples and inverts: a GPU. On a CPU SimpleITK takes a fifth of its time, loops a tenth."""
    return device if device is not None and device.type == "cuda" else None


def _near_bone(warp: PolyrigidWarp, affine: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Whether points (N, 3) lie within one node's distance of a bone: those further off hardly count inside it."""
    spacing = float(np.linalg.norm(affine[:3, :3], axis=0).max())

    def near(points: np.ndarray) -> np.ndarray:
        places = torch.as_tensor(points, device=warp.distances.signed.device)
        return (warp.distances.under(places, warp.poses).amin(dim=0) <= spacing).cpu().numpy()

    return near


def transform_grid(ct: Volume, spacing_mm: float) -> tuple[np.ndarray, tuple[int, int, int], bool]:
    """Affine and shape (k, j, i) of the transform's grid, and whether its nodes lie on the CT's voxels.

    They do when the voxels are about as large as asked for: warping the CT then needs no interpolation of the
    transform. A grid of TRANSFORM_MM or coarser may be replaced by voxels up to COARSEST_MM, a finer one was asked for.
    """
    spacing = ct.spacing
    coarsest = COARSEST_MM if spacing_mm >= TRANSFORM_MM else 1.25 * spacing_mm
    if (spacing >= 0.8 * spacing_mm).all() and (spacing <= coarsest).all():
        pad = np.ceil(MARGIN_MM / spacing).astype(int)
        affine = ct.affine.copy()
        affine[:3, 3] -= affine[:3, :3] @ pad
        depth, height, width = (int(n) for n in np.array(ct.shape) + 2 * pad[::-1])
        return affine, (depth, height, width), True
    return *covering_grid(ct.affine, ct.shape, spacing_mm, MARGIN_MM, keep_coarser=False), False


def render_views(
    run: Run, cameras: Sequence[Camera], poses: np.ndarray, coarse_mm: float | None = None
) -> list[np.ndarray]:
    """Line integrals (H, W) float32 of every view, bones and soft tissue posed by ``poses`` (K, 4, 4).

    coarse_mm: of voxels and ray steps, and about of pixels, which are interpolated to the view's; None for the finest.
    """
    soft, backend, size_mm = run.soft_tissue, run.backend, coarse_mm or WORKING_MM
    field = soft.coarse_field(poses)
    images = []
    for camera in cameras:
        factor = max(1, -(-max(camera.height, camera.width) // LARGEST_RENDERING))
        if coarse_mm is not None:
            pixels = int(coarse_mm / pixel_size_mm(camera, run.scene.anchor_centre))
            factor = max(factor, min(pixels, min(camera.height, camera.width) // 16))
        small = camera.binned(factor) if factor > 1 else camera
        image = soft.render(field, small, np.eye(4), size_mm, backend)
        for body, pose in zip(run.scene.bodies(size_mm), poses, strict=True):
            part = project_body(body, small, pose, size_mm, backend)
            image[part.slices] += part.image
        images.append(_enlarged(image, camera, factor))
    return images


def _enlarged(image: np.ndarray, camera: Camera, factor: int) -> np.ndarray:
    """Undo a camera's binning by linear interpolation between the blocks' centres."""
    if factor == 1:
        return image
    rows = (np.arange(camera.height) + 0.5) / factor - 0.5
    columns = (np.arange(camera.width) + 0.5) / factor - 0.5
    grid = np.meshgrid(rows, columns, indexing="ij")
    return map_coordinates(image, grid, order=1, mode="nearest").astype(np.float32)
