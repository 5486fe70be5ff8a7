"""Ends: planes beyond which a structure is scored neither in the truth nor in what a system answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.evaluation.benchmark.label_masks import LabelMasks


def before_ends(mask: Volume, ends: np.ndarray | None) -> Volume:
    """The voxels of a mask whose centres lie on the inner side of all planes.

    Parameters
    ----------
    mask : Volume
        Of bool.
    ends : (N, 4) array, optional
        Points x in LPS mm with ``ends[:, :3] @ x <= ends[:, 3]`` stay; None keeps all.

    """
    if ends is None:
        return mask
    kept = mask.voxels.copy()
    _, height, width = mask.shape
    slopes = ends[:, :3] @ mask.affine[:3, :3]
    rooms = ends[:, 3] - ends[:, :3] @ mask.affine[:3, 3]
    for (by_i, by_j, by_k), room in zip(slopes, rooms, strict=True):
        in_slice = by_j * np.arange(height)[:, None] + by_i * np.arange(width)
        for k, each in enumerate(kept):  # by slices, so that no coordinates of a whole CT are made
            each &= in_slice <= room - by_k * k
    return mask.with_voxels(kept)


def labels_before_ends(
    labels: Volume, groups: Mapping[str, Sequence[int]], ends: Mapping[str, np.ndarray]
) -> Volume:
    """A label map in which structures are background beyond their ends.

    Parameters
    ----------
    labels : Volume
        Whole numbers.
    groups : {str: sequence of int}
        Labels of each structure.
    ends : {str: (N, 4) array}
        As :func:`before_ends` takes them, of some of the structures.

    """
    masks, voxels = LabelMasks(labels), labels.voxels.copy()
    for name, planes in ends.items():
        box = masks.box(groups[name])
        mask = masks.mask(groups[name], box)
        if box is not None and mask is not None:
            voxels[box][mask.voxels & ~before_ends(mask, planes).voxels] = 0
    return labels.with_voxels(voxels)
