"""A registration's result against the truth of a simulated case, as one table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.result import INTERVALS
from PolyPoseLib.data.truth import Truth
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation import metrics
from PolyPoseLib.evaluation.calibration import interval_ratios
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import rigid_inverse

if TYPE_CHECKING:
    from PolyPoseLib.data.displacement_field import DisplacementField
    from PolyPoseLib.data.result import CameraResult, Result

_UNCERTAINTY: dict[str, tuple[int, ...]] = {
    **{name: shape for name, shape in INTERVALS.items() if name != "level"},
    "covariance": (6, 6),
    "along": (3,),
    "across": (2, 3),
}
"""Shapes of what the intervals are scored by."""

_ANCHOR_POINTS = 2000
_FIELD_POINTS = 200_000
_BODY_HU = -500.0
_MINIMUM_ORGAN_VOXELS = 50


def score_result(result: Result, truth: Truth, stands_for: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Score a result against the truth.

    Parameters
    ----------
    result : Result
        Of a registration, such as ``load_result`` reads.
    truth : Truth
        Of the same case, such as ``load_truth`` reads.
    stands_for : Mapping[str, str], optional
        {structure of the truth: structure of the result} where names differ, as when a study fused bones that the
        truth moves apart.

    Returns
    -------
    dict[str, Any]
        A table that json can write: "structures" {name: { "tre_mean_mm", "tre_p95_mm", "tre_max_mm": error of the
        transform over the structure's voxels, "pose_tre_mean_mm", "pose_tre_max_mm": error of the structure's own
        rigid motion over them, "pose_rotation_deg": angle between the true and the found motion, "pose_error":
        the found pose against the truth, rotation vector (3, degrees) and displacement of the centroid (3, mm),
        LPS, "rest_tre_mean_mm": the error of doing nothing, "dice": 0 to 1, "hd95_mm": of the warped labels,
        "uncertainty": as the result has it, when it has, "interval_ratios": errors over the intervals stated, see
        :func:`PolyPoseLib.evaluation.calibration.interval_ratios`}}, "summary" {"mean_tre_mm", "worst_tre_mm"
        (largest mean), "mean_pose_tre_mm", "worst_pose_tre_mm", "mean_rest_tre_mm", "mean_dice": over all
        structures but the anchor; "organ_dice": mean over organs; "soft_error_mean_mm": transform against truth
        in the body outside all structures; "folds_percent", "sd_log_jacobian": of the transform}, "cameras"
        [{"projection_mean_mm", "projection_max_mm": of the anchor's points, in the plane through each,
        "rotation_deg", "source_mm": distance between the sources}], "organs" {name: Dice}, "seconds", "warnings",
        "distrust".

    Raises
    ------
    InputError
        The result lacks a structure or a camera of the truth.

    """
    names = {name: (stands_for or {}).get(name, name) for name in truth.names}
    missing = [name for name in names.values() if name not in result.structures]
    if missing:
        raise InputError(
            f"The result has no structure {missing[0]!r}: score it against the truth of the same study."
        )
    if len(result.cameras) != len(truth.cameras):
        raise InputError(
            f"The result has {len(result.cameras)} cameras and the truth {len(truth.cameras)}: "
            "score it against the truth of the same study."
        )
    poses = {name: result.structures[found].fixed_to_moving for name, found in names.items()}
    table = score_motion(poses, result.transform, truth)
    for name, found in names.items():
        stated = result.structures[found].uncertainty
        if stated is None:
            continue
        table["structures"][name]["uncertainty"] = dict(stated)
        if found == name and _is_whole(stated, name):
            table["structures"][name]["interval_ratios"] = interval_ratios(
                truth.fixed_to_moving[name], poses[name], _centroid(truth, name), stated
            )
    table["cameras"] = [
        camera_errors(true, found, truth) for true, found in zip(truth.cameras, result.cameras, strict=True)
    ]
    table["seconds"] = {stage: float(seconds) for stage, seconds in result.seconds.items()}
    table["warnings"] = list(result.warnings)
    table["distrust"] = list(result.distrust)
    return table


