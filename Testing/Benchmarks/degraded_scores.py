"""What counts as a silent failure and as a false alarm, and how a result of a degraded case is scored."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.truth import Truth
from PolyPoseLib.evaluation.calibration import interval_ratios
from PolyPoseLib.evaluation.metrics import mask_points, structure_errors
from PolyPoseLib.evaluation.score import camera_errors
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.uncertainty.doubts import WIDE_MM

FAILED_MM, RIGHT_MM = 3.0, 1.5
"""Mean error over a bone's voxels beyond which it failed, and within which it is right; they scale with the anatomy."""

REFUSED, DISTRUSTED = 2, 3
"""Exit statuses."""

_FLAG = re.compile(
    r"contradict|inconsisten|uncertain|not reliable|shows in no|hidden|leaves view|fit equally", re.I
)
"""Words of a warning that tells a person not to rely on the bone it names."""


def score_folder(
    output: Path, truth: Truth, given_to_true: np.ndarray, stands_for: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Errors, flags and intervals of a result folder.

    Parameters
    ----------
    output : Path
        Of `register`.
    truth : Truth
    given_to_true : ndarray (4, 4)
        From the world of the CT that was given to that of the true one. Errors are distances between where a voxel of
        the CT is found and where it really is, wherever the given CT's header puts it.
    stands_for : {str: str}, optional
        {structure of the truth: structure of the result} where a study fused bones that the truth moves apart; such
        bones have their body's flag, and no interval.

    Returns
    -------
    dict
        "bones" {name of every structure but the anchor: {"tre_mean_mm", "tre_max_mm", "rest_mm", "flagged",
        "interval_ratio": Mahalanobis distance of the pose over its 95 % quantile, None without an interval,
        "along_mm", "across_mm": half width of the stated interval}}, "cameras" [projection error in mm, degrees,
        error of the anchor's depth along the view in mm], "distrust", "warnings".
    """
    result = json.loads((output / "result.json").read_text(encoding="utf-8"))
    names = truth.names
    bodies = {name: (stands_for or {}).get(name, name) for name in names}
    labels = truth.moving_labels
    true = np.stack([truth.fixed_to_moving[name] for name in names])
    given = [np.array(result["structures"][bodies[name]]["fixed_to_moving"]) for name in names]
    found = np.stack([given_to_true @ pose for pose in given])
    errors = structure_errors(labels.voxels, labels.affine, names, true, found)
    rest = structure_errors(labels.voxels, labels.affine, names, true, np.tile(np.eye(4), (len(names), 1, 1)))
    bones = {}
    for n, name in enumerate(names):
        if name == truth.anchor:
            continue
        stated = result["structures"][name].get("uncertainty") if bodies[name] == name else None
        centroid = mask_points(labels.voxels == n + 1, labels.affine).mean(axis=0)
        bones[name] = {
            "tre_mean_mm": errors[name]["mean"],
            "tre_max_mm": errors[name]["max"],
            "rest_mm": rest[name]["mean"],
            "flagged": is_flagged(bodies[name], result),
            "interval_ratio": _ratio(true[n], given_to_true, given[n], centroid, stated),
            "along_mm": None if stated is None else stated["along_mm"],
            "across_mm": None if stated is None else max(stated["across_mm"]),
        }
    return {
        "bones": bones,
        "cameras": [
            _camera_error(camera, each, truth)
            for camera, each in zip(truth.cameras, result["cameras"], strict=True)
        ],
        "distrust": result["distrust"],
        "warnings": result["warnings"],
    }


def is_flagged(name: str, result: Mapping[str, Any]) -> bool:
    """Whether a result's JSON object tells a person not to rely on a bone."""
    return any(f'"{name}"' in warning and _FLAG.search(warning) for warning in result["warnings"])


def is_inside(bone: Mapping[str, Any]) -> bool:
    """Whether a bone's error lies inside the interval that was stated with it."""
    ratio = bone["interval_ratio"]
    return ratio is not None and ratio <= 1


def is_called_uncertain(bone: Mapping[str, Any], row: Mapping[str, Any]) -> bool:
    """Whether a result names reasons to doubt a bone for the width of its interval."""
    widest = max((bone[key] for key in ("along_mm", "across_mm") if bone[key] is not None), default=0.0)
    return widest > WIDE_MM * row["size_factor"]


def silent_failures(row: Mapping[str, Any]) -> list[str]:
    """Bones that failed at exit 0 without being flagged, and whose interval excludes the truth."""
    if row["exit_status"] != 0:
        return []
    limit = FAILED_MM * row["size_factor"]
    return [
        name
        for name, bone in row.get("bones", {}).items()
        if bone["tre_mean_mm"] > limit and not bone["flagged"] and not is_inside(bone)
    ]


def false_flags(row: Mapping[str, Any]) -> list[str]:
    """Bones that are right and were called inconsistent."""
    return [name for name, bone in row.get("bones", {}).items() if _right(bone, row) and bone["flagged"]]


def is_false_refusal(row: Mapping[str, Any]) -> bool:
    """Whether a recoverable case was refused, or distrusted although its bones are right.

    They are right when their mean error is within RIGHT_MM on average and none failed.
    """
    if not row["recoverable"]:
        return False
    if row["exit_status"] == REFUSED:
        return True
    return row["exit_status"] == DISTRUSTED and bones_right(row)


def bones_right(row: Mapping[str, Any]) -> bool:
    """Whether no bone of a row failed and they are right on average."""
    errors = np.array([bone["tre_mean_mm"] for bone in row.get("bones", {}).values()]) / row["size_factor"]
    return len(errors) > 0 and errors.mean() <= RIGHT_MM and errors.max() <= FAILED_MM


def is_broken(row: Mapping[str, Any]) -> bool:
    """Whether the program neither finished nor refused: a crash, or the time limit."""
    return row["exit_status"] not in (0, REFUSED, DISTRUSTED)


def false_alarm_percent(rows: list[dict[str, Any]]) -> float:
    """Right bones that were called inconsistent, in percent of all right bones; NaN of none."""
    right = [bone for row in rows for bone in row.get("bones", {}).values() if _right(bone, row)]
    return 100 * float(np.mean([bone["flagged"] for bone in right])) if right else float("nan")


def coverage(rows: list[dict[str, Any]], scales: np.ndarray, flagged: bool = True) -> np.ndarray:
    """Percent (S,) of bones whose error is inside s times the stated interval, for scales s (S,).

    Parameters
    ----------
    rows : list of rows
    scales : ndarray (S,)
    flagged : bool
        Whether bones count that are flagged: their intervals are made wide.
    """
    ratios = np.array([bone["interval_ratio"] for bone in _stated(rows) if flagged or not bone["flagged"]])
    if not len(ratios):
        return np.full(len(scales), np.nan)
    return 100 * (ratios[None] <= np.asarray(scales)[:, None]).mean(axis=1)


def _stated(rows: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Bones that come with an interval."""
    for row in rows:
        yield from (b for b in row.get("bones", {}).values() if b["interval_ratio"] is not None)


def _right(bone: Mapping[str, Any], row: Mapping[str, Any]) -> bool:
    return bone["tre_mean_mm"] <= RIGHT_MM * row["size_factor"]


def _ratio(
    true: np.ndarray, given_to_true: np.ndarray, found: np.ndarray, centroid: np.ndarray, stated: Any
) -> float | None:
    """Error of a pose over its stated region, in the given CT's world; None without a region that can be compared."""
    if stated is None or not np.isfinite(np.array(stated["covariance"], dtype=float)).all():
        return None
    true_to_given = np.linalg.inv(given_to_true)
    truth_in_given = true_to_given @ true
    left, _, right = np.linalg.svd(
        truth_in_given[:3, :3]
    )  # the nearest rigid motion, should the CT be stretched
    middle = true_to_given[:3, :3] @ centroid + true_to_given[:3, 3]
    fixed = (np.linalg.inv(true) @ np.append(centroid, 1))[:3]
    rigid = np.eye(4)
    rigid[:3, :3] = left @ right
    rigid[:3, 3] = middle - rigid[:3, :3] @ fixed
    return interval_ratios(rigid, found, middle, stated)["pose"]


def _camera_error(true: Camera, found: Mapping[str, Any], truth: Truth) -> list[float]:
    """Error of the anchor's projected points in mm, of the rotation in degrees, and of the anchor's depth in mm."""
    camera = Camera(np.array(found["K"]), np.array(found["extrinsic"]), found["height"], found["width"])
    errors = camera_errors(true, camera, truth)
    labels = truth.moving_labels
    anchor = mask_points(labels.voxels == truth.names.index(truth.anchor) + 1, labels.affine).mean(axis=0)
    depth = (camera.extrinsic @ np.append(anchor, 1))[2] - (true.extrinsic @ np.append(anchor, 1))[2]
    return [errors["projection_mean_mm"], errors["rotation_deg"], float(depth)]
