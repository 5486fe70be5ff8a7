"""The grid of a posed CT: the CT's own, widened by room for what moves out of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.motion import apply

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures

Three = tuple[int, int, int]
"""Numbers along (k, j, i)."""

MOST_VOXELS = 1 << 27
"""Of a widened grid; it takes about 20 bytes a voxel while a case is made."""

_MARGIN = 2
"""Voxels between a moved bone and the end of the grid."""


@dataclass(frozen=True)
class FixedGrid:
    """The CT's grid widened by whole voxels, and the coarser nodes of the soft field on it.

    Attributes
    ----------
    affine : (4, 4) array
        Index (i, j, k) to LPS mm of the widened grid.
    shape, core_shape, pad, factor : tuple[int, int, int]
        Along (k, j, i): voxels, voxels of the CT, voxels before the CT's first, and voxels between nodes. Node n
        sits on voxel n * factor.

    """

    affine: np.ndarray
    shape: Three
    core_shape: Three
    pad: Three
    factor: Three

    @classmethod
    def around(cls, ct: Volume, pad_mm: float, node_mm: float, room: np.ndarray | None = None) -> FixedGrid:
        """Widen the CT's grid.

        Parameters
        ----------
        ct : Volume
            Its grid is the core.
        pad_mm : float
            Least room on every side.
        node_mm : float
            Nodes are about so far apart.
        room : (2, 3) array of int, optional
            Voxels that moved bones need before and after the CT along (k, j, i), see `room_for`. As much of it is
            given as MOST_VOXELS allows.

        """
        spacing = ct.spacing[::-1]
        least = np.ceil(pad_mm / spacing).astype(int)
        wanted = np.maximum(np.zeros((2, 3), int) if room is None else room, least)
        share = 1.0
        pads = wanted
        while share > 0 and np.prod(np.array(ct.shape, float) + pads.sum(0)) > MOST_VOXELS:
            share -= 0.05
            pads = least + np.floor(max(share, 0) * (wanted - least)).astype(int)
        factor = _three(max(1, round(node_mm / s)) for s in spacing)
        affine = ct.affine.copy()
        affine[:3, 3] = ct.to_world(-pads[0][::-1].astype(np.float64))
        shape = _three(n + p for n, p in zip(ct.shape, pads.sum(0).tolist(), strict=True))
        return cls(affine, shape, _three(ct.shape), _three(pads[0].tolist()), factor)

    @property
    def node_shape(self) -> Three:
        """Nodes along (k, j, i); the last may lie past the last voxel."""
        return _three(-(-(n - 1) // f) + 1 for n, f in zip(self.shape, self.factor, strict=True))

    @property
    def node_affine(self) -> np.ndarray:
        """(4, 4) node index (i, j, k) to LPS mm."""
        affine = self.affine.copy()
        affine[:3, :3] = affine[:3, :3] * np.array(self.factor[::-1])
        return affine

    def core(self, array: np.ndarray) -> np.ndarray:
        """The part of an array (k, j, i) on this grid that is the CT's own grid."""
        return array[self.core_box]

    @property
    def core_box(self) -> tuple[slice, ...]:
        """The CT's own grid in this one."""
        return tuple(slice(p, p + n) for p, n in zip(self.pad, self.core_shape, strict=True))

    def box_with(self, mask: np.ndarray) -> tuple[slice, ...]:
        """The smallest box of this grid that holds the CT's own grid and every true voxel of a mask (k, j, i)."""
        boxes = find_objects(mask.astype(np.int8))
        found = boxes[0] if boxes and boxes[0] is not None else self.core_box
        return tuple(
            slice(min(a.start, b.start), max(a.stop, b.stop))
            for a, b in zip(self.core_box, found, strict=True)
        )

    def affine_of(self, box: tuple[slice, ...]) -> np.ndarray:
        """(4, 4) index (i, j, k) to LPS mm of a box of this grid."""
        affine = self.affine.copy()
        start = np.array([part.start for part in box], dtype=np.float64)
        affine[:3, 3] = apply(self.affine, start[::-1])
        return affine


def room_for(structures: Structures, affine: np.ndarray, poses: list[np.ndarray]) -> np.ndarray:
    """Voxels (2, 3) that moved bones need before and after the CT's grid along (k, j, i).

    Parameters
    ----------
    structures : Structures
        Labels on the CT's grid.
    affine : (4, 4) array
        Index (i, j, k) to LPS mm of that grid.
    poses : list of (4, 4) array
        Fixed to moving, LPS mm, one per structure.

    """
    room = np.zeros((2, 3), int)
    last = np.array(structures.labels.shape) - 1
    boxes = find_objects(structures.labels, max_label=len(poses))
    for number, (box, pose) in enumerate(zip(boxes, poses, strict=True), start=1):
        if box is None or np.allclose(pose, np.eye(4)):
            continue
        kji = np.argwhere(structures.labels[box] == number) + [part.start for part in box]
        moved = apply(np.linalg.inv(affine) @ np.linalg.inv(pose) @ affine, kji[:, ::-1].astype(float))
        low = np.floor(moved.min(0))[::-1] - _MARGIN
        high = np.ceil(moved.max(0))[::-1] + _MARGIN - last
        room = np.maximum(room, np.stack([-low, high]).astype(int))
    return room


def widened(volume: Volume, onto: Volume) -> Volume:
    """Labels on a grid that is this one's, widened by whole voxels; 0 where there were none."""
    start = np.rint(onto.to_index(volume.affine[:3, 3])).astype(int)[::-1]
    voxels = np.zeros(onto.shape, volume.voxels.dtype)
    voxels[tuple(slice(a, a + n) for a, n in zip(start, volume.shape, strict=True))] = volume.voxels
    return Volume(voxels, onto.affine)


def _three(values: Iterable[int]) -> Three:
    """Numbers along (k, j, i)."""
    k, j, i = values
    return k, j, i