def _is_whole(uncertainty: Mapping[str, Any], name: str) -> bool:
    """Whether every number of a structure's uncertainty is finite; raises InputError when it is no uncertainty at all.

    A result folder has null for numbers that are not finite.
    """
    where = f'The uncertainty of "{name}"'
    directions = uncertainty.get("directions")
    directions = directions if isinstance(directions, Mapping) else {}
    parts = {**uncertainty, "along": directions.get("along"), "across": directions.get("across")}
    finite = True
    for part, shape in _UNCERTAINTY.items():
        try:
            numbers = np.array(parts.get(part), dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            numbers = None
        if numbers is None or numbers.shape != shape:
            raise InputError(f'{where} lacks "{part}", or has it in another form: register again.')
        finite &= bool(np.isfinite(numbers).all())
        if part in INTERVALS and not (numbers[np.isfinite(numbers)] > 0).all():
            raise InputError(f'{where} has an interval "{part}" that is not above 0: register again.')
    if not finite:
        return False
    covariance = np.array(uncertainty["covariance"], dtype=np.float64)
    if not np.linalg.eigvalsh((covariance + covariance.T) / 2)[0] > 0:
        raise InputError(f"{where} has a covariance that is not positive definite: register again.")
    return True


def score_motion(poses: dict[str, np.ndarray], transform: DisplacementField, truth: Truth) -> dict[str, Any]:
    """The parts of score_result that need motions {structure: (4, 4) fixed -> moving} and a transform."""
    from PolyPoseLib.warp.dense import jacobian_determinant, warp_labels

    labels, names = truth.moving_labels, truth.names
    true = np.stack([truth.fixed_to_moving[name] for name in names])
    found = np.stack([poses[name] for name in names])
    by_warp = metrics.structure_errors(labels.voxels, labels.affine, names, true, transform)
    by_pose = metrics.structure_errors(labels.voxels, labels.affine, names, true, found)
    at_rest = metrics.structure_errors(
        labels.voxels, labels.affine, names, true, np.tile(np.eye(4), (len(names), 1, 1))
    )
    warped = warp_labels(labels, transform, method="nearest")
    structures = {}
    for n, name in enumerate(names):
        true_mask, found_mask = truth.fixed_labels.voxels == n + 1, warped.voxels == n + 1
        structures[name] = {
            **{f"tre_{kind}_mm": value for kind, value in by_warp[name].items()},
            **{f"pose_tre_{kind}_mm": value for kind, value in by_pose[name].items()},
            "pose_rotation_deg": rotation_between_deg(true[n], found[n]),
            "pose_error": _pose_error(true[n], found[n], _centroid(truth, name)),
            "rest_tre_mean_mm": at_rest[name]["mean"],
            "dice": metrics.dice(true_mask, found_mask),
            "hd95_mm": metrics.hausdorff95(true_mask, found_mask, labels.affine),
        }
    organs = _organ_dice(transform, truth)
    determinant = jacobian_determinant(transform)
    moving = [structures[name] for name in names if name != truth.anchor] or list(structures.values())
    return {
        "structures": structures,
        "organs": organs,
        "summary": {
            "mean_tre_mm": _mean(s["tre_mean_mm"] for s in moving),
            "worst_tre_mm": max(s["tre_mean_mm"] for s in moving),
            "mean_pose_tre_mm": _mean(s["pose_tre_mean_mm"] for s in moving),
            "worst_pose_tre_mm": max(s["pose_tre_mean_mm"] for s in moving),
            "mean_rest_tre_mm": _mean(s["rest_tre_mean_mm"] for s in moving),
            "mean_dice": _mean(s["dice"] for s in moving),
            "organ_dice": _mean(organs.values()),
            "soft_error_mean_mm": _soft_error(transform, truth),
            "folds_percent": metrics.fold_percentage(determinant),
            "sd_log_jacobian": metrics.sd_log_jacobian(determinant),
        },
    }


def _centroid(truth: Truth, name: str) -> np.ndarray:
    """(3,) LPS mm of a structure in the CT."""
    labels = truth.moving_labels
    return metrics.mask_points(labels.voxels == truth.names.index(name) + 1, labels.affine).mean(axis=0)


def camera_errors(true: Camera, found: Camera | CameraResult, truth: Truth) -> dict[str, float]:
    """How far a found camera is from the true one: mm at the anchor's points, degrees, mm between sources."""
    if not isinstance(found, Camera):
        found = found.camera
    anchor = truth.moving_labels.voxels == truth.names.index(truth.anchor) + 1
    points = metrics.mask_points(anchor, truth.moving_labels.affine, _ANCHOR_POINTS)
    error = metrics.projection_error_mm(points, true, found)
    return {
        "projection_mean_mm": float(np.nanmean(error)) if np.isfinite(error).any() else float("nan"),
        "projection_max_mm": float(np.nanmax(error)) if np.isfinite(error).any() else float("nan"),
        "rotation_deg": rotation_between_deg(true.extrinsic, found.extrinsic),
        "source_mm": float(np.linalg.norm(true.source - found.source)),
    }


def rotation_between_deg(first: np.ndarray, second: np.ndarray) -> float:
    """Angle in degrees between the rotations of two rigid motions (4, 4)."""
    relative = (rigid_inverse(first) @ second)[:3, :3]
    sine = np.linalg.norm(relative - relative.T) / np.sqrt(8)
    return float(np.degrees(np.arctan2(sine, (np.trace(relative) - 1) / 2)))


def _pose_error(true: np.ndarray, found: np.ndarray, moving: np.ndarray) -> list[float]:
    """Rotation vector in degrees and displacement in mm of a bone's centroid, from its true to its found place.

    moving: (3,) the centroid in the CT, LPS mm.
    """
    from scipy.spatial.transform import Rotation

    error = rigid_inverse(found) @ true
    centroid = rigid_inverse(true) @ np.append(moving, 1.0)
    turn = np.degrees(Rotation.from_matrix(error[:3, :3]).as_rotvec())
    return [*turn.tolist(), *(error @ centroid - centroid)[:3].tolist()]


def _organ_dice(transform: DisplacementField, truth: Truth) -> dict[str, float]:
    """Dice of every organ that is large enough to have one."""
    from PolyPoseLib.warp.dense import warp_labels

    if truth.moving_organs is None or truth.fixed_organs is None:
        return {}
    warped = warp_labels(truth.moving_organs, transform, method="nearest").voxels
    fixed = truth.fixed_organs.voxels
    large = {
        number: name
        for number, name in truth.organ_names.items()
        if np.count_nonzero(fixed == number) >= _MINIMUM_ORGAN_VOXELS
    }
    return metrics.dice_per_label(fixed, warped, large)


def _soft_error(transform: DisplacementField, truth: Truth) -> float:
    """Mean distance in mm between the found and the true transform in the body outside all structures."""
    soft = (truth.fixed_ct.voxels > _BODY_HU) & (truth.fixed_labels.voxels == 0)
    points = metrics.mask_points(soft, truth.fixed_ct.affine, _FIELD_POINTS)
    if not len(points):
        return float("nan")
    return float(np.linalg.norm(transform.sample(points) - truth.field.sample(points), axis=1).mean())


def _mean(values: Any) -> float:
    """Mean of numbers, NaN of none."""
    values = list(values)
    return float(np.mean(values)) if values else float("nan")
