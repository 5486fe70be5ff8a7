"""Named masks, which may overlap, as one label map: numbers for the names, and each voxel to the smallest mask."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.data.label_names import TABLES, label_table
from PolyPoseLib.data.segmentation import Segment, Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import cut, one_line

_SHOWN_PAIRS = 4
_PREFERRED_TABLES = sorted(TABLES, key=lambda table: table != "totalsegmentator_v2")


def label_numbers(names: Sequence[str]) -> list[int]:
    """A label for every name: TotalSegmentator's where all names are its and differ, else 1 and up."""
    for table in _PREFERRED_TABLES:
        known = {name: number for number, name in label_table(table).items()}
        if len(set(names)) == len(names) and all(name in known for name in names):
            return [known[name] for name in names]
    return list(range(1, len(names) + 1))


class LabelMerge:
    """One label map that masks are added to, one after another.

    Parameters
    ----------
    names
        Of all masks, in order.
    shape
        Of the label map, (k, j, i).

    Attributes
    ----------
    expected
        Places among the names of masks that all others lie in, such as the whole body: no warning is due.

    """

    def __init__(self, names: Sequence[str], shape: tuple[int, ...]) -> None:
        self.names = list(names)
        self.numbers = label_numbers(names)
        self.labels = np.zeros(shape, np.int16)
        self.expected: set[int] = set()
        self._counts = np.zeros(max(self.numbers, default=0) + 1, np.int64)
        self._shared: dict[tuple[int, int], int] = {}

    def add(self, which: int, mask: np.ndarray, corner: Sequence[int] = (0, 0, 0)) -> None:
        """Add one mask in whole; what two masks claim goes to the smaller one, then to the one before.

        Parameters
        ----------
        which
            Its place among the names.
        mask
            bool, (k, j, i), 0 wherever it does not reach.
        corner
            Index (k, j, i) of its first voxel in the label map.

        """
        number = self.numbers[which]
        place = tuple(slice(at, at + size) for at, size in zip(corner, mask.shape, strict=True))
        labels = self.labels[place]
        self._counts[number] = np.count_nonzero(mask)
        before = np.where(mask, labels, 0)
        there = np.flatnonzero(before)
        if there.size:
            owners = before.ravel()[there]
            for owner, voxels in zip(*np.unique(owners, return_counts=True), strict=True):
                pair = int(owner), number
                self._shared[pair] = self._shared.get(pair, 0) + int(voxels)
            mask = mask.copy()
            mask.ravel()[there[self._counts[owners] <= self._counts[number]]] = False
        labels[mask] = number

    def segmentation(self, affine: np.ndarray, source: str, warnings: Sequence[str] = ()) -> Segmentation:
        """The segmentation of one layer, whose labels are known by name; overlaps are among its warnings."""
        segments = [Segment(name, name, 0, n) for name, n in zip(self.names, self.numbers, strict=True)]
        return Segmentation(
            (Volume(self.labels, affine),),
            tuple(segments),
            source,
            numbered=False,
            warnings=(*warnings, *self._overlaps()),
        )

    def _overlaps(self) -> tuple[str, ...]:
        """A warning about masks that overlap, the largest overlaps first."""
        around = {self.numbers[which] for which in self.expected}
        shared = {pair: voxels for pair, voxels in self._shared.items() if around.isdisjoint(pair)}
        if not shared:
            return ()
        known = dict(zip(self.numbers, self.names, strict=True))
        names = {number: one_line(cut(name, 60)) for number, name in known.items()}
        pairs = sorted(shared, key=lambda pair: (-shared[pair], pair))
        shown = "; ".join(
            f"{names[first]} and {names[second]} in {shared[first, second]} voxels"
            for first, second in pairs[:_SHOWN_PAIRS]
        )
        more = "; ..." if len(pairs) > _SHOWN_PAIRS else ""
        return (
            f"Masks of the segmentation overlap ({shown}{more}); each voxel was given to the smaller one.",
        )
