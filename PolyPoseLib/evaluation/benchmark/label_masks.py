"""Masks of a label map's structures, cut to their boxes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

Box = tuple[slice, ...]


class LabelMasks:
    """The structures of a label map.

    Parameters
    ----------
    labels : Volume
        Whole numbers, 0 or more.

    Raises
    ------
    InputError
        Voxels that are no whole numbers.

    """

    def __init__(self, labels: Volume) -> None:
        if not np.issubdtype(labels.voxels.dtype, np.integer):
            raise InputError(
                f"Labels must be whole numbers, not {labels.voxels.dtype}: convert the label map."
            )
        self.labels = labels
        self._boxes: list[Box | None] = find_objects(labels.voxels)

    def box(self, numbers: Sequence[int]) -> Box | None:
        """The smallest box (k, j, i) that holds all voxels with one of the numbers, None when there are none."""
        boxes = [self._boxes[n - 1] for n in numbers if 0 < n <= len(self._boxes)]
        return joint_box(*boxes)

    def mask(self, numbers: Sequence[int], box: Box | None) -> Volume | None:
        """The voxels of a box with one of the numbers, as bool; None where there is no box."""
        if box is None:
            return None
        affine = self.labels.affine.copy()
        affine[:3, 3] += affine[:3, :3] @ [side.start for side in reversed(box)]
        return Volume(np.isin(self.labels.voxels[box], list(numbers)), affine)

    def reaches_end(self, numbers: Sequence[int]) -> bool:
        """Whether a voxel with one of the numbers lies at the grid's border, where the structure may be cut off."""
        box = self.box(numbers)
        return box is not None and any(
            side.start == 0 or side.stop == size for side, size in zip(box, self.labels.shape, strict=True)
        )


def joint_box(*boxes: Box | None) -> Box | None:
    """The smallest box that holds all boxes."""
    known = [box for box in boxes if box is not None]
    if not known:
        return None
    return tuple(
        slice(min(side.start for side in sides), max(side.stop for side in sides))
        for sides in zip(*known, strict=True)
    )
