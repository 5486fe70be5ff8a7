"""Small anatomy registered at the size of a pelvis, and its result brought back.

Resolution levels, search ranges and reaches are millimetres that suit trunk and limbs. A wrist is therefore registered
as if it, its cameras and its detector were larger by one factor; nothing else distinguishes the two scenes, as line
integrals grow by the same factor.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import CameraResult, Result, StructureResult
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray

FULL_SIZE_MM = 80.0
"""Root mean square distance of the structures' voxels from their centre above which anatomy is taken as it is: 110 for
a pelvis with its femurs, 130 for a chest, 30 for a wrist."""

LARGEST = 8.0
"""Anatomy is not magnified more: a finger's bones."""

_SAMPLES = 20000


def magnification_of(study: Study | Sequence) -> float:
    """The factor, 1 or larger, at which the anatomy of a study, or of a sequence, is registered."""
    labels = study.structures.labels
    places = np.flatnonzero(labels)
    places = places[:: max(1, len(places) // _SAMPLES)]
    index = np.stack(np.unravel_index(places, labels.shape), axis=1)[:, ::-1]
    points = index @ study.ct.affine[:3, :3].T
    size = float(np.sqrt(points.var(axis=0).sum()))
    return float(np.clip(FULL_SIZE_MM / max(size, 1e-6), 1.0, LARGEST))


def magnified(study: Study, factor: float) -> Study:
    """The study with all lengths, and all line integrals, larger by a factor; it is valid as the study is."""
    changes: dict[str, Any] = {
        "ct": magnified_volume(study.ct, factor),
        "xrays": tuple(_xray(xray, factor) for xray in study.xrays),
        "source_segmentation": None
        if study.source_segmentation is None
        else magnified_volume(study.source_segmentation, factor),
        "initial_poses": {name: magnified_motion(pose, factor) for name, pose in study.initial_poses.items()},
    }
    larger = copy(study)
    for name, value in changes.items():
        object.__setattr__(larger, name, value)
    return larger


def at_true_size(result: Result, factor: float) -> Result:
    """The result of a study that was magnified, in the patient's millimetres."""
    back = 1 / factor
    cameras = [
        CameraResult(
            each.camera.with_extrinsic(magnified_motion(each.extrinsic, back)), each.similarity, each.name
        )
        for each in result.cameras
    ]
    return replace(
        result,
        structures={name: _structure(each, back) for name, each in result.structures.items()},
        cameras=cameras,
        warped_ct=magnified_volume(result.warped_ct, back),
        warped_labels=magnified_volume(result.warped_labels, back),
        transform=field_at_true_size(result.transform, factor),
        inverse_transform=None
        if result.inverse_transform is None
        else field_at_true_size(result.inverse_transform, factor),
        soft_tissue_deviation_mm=None
        if result.soft_tissue_deviation_mm is None
        else back * result.soft_tissue_deviation_mm,
        structure_labels=None
        if result.structure_labels is None
        else magnified_volume(result.structure_labels, back),
        renderings_before=[image * np.float32(back) for image in result.renderings_before],
        renderings_after=[image * np.float32(back) for image in result.renderings_after],
        xray_images=[image * np.float32(back) for image in result.xray_images],
    )


def field_at_true_size(field: DisplacementField, factor: float) -> DisplacementField:
    """A displacement field of a magnified scene in the patient's millimetres."""
    return DisplacementField(field.vectors / np.float32(factor), _scaled_affine(field.affine, 1 / factor))


def magnified_volume(volume: Volume, factor: float) -> Volume:
    """A volume whose voxels are larger by a factor."""
    return replace(volume, affine=_scaled_affine(volume.affine, factor))


def _scaled_affine(affine: np.ndarray, factor: float) -> np.ndarray:
    """Axes and origin of a grid, larger."""
    scaled = np.array(affine, dtype=np.float64)
    scaled[:3] *= factor
    return scaled


def magnified_motion(rigid: np.ndarray, factor: float) -> np.ndarray:
    """A rigid motion (4, 4) between two frames that are both larger."""
    moved = np.array(rigid, dtype=np.float64)
    moved[:3, 3] *= factor
    return moved


def _xray(xray: Xray, factor: float) -> Xray:
    def point(value: tuple[float, float, float] | None) -> Any:
        return None if value is None else tuple(factor * each for each in value)

    landmarks, rig, radius = xray.landmarks, xray.rig, xray.initial_radius
    rows, columns = xray.pixel_spacing_mm
    return replace(
        xray,
        image=xray.image * np.float32(factor),
        extrinsic=None if xray.extrinsic is None else magnified_motion(xray.extrinsic, factor),
        pixel_spacing_mm=(factor * rows, factor * columns),
        source_to_detector_mm=factor * xray.source_to_detector_mm,
        initial_radius=None if radius is None else (radius[0], factor * radius[1]),
        isocenter=point(xray.isocenter),
        table_mm=point(xray.table_mm),
        landmarks=None if landmarks is None else replace(landmarks, points=factor * landmarks.points),
        rig=None if rig is None else replace(rig, extrinsic=magnified_motion(rig.extrinsic, factor)),
    )


def _structure(structure: StructureResult, back: float) -> StructureResult:
    assert structure.centroid is not None, "the registration gives every structure's centroid"
    stated = structure.uncertainty
    if stated is not None:
        scale = np.r_[np.ones(3), np.full(3, back)]
        covariance = np.array(stated["covariance"]) * np.outer(scale, scale)
        stated = {
            **stated,
            "covariance": covariance.tolist(),
            "along_mm": back * stated["along_mm"],
            "across_mm": [back * each for each in stated["across_mm"]],
        }
    return StructureResult.from_pose(
        magnified_motion(structure.fixed_to_moving, back), back * structure.centroid, stated, structure.doubts
    )
