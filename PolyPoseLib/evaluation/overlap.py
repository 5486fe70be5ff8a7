"""A result against a second segmentation, made on the patient as the X-rays saw it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.segmentation import Segmentation, labels_present, whole_numbers
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation import metrics
from PolyPoseLib.evaluation.benchmark.label_masks import LabelMasks, joint_box

if TYPE_CHECKING:
    from PolyPoseLib.data.result import Result


def score_segmentation(
    result: Result, segmentation: Segmentation, names: Mapping[int, str] | None = None
) -> dict[str, Any]:
    """Score a result's warped labels against labels of the fixed frame that have the same numbers.

    Only what both scans show is compared, on the second segmentation's grid: beyond its ends nobody knows what is
    right, and beyond the CT's the result has no labels.

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
        centroids, "cut_off": whether it reaches an end of what both scans show, and is scored up to there}} for
        every label of the CT that the second segmentation has; "not_in_ct": names of the labels that the CT's label map
        lacks (of results of earlier versions: that the warped labels lack), which are not scored; "summary"
        {"mean_dice", "folds_percent", "sd_log_jacobian"}.

    Raises
    ------
    InputError
        The segmentation has overlapping layers, or both have no label in common where both scans show something.

    """
    from PolyPoseLib.warp.dense import jacobian_determinant

    fixed = _label_map(segmentation)
    warped = whole_numbers(result.warped_labels, "warped_labels.nii.gz")
    shown = _shown(warped, fixed)
    true = LabelMasks(fixed.with_voxels(np.where(shown, fixed.voxels, 0)))
    found = LabelMasks(resample_labels_onto(warped, fixed))
    at_end = _border(shown)
    known = set(result.segmentation_labels or labels_present(warped.voxels).tolist())
    present = labels_present(true.labels.voxels).tolist()
    scored = [label for label in present if label in known]
    if not scored:
        raise InputError(
            "The second segmentation and the CT's labels have no label in common where both scans show the patient: "
            "use the same numbers in both."
        )
    table = {_name(label, names): _scores(true, found, label, at_end) for label in scored}
    determinant = jacobian_determinant(result.transform)
    return {
        "labels": table,
        "not_in_ct": [_name(label, names) for label in present if label not in known],
        "summary": {
            "mean_dice": float(np.mean([each["dice"] for each in table.values()])),
            "folds_percent": metrics.fold_percentage(determinant),
            "sd_log_jacobian": metrics.sd_log_jacobian(determinant),
        },
    }


def _shown(first: Volume, second: Volume) -> np.ndarray:
    """The voxels of the second grid that lie on the first, too."""
    return resample_labels_onto(first.with_voxels(np.ones(first.shape, np.uint8)), second).voxels > 0


def _border(shown: np.ndarray) -> np.ndarray:
    """Voxels that have a face neighbour which is not shown."""
    from scipy.ndimage import binary_erosion

    return shown & np.logical_not(binary_erosion(shown))


def _scores(true: LabelMasks, found: LabelMasks, label: int, at_end: np.ndarray) -> dict[str, Any]:
    """Of one label that the truth has; what the result has lost has no distances."""
    box = joint_box(true.box([label]), found.box([label]))
    first, second = true.mask([label], box), found.mask([label], box)
    assert box is not None and first is not None and second is not None
    masks = first.voxels, second.voxels
    both = masks[1].any()
    centroids = [metrics.mask_points(mask, first.affine).mean(0) for mask in masks] if both else None
    return {
        "dice": metrics.dice(*masks),
        "hd95_mm": metrics.hausdorff95(*masks, first.affine),
        "centroid_mm": float(np.linalg.norm(centroids[0] - centroids[1])) if centroids else float("nan"),
        "cut_off": bool((at_end[box] & (masks[0] | masks[1])).any()),
    }


def _name(label: int, names: Mapping[int, str] | None) -> str:
    return (names or {}).get(label, str(label))


def _label_map(segmentation: Segmentation) -> Volume:
    """The one layer of a segmentation."""
    if segmentation.has_layers:
        raise InputError(
            f"{segmentation.source}: the segmentation has overlapping layers: export it as a label map."
        )
    return segmentation.layers[0]
