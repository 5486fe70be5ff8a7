"""The structures of a study, from a segmentation whose labels must lie on the CT's bones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from PolyPoseLib.data.label_checks import check_labels, fits
from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.structures import Structures, build_structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

Groups = Mapping[str, Sequence[int | str]]


def checked_structures(
    segmentation: Segmentation, groups: Groups, ct: Volume, table: str | None, anchor: str
) -> tuple[Structures, tuple[str, ...]]:
    """As `build_structures`, and compared with the CT.

    Raises
    ------
    InputError
        As `build_structures`, and when most structures lie beside bone; the sentence says where they would fit.

    """
    try:
        structures, warnings = build_structures(segmentation, groups, ct, table, anchor)
        warnings = (*warnings, *check_labels(ct, structures))
        is_placed = not warnings or fits(ct, structures)
    except InputError:
        _refuse_lost_place(segmentation, groups, ct, table)
        raise
    if not is_placed:
        _refuse_lost_place(segmentation, groups, ct, table)
    return structures, warnings


def _refuse_lost_place(segmentation: Segmentation, groups: Groups, ct: Volume, table: str | None) -> None:
    """Raise InputError where labels fit the CT voxel by voxel, though their file says otherwise."""
    if _fits_by_index(segmentation, groups, ct, table):
        raise InputError(
            f"{segmentation.source}: its labels fit the CT voxel by voxel, but the file places them elsewhere: save it "
            "with the CT's origin, spacing and directions."
        ) from None


def _fits_by_index(segmentation: Segmentation, groups: Groups, ct: Volume, table: str | None) -> bool:
    """Whether the labels lie on bone once the file's own place is ignored, which differs from the CT's."""
    layers = segmentation.layers
    if any(each.shape != ct.shape for each in layers) or all(each.same_grid(ct) for each in layers):
        return False
    moved = replace(segmentation, layers=tuple(Volume(each.voxels, ct.affine) for each in layers))
    try:
        return fits(ct, build_structures(moved, groups, ct, table)[0])
    except InputError:
        return False
