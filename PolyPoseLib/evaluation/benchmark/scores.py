"""One system's motion on one case, as numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation import metrics
from PolyPoseLib.evaluation.benchmark.ends import before_ends
from PolyPoseLib.evaluation.benchmark.held_out import MINIMUM_MM2, room_for, score_views
from PolyPoseLib.evaluation.benchmark.label_masks import LabelMasks, joint_box
from PolyPoseLib.evaluation.benchmark.smoothness import smoothness
from PolyPoseLib.geometry.rigid import rigid_inverse

TRE_POINTS = 20_000
"""Voxels of a structure over which errors are taken, drawn with a fixed seed."""

_MEANS = ("dice", "hd95_mm", "tre_mean_mm", "pose_tre_mean_mm", "rest_tre_mean_mm")
_MEANS_2D = ("dice", "hd95_px", "hd95_mm")


def score_case(case: BenchmarkCase, motion: Motion, minimum_mm2: float = MINIMUM_MM2) -> dict[str, Any]:
    """Score a motion against a case's truth.

    The source segmentation is pulled through the motion, ``warped(x) = labels(x + u(x))``, by the nearest voxel: so
    labels that are scored together may be warped apart, and no structure grows or shrinks by how labels vote.

    Parameters
    ----------
    case : BenchmarkCase
        Whose truth has labels, held-out views, poses or a field.
    motion : Motion
        From fixed to moving points.
    minimum_mm2 : float
        At the detector: structures with a smaller silhouette in a held-out view's truth are left out there.

    Returns
    -------
    dict
        A table that json can write; None stands for what is not defined.

        - "structures" {name: ...}: with true labels "dice" (0 to 1), "hd95_mm", "voxels" (of the truth), "lost" (the
          truth has it and the warped labels do not: the distance is then the diagonal of the truth's grid), "cut_off"
          (it reaches an end of the CT's or of the truth's grid, and may go on beyond), "trimmed" (it is scored only at
          a distance from such an end, see :class:`CaseTruth`'s ends); with a true pose or field
          "tre_mean_mm", "tre_p95_mm", "tre_max_mm" over its voxels, "rest_tre_mean_mm" of doing nothing and, where
          the motion has a pose of it, "pose_tre_mean_mm".
        - "groups" {group: means over those of its structures that have the number, and "structures": how many have a
          Dice coefficient}.
        - "held_out": of :func:`PolyPoseLib.evaluation.benchmark.held_out.score_views`, and "groups" as above;
          absent without such views.
        - "folds_percent", "sd_log_jacobian": of :func:`PolyPoseLib.evaluation.benchmark.smoothness.smoothness`, over
          the CT's voxels.

    Raises
    ------
    InputError
        The case has no truth or no source segmentation, or none of its structures has a voxel in the truth.

    """
    truth, source = case.truth, case.study.source_segmentation
    if source is None:
        raise InputError(f"{case.name}: the study has no label map to warp: its reader must give one.")
    if truth.labels is None and truth.field is None and not truth.poses and not truth.held_out:
        raise InputError(
            f"{case.name}: the case has no truth: give labels, held-out views, poses or a field of the fixed posture."
        )
    structures: dict[str, dict[str, Any]] = {name: {} for name in case.labels}
    moving = LabelMasks(source)
    warped = true = None
    if truth.labels is not None:
        true = LabelMasks(truth.labels)
        warped = warped_masks(source, motion.field, truth.labels)
        for name, numbers in case.labels.items():
            ends = truth.ends.get(name)
            structures[name] |= _overlap(true, warped, numbers, ends)
            cut_off = (moving.reaches_end(numbers) and ends is None) or true.reaches_end(numbers)
            structures[name] |= {"cut_off": cut_off, "trimmed": ends is not None}
        if not any(each["voxels"] for each in structures.values()):
            raise InputError(
                f"{case.name}: none of its structures has a voxel in the true labels: number them as the CT's."
            )
    for name in case.labels:
        structures[name] |= _target_errors(case, motion, name, moving, true)
    scores: dict[str, Any] = {"structures": structures, "groups": _groups(case, structures, _MEANS)}
    if truth.held_out:
        # Without true labels there is no grid to stay on: whatever moves out of the CT must still be seen.
        warped = warped or warped_masks(source, motion.field, room_for(source, motion.field))
        scores["held_out"] = score_views(case, warped, minimum_mm2)
        scores["held_out"]["groups"] = _groups(case, scores["held_out"]["structures"], _MEANS_2D)
    return scores | smoothness(motion.field, case.study.ct)


def warped_masks(source: Volume, field: DisplacementField, reference: Volume) -> LabelMasks:
    """The source segmentation's structures in the fixed frame, on a reference's grid, by the nearest voxel."""
    from PolyPoseLib.warp.dense import warp_labels

    return LabelMasks(warp_labels(source, field, reference, method="nearest"))


def _overlap(
    true: LabelMasks, warped: LabelMasks, numbers: tuple[int, ...], ends: np.ndarray | None
) -> dict[str, Any]:
    """Dice coefficient and distance of a structure before its ends; None where the truth does not have it."""
    box = joint_box(true.box(numbers), warped.box(numbers))
    first, second = true.mask(numbers, box), warped.mask(numbers, box)
    if first is not None and second is not None:
        first, second = before_ends(first, ends), before_ends(second, ends)
    if first is None or second is None or not first.voxels.any():
        return {"dice": None, "hd95_mm": None, "voxels": 0, "lost": False}
    lost = not second.voxels.any()
    grid = true.labels
    diagonal = float(np.linalg.norm(grid.affine[:3, :3] @ grid.shape[::-1]))
    return {
        "dice": metrics.dice(first.voxels, second.voxels),
        "hd95_mm": diagonal if lost else metrics.hausdorff95(first.voxels, second.voxels, first.affine),
        "voxels": int(np.count_nonzero(first.voxels)),
        "lost": lost,
    }


def _target_errors(
    case: BenchmarkCase, motion: Motion, name: str, moving: LabelMasks, true: LabelMasks | None
) -> dict[str, Any]:
    """Target registration errors over a structure's voxels, where a true pose or a true field is known."""
    known = _targets(case, name, moving, true)
    if known is None:
        return {}
    points, truth = known
    errors = metrics.summary(metrics.target_registration_error(points, truth, motion.field))
    at_rest = metrics.summary(metrics.target_registration_error(points, truth, np.eye(4)))
    scores = {f"tre_{kind}_mm": value for kind, value in errors.items()}
    scores["rest_tre_mean_mm"] = at_rest["mean"]
    if name in motion.poses:
        by_pose = metrics.target_registration_error(points, truth, motion.poses[name])
        scores["pose_tre_mean_mm"] = metrics.summary(by_pose)["mean"]
    return scores


def _targets(
    case: BenchmarkCase, name: str, moving: LabelMasks, true: LabelMasks | None
) -> tuple[np.ndarray, np.ndarray | DisplacementField] | None:
    """Points (N, 3) of a structure in the fixed posture, and their true motion; None where it is not known."""
    numbers, pose, field = case.labels[name], case.truth.poses.get(name), case.truth.field
    mask = moving.mask(numbers, moving.box(numbers))
    if mask is None or (pose is None and field is None):
        return None
    if pose is not None:
        inverse = rigid_inverse(np.asarray(pose, dtype=np.float64))
        points = metrics.mask_points(mask.voxels, mask.affine, TRE_POINTS)
        return points @ inverse[:3, :3].T + inverse[:3, 3], pose
    assert field is not None
    if true is None:
        # Where the structure lies in the fixed posture, the true field itself tells.
        labels = mask.with_voxels(mask.voxels.astype(np.uint8))
        true, numbers = warped_masks(labels, field, room_for(labels, field)), (1,)
    fixed = true.mask(numbers, true.box(numbers))
    return None if fixed is None else (metrics.mask_points(fixed.voxels, fixed.affine, TRE_POINTS), field)


def _groups(
    case: BenchmarkCase, structures: Mapping[str, Mapping[str, Any]], keys: Iterable[str]
) -> dict[str, dict[str, Any]]:
    """Means over the structures of each group, each structure counting once, whatever its size."""
    groups = {}
    for group, names in case.groups.items():
        scored = [structures[name] for name in names if name in structures]
        means: dict[str, Any] = {}
        for key in keys:
            values = [each[key] for each in scored if each.get(key) is not None]
            if values:
                means[key] = float(np.mean(values))
        means["structures"] = sum(each.get("dice") is not None for each in scored)
        groups[group] = means
    return groups
