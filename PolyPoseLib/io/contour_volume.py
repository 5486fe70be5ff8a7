"""Contours of structures as labels, on the CT's grid where they lie in its planes, else on one of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry import contour_planes
from PolyPoseLib.geometry.contours import filled, row_crossings
from PolyPoseLib.io.label_merge import LabelMerge
from PolyPoseLib.io.machine_memory import require_room

MAX_CROSSINGS = 1 << 24
"""Rows that the edges of one structure cross in one plane."""

MAX_WORK = 1 << 32
"""Pixels that are filled, about a minute; a hundred structures of a fine CT have a tenth."""

MAX_VOXELS = 1 << 30
"""Of a grid of the contours' own."""

_OWN_SPACING_MM = 1.0
"""Of pixels within the planes, without a CT."""


@dataclass(frozen=True)
class Roi:
    """A structure of a structure set: its name, its contours (N, 3) in LPS mm, and whether it is the whole body."""

    name: str
    contours: Sequence[np.ndarray]
    is_body: bool = False


def contours_as_labels(
    rois: Sequence[Roi], reference: Volume | None, source: str, warnings: Sequence[str] = ()
) -> Segmentation:
    """Fill contours; a voxel of several structures goes to the smallest, with a warning unless one is the body.

    A contour stands for its slab, half way to its neighbours: slices between contours of every second slice are filled.

    Parameters
    ----------
    rois
        At least one has contours.
    reference
        The CT, None for a grid of the contours' own.
    source
        Opening of the sentences.
    warnings
        More for the segmentation.

    Raises
    ------
    InputError
        Contours that are not flat and parallel, that all lie outside of the CT, or that are too many.

    """
    affine, shape, axis = _grid([each for roi in rois for each in roi.contours], reference, source)
    require_room(4.0 * np.prod(shape, dtype=float), source)
    merge = LabelMerge([roi.name for roi in rois], shape)
    merge.expected = {which for which, roi in enumerate(rois) if roi.is_body}
    # Seen with the contours' normal as first axis; the labels stay in the grid's own order.
    order = [2 - axis, *(each for each in range(3) if each != 2 - axis)]
    back = np.argsort(order)
    inverse = np.linalg.inv(affine)
    placed = [
        [(each @ inverse[:3, :3].T + inverse[:3, 3])[:, ::-1][:, order] for each in roi.contours]
        for roi in rois
    ]
    depths = [[float(each[:, 0].mean()) for each in group] for group in placed]
    filler = _Filler(tuple(shape[each] for each in order), source)
    for which, distance in enumerate(contour_planes.usual_distances(depths)):
        found = filler.block(placed[which], depths[which], distance) if placed[which] else None
        if found is not None:
            corner, mask = found
            merge.add(which, mask.transpose(back), [corner[each] for each in back])
    if not merge.labels.any():
        raise InputError(
            f"{source}: none of its contours encloses a voxel of the CT: give the structure set drawn on this CT."
        )
    return merge.segmentation(affine, source, warnings)


def _grid(
    contours: Sequence[np.ndarray], reference: Volume | None, source: str
) -> tuple[np.ndarray, tuple[int, int, int], int]:
    """Affine and shape (k, j, i) of the grid, and its axis across the contours."""
    axis = None if reference is None else contour_planes.plane_axis(contours, reference.affine)
    if reference is not None and axis is not None:
        return reference.affine, reference.shape, axis
    spacing = _OWN_SPACING_MM if reference is None else float(reference.spacing.min())
    own = contour_planes.own_affine(contours, spacing)
    if own is None:
        raise InputError(
            f"{source}: its contours do not lie in parallel planes: export the structures as a DICOM SEG or as a label "
            "map."
        )
    affine, shape = own
    if np.prod(shape, dtype=float) > MAX_VOXELS:
        raise InputError(
            f"{source}: its contours are spread over {shape[0]} x {shape[1]} x {shape[2]} voxels, which is too "
            "much: export the structures as a label map."
        )
    return affine, shape, 2


class _Filler:
    """Fills structures in a grid (depth, y, x), within a bound of work for all of them."""

    def __init__(self, shape: tuple[int, ...], source: str) -> None:
        self._shape, self._source, self._work = shape, source, 0.0

    def block(
        self, group: Sequence[np.ndarray], depths: Sequence[float], distance: float
    ) -> tuple[list[int], np.ndarray] | None:
        """Corner and mask of the box around one structure, whose contours are (N, 3) (depth, y, x); None outside."""
        points = np.concatenate([each[:, 1:] for each in group])
        last = np.array(self._shape[1:]) - 1
        low = np.clip(np.floor(points.min(axis=0)), 0, last + 1).astype(int)
        high = np.clip(np.ceil(points.max(axis=0)), -1, last).astype(int)
        planes, which = contour_planes.planes_of(depths)
        slices = contour_planes.slices_of_planes(planes, distance, self._shape[0])
        used = np.concatenate(slices)
        if not used.size or (high < low).any():
            return None
        first = int(used.min())
        size = (int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1)
        mask = np.zeros((int(used.max()) - first + 1, *size), bool)
        for plane, own in enumerate(slices):
            if own.size:
                polygons = [group[n][:, 1:] - low for n in np.flatnonzero(which == plane).tolist()]
                mask[own - first] = self._plane([each[:, ::-1] for each in polygons], size)
        return [first, int(low[0]), int(low[1])], mask

    def _plane(self, polygons: list[np.ndarray], size: tuple[int, int]) -> np.ndarray:
        """The contours of one plane; raises InputError for more than can be filled in a minute."""
        crossings = row_crossings(polygons, size[0])
        self._work += size[0] * size[1] + 8.0 * crossings
        if crossings > MAX_CROSSINGS or self._work > MAX_WORK:
            raise InputError(
                f"{self._source}: its contours are too many or too long to be filled: export fewer structures, or a "
                "label map."
            )
        return filled(polygons, size)
