"""Structures that an end of the earlier scan cuts off: where what both scans show of them begins.

How such a structure goes on beyond the CT no system can know. The part that the CT shows moves with it: it ends where
the true motion has carried the CT's end, and nobody knows that motion of two real scans. So truth and answer are
compared at a distance from the CT's end, farther than the structure has moved: both scans show it there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.evaluation.benchmark.ends import labels_before_ends
from PolyPoseLib.evaluation.benchmark.label_masks import LabelMasks
from PolyPoseLib.evaluation.metrics import surface_points

MARGIN_MM = 10.0
"""Beyond what the surfaces tell: a shaft that slides along itself shows its motion nowhere but at its ends."""

FARTHEST_MM = 40.0
"""Surfaces that are farther apart tell that labels differ, not how far the structure has moved."""

LEAST_SHARE = 0.25
"""Structures of which less is left are not scored: no measure of a slice of a bone says where the bone is."""

_PERCENT = 99.5
"""Of the surfaces' distances: all but single stray voxels of a label."""

_POINTS = 20_000


def cut_at_ends(
    moving: Volume, fixed: Volume, groups: Mapping[str, Sequence[int]]
) -> tuple[Volume, dict[str, np.ndarray]]:
    """The true labels without what nobody could know, and where they end.

    Parameters
    ----------
    moving : Volume
        Labels on the grid of the CT that is registered.
    fixed : Volume
        Those of the later scan, numbered alike, in the same world.
    groups : {str: sequence of int}
        Labels of each structure.

    Returns
    -------
    Volume
        The later scan's labels. Structures that an end of the CT cuts off are background near that end, and everywhere
        where less than a quarter would be left of what the later scan shows of them in the CT's box.
    {str: (N, 4) array}
        Of these structures, the planes as :class:`PolyPoseLib.data.benchmark.case.CaseTruth` has them.

    """
    first, second = LabelMasks(moving), LabelMasks(fixed)
    ends, within = {}, {}
    for name, numbers in groups.items():
        if not first.reaches_end(numbers) or second.box(numbers) is None:
            continue
        margin = MARGIN_MM + _farthest_mm(first, second, numbers)
        ends[name] = _planes(first, numbers, margin)
        within[name] = _planes(first, numbers, 0.0)
    kept, whole = (LabelMasks(labels_before_ends(fixed, groups, planes)) for planes in (ends, within))
    scraps = [name for name in ends if _size(kept, groups[name]) < LEAST_SHARE * _size(whole, groups[name])]
    numbers = [number for name in scraps for number in groups[name]]
    labels = kept.labels.with_voxels(np.where(np.isin(kept.labels.voxels, numbers), 0, kept.labels.voxels))
    return labels, {name: planes for name, planes in ends.items() if name not in scraps}


def _planes(masks: LabelMasks, numbers: Sequence[int], margin_mm: float) -> np.ndarray:
    """The sides of a grid (N, 4) that a structure reaches, moved inwards by a margin."""
    box, labels = masks.box(numbers), masks.labels
    assert box is not None  # of what reaches an end
    middle = labels.bounds_center
    planes = []
    for axis, (side, size) in enumerate(zip(reversed(box), labels.shape[::-1], strict=True)):
        # Perpendicular to the side, whatever the angles between the grid's axes.
        normal = np.linalg.inv(labels.affine[:3, :3])[axis]
        half_mm = size / 2 / np.linalg.norm(normal)
        for sign, reached in ((-1, side.start == 0), (1, side.stop == size)):
            if reached:
                outwards = sign * normal / np.linalg.norm(normal)
                planes.append([*outwards, outwards @ middle + half_mm - margin_mm])
    return np.array(planes)


def _farthest_mm(first: LabelMasks, second: LabelMasks, numbers: Sequence[int]) -> float:
    """How far a structure's surfaces in two scans are apart where both scans show them, at most FARTHEST_MM."""
    from scipy.spatial import KDTree

    surfaces, clear = [], []
    for own, other in ((first, second), (second, first)):
        mask = own.mask(numbers, own.box(numbers))
        assert mask is not None  # of a structure of both scans
        points = surface_points(mask.voxels, mask.affine)
        surfaces.append(points)
        # A cut is no surface, and what the other scan does not reach has no counterpart there.
        points = points[_inside(own.labels, points, 0.5) & _inside(other.labels, points, -0.5)]
        clear.append(points[:: max(1, -(-len(points) // _POINTS))])
    farthest = 0.0
    for points, others in zip(clear, reversed(surfaces), strict=True):
        if len(points):
            farthest = max(farthest, float(np.percentile(KDTree(others).query(points)[0], _PERCENT)))
    return min(farthest, FARTHEST_MM)


def _inside(grid: Volume, points: np.ndarray, voxels: float) -> np.ndarray:
    """Whether points (N, 3) lie that far inside of the outermost voxels' centres: (N,) bool."""
    index = grid.to_index(points)
    return np.all((index >= voxels) & (index <= np.array(grid.shape[::-1]) - 1 - voxels), axis=1)


def _size(masks: LabelMasks, numbers: Sequence[int]) -> int:
    mask = masks.mask(numbers, masks.box(numbers))
    return 0 if mask is None else int(np.count_nonzero(mask.voxels))
