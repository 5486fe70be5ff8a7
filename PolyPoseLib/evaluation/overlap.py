"""A result against a second segmentation, made on the patient as the X-rays saw it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation import metrics

if TYPE_CHECKING:
    from PolyPoseLib.data.result import Result


def score_segmentation(
    result: Result, segmentation: Segmentation, names: Mapping[int, str] | None = None
) -> dict[str, Any]:
    """Score a result's warped labels against labels of the fixed frame that have the same numbers.

    Parameters
    ----------
    result : Result
        Of a registration, such as ``load_result`` reads.
    segmentation : Segmentation
        Label map in the fixed frame on any grid, such as ``read_segmentation`` reads.
    names : Mapping[int, str], optional
        {label: name} for the table; the numbers themselves when None.

    Returns
    -------
    dict[str, Any]
        A table that json can write: "labels" {name: {"dice": 0 to 1, "hd95_mm", "centroid_mm": distance of the
        centroids}} for every label that the second segmentation has; "summary" {"mean_dice", "folds_percent",
        "sd_log_jacobian"}.

    Raises
    ------
    InputError
        The segmentation has overlapping layers, or both have no label in common.

    """
    from PolyPoseLib.warp.dense import jacobian_determinant

    fixed = _label_map(segmentation)
    found = result.warped_labels
    truth = resample_labels_onto(fixed, found)
    labels = np.unique(truth.voxels)
    if not (np.intersect1d(labels, np.unique(found.voxels)) > 0).any():
        raise InputError(
            "The second segmentation and the warped labels have no label in common: use the same numbers in both."
        )
    table = {}
    for label in labels[labels > 0].tolist():
        masks = truth.voxels == label, found.voxels == label
        both = masks[0].any() and masks[1].any()
        centroids = [metrics.mask_points(mask, found.affine).mean(0) for mask in masks] if both else None
        table[(names or {}).get(label, str(label))] = {
            "dice": metrics.dice(*masks),
            "hd95_mm": metrics.hausdorff95(*masks, found.affine) if both else float("nan"),
            "centroid_mm": float(np.linalg.norm(centroids[0] - centroids[1])) if centroids else float("nan"),
        }
    determinant = jacobian_determinant(result.transform)
    return {
        "labels": table,
        "summary": {
            "mean_dice": float(np.mean([each["dice"] for each in table.values()])),
            "folds_percent": metrics.fold_percentage(determinant),
            "sd_log_jacobian": metrics.sd_log_jacobian(determinant),
        },
    }


def _label_map(segmentation: Segmentation) -> Volume:
    """The one layer of a segmentation."""
    if segmentation.has_layers:
        raise InputError(
            f"{segmentation.source}: the segmentation has overlapping layers: export it as a label map."
        )
    return segmentation.layers[0]
