"""Scores in 2D: warped labels seen from cameras that no system was given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from PolyPoseLib.data.benchmark.case import BenchmarkCase, HeldOutView
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation import metrics
from PolyPoseLib.evaluation.benchmark.ends import before_ends
from PolyPoseLib.evaluation.benchmark.label_masks import LabelMasks
from PolyPoseLib.evaluation.benchmark.silhouettes import silhouette
from PolyPoseLib.geometry.grid import bounding_box

MINIMUM_MM2 = 1203.0
"""At the detector: structures with a smaller silhouette in the truth are left out of a view.

The paper leaves out fewer than 500 of DeepFluoro's pixels, which are 1.552 mm wide: 500 of them are above this, 499
below. Larger pixels show the same bone with fewer of them.
"""

FARTHEST_MM = 150.0
"""Structures that a motion carries farther out of the CT are cut off there."""


def room_for(labels: Volume, field: DisplacementField) -> Volume:
    """An empty label map on the labels' grid, cut or widened by whole voxels so that all labels, warped, lie on it.

    A fixed point x takes the label of the moving point x + u(x), so it lies no farther from the labels' box than the
    largest displacement along each axis of the grid.
    """
    box = bounding_box(labels.voxels > 0)
    if box is None:
        return Volume(np.zeros((1, 1, 1), labels.voxels.dtype), labels.affine)
    vectors = field.vectors.reshape(-1, 3) @ np.linalg.inv(labels.affine[:3, :3]).T
    farthest = FARTHEST_MM / labels.spacing
    low = np.floor(-np.minimum(vectors.max(axis=0), farthest)).astype(int) - 1
    high = np.ceil(-np.maximum(vectors.min(axis=0), -farthest)).astype(int) + 1
    first = np.array([side.start for side in reversed(box)]) + low
    size = np.array([side.stop for side in reversed(box)]) + high - first
    affine = labels.affine.copy()
    affine[:3, 3] += affine[:3, :3] @ first
    return Volume(np.zeros(tuple(np.maximum(size, 1)[::-1]), labels.voxels.dtype), affine)


def score_views(case: BenchmarkCase, warped: LabelMasks, minimum_mm2: float = MINIMUM_MM2) -> dict[str, Any]:
    """Score warped labels on a case's held-out views.

    Parameters
    ----------
    case : BenchmarkCase
        With held-out views in its truth.
    warped : LabelMasks
        In the fixed frame, numbered as the case's labels.
    minimum_mm2 : float
        At the detector, of a structure's true silhouette in a view; smaller ones are left out there.

    Returns
    -------
    dict
        "minimum_mm2"; "views" {view: {structure: {"dice", "hd95_px", "hd95_mm", "pixels": of the true silhouette,
        "lost": whether the warped structure is nowhere in the view}}}; "structures" {structure: the means over its
        views and "views": their number}; "left_out" structures that have masks and are large enough in none of the
        views. See :func:`hausdorff95_2d` for the distances; a lost structure has the view's diagonal.

    Raises
    ------
    InputError
        A mask is not of its camera's size, or of a structure that has no labels.

    """
    cut = {}
    for name, numbers in case.labels.items():
        mask = warped.mask(numbers, warped.box(numbers))
        cut[name] = None if mask is None else before_ends(mask, case.truth.ends.get(name))
    views = {view.name: _score_view(case, view, cut, minimum_mm2) for view in case.truth.held_out}
    means = _over_views(case.labels, list(views.values()))
    shown = {name for view in case.truth.held_out for name in view.masks}
    return {
        "minimum_mm2": minimum_mm2,
        "views": views,
        "structures": means,
        "left_out": [name for name in case.labels if name in shown and name not in means],
    }


def _score_view(
    case: BenchmarkCase, view: HeldOutView, cut: Mapping[str, Volume | None], minimum_mm2: float
) -> dict[str, dict[str, Any]]:
    scores = {}
    spacing = np.array(view.pixel_spacing_mm)
    for name, true in view.masks.items():
        true = np.asarray(true, dtype=bool)
        if true.shape != (view.camera.height, view.camera.width):
            raise InputError(
                f'{case.name}: the mask of "{name}" in the held-out view "{view.name}" has {true.shape} pixels, but '
                f"its camera {(view.camera.height, view.camera.width)}."
            )
        if name not in cut:
            raise InputError(
                f'{case.name}: the held-out view "{view.name}" has a mask of "{name}", which has no labels.'
            )
        pixels = int(np.count_nonzero(true))
        if pixels == 0 or pixels * spacing.prod() < minimum_mm2:
            continue
        mask = cut[name]
        found = np.zeros_like(true) if mask is None else silhouette(mask, view.camera)
        lost = not found.any()
        if lost:
            apart = float(np.hypot(*true.shape)), float(np.hypot(*(spacing * true.shape)))
        else:
            apart = hausdorff95_2d(true, found), hausdorff95_2d(true, found, view.pixel_spacing_mm)
        scores[name] = {
            "dice": metrics.dice(true, found),
            "hd95_px": apart[0],
            "hd95_mm": apart[1],
            "pixels": pixels,
            "lost": lost,
        }
    return scores


def _over_views(names: Mapping[str, Any], views: Sequence[Mapping[str, dict]]) -> dict[str, dict[str, Any]]:
    """Means over the views in which a structure is scored; structures that no view shows are absent."""
    means = {}
    for name in names:
        seen = [view[name] for view in views if name in view]
        if seen:
            means[name] = {
                **{
                    key: float(np.mean([each[key] for each in seen]))
                    for key in ("dice", "hd95_px", "hd95_mm")
                },
                "views": len(seen),
                "lost": sum(each["lost"] for each in seen),
            }
    return means


def hausdorff95_2d(
    first: np.ndarray, second: np.ndarray, pixel_spacing_mm: tuple[float, float] = (1.0, 1.0)
) -> float:
    """95th percentile Hausdorff distance of two silhouettes.

    The larger of the two directed 95th percentiles of distances between border pixels' centres; a border pixel has a
    neighbour above, below, left or right that is outside the mask or the image.

    Parameters
    ----------
    first, second : (H, W) array of bool
        Silhouettes of one view.
    pixel_spacing_mm : tuple[float, float]
        Between rows, between columns; (1, 1) gives pixels.

    Returns
    -------
    float
        mm at the detector, or pixels; NaN when one of the masks is empty.

    """
    from scipy.ndimage import binary_erosion
    from scipy.spatial import KDTree

    borders = [
        np.argwhere(mask & np.logical_not(binary_erosion(mask))) * np.asarray(pixel_spacing_mm)
        for mask in (np.asarray(each, dtype=bool) for each in (first, second))
    ]
    if not all(len(border) for border in borders):
        return float("nan")
    there, _ = KDTree(borders[1]).query(borders[0])
    back, _ = KDTree(borders[0]).query(borders[1])
    return float(max(np.percentile(there, 95), np.percentile(back, 95)))
