"""RT structure sets: closed contours carried as solids and drawn anew in the CT's planes, all others point by point.

A contour that moves leaves its plane, and planning systems take planar contours alone. Each structure is therefore
filled on the CT's grid, carried as an image of shares between 0 and 1, and contoured at one half.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.carrying.images import resampling_field
from PolyPoseLib.data.carried import Frame
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box
from PolyPoseLib.geometry.outlines import traced
from PolyPoseLib.io.carried.dicom_rt import WHERE, make_derived
from PolyPoseLib.io.contour_volume import Roi, contours_as_labels
from PolyPoseLib.io.rtstruct import ContourCount, closed_contours, contour_points
from PolyPoseLib.warp.dense import warp_volume
from PolyPoseLib.warp.inverse import invert_at

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

LEAST_CORNERS = 3
"""Of a contour; DICOM's closed ones have no fewer."""


def carry_structures(result: Result, source: Path, dataset: Dataset, to: Frame) -> str:
    """Replace the dataset's contours by carried ones; raises InputError for a damaged set or one of another CT."""
    field, grid = resampling_field(result, to), result.warped_ct
    carrier, count = result.point_carrier(), ContourCount()
    names = {
        int(each.ROINumber): str(each.get("ROIName") or "")
        for each in dataset.get("StructureSetROISequence") or []
    }
    solids = others = lost = 0
    for roi in dataset.get("ROIContourSequence") or []:
        items = list(roi.get("ContourSequence") or [])
        drawn = closed_contours(items, count, source)
        kept: list[Any] = []
        if drawn:
            name = names.get(int(roi.ReferencedROINumber), "")
            new = list(_carried_contours(drawn, name, grid, field, source))
            solids, lost = solids + bool(new), lost + (not new)
            kept += [_contour("CLOSED_PLANAR", each) for each in new]
        for each in items:
            kind = str(each.get("ContourGeometricType") or "").strip().upper()
            if kind.startswith("CLOSED"):
                continue
            points = contour_points(each, count, source)
            if len(points):
                moved = carrier(points, to).points
                kept.append(_contour("POINT" if len(moved) == 1 else "OPEN_NONPLANAR", moved))
                others += 1
        roi.ContourSequence = kept
    if not solids and not others:
        raise InputError(f"{source}: the structure set holds no contour that could be carried: give another.")
    _drop_references(dataset)
    make_derived(dataset, f"Structures {WHERE[to]} (PolyPose)")
    dataset.StructureSetDescription = (
        f"Carried {WHERE[to]} by PolyPose; closed contours drawn anew in the CT's planes"
    )
    said = f"{solids} structures by the displacement field, {others} points and lines"
    return said + (f"; {lost} structures left the CT's grid" if lost else "")


def _carried_contours(
    drawn: list[np.ndarray], name: str, grid: Volume, field: DisplacementField, source: Path
) -> Iterator[np.ndarray]:
    """Closed contours (N, 3) LPS mm of one structure in its new place, in planes of the CT."""
    filled = contours_as_labels([Roi(name, drawn)], grid, str(source))
    solid = filled.on_grid(0, grid).voxels > 0
    if not solid.any():
        return
    reference = _around(solid, grid, field)
    carried = warp_volume(grid.with_voxels(solid.astype(np.float32)), field, reference, outside=0.0)
    for k, plane in enumerate(carried.voxels):
        if plane.max() <= 0.5:
            continue
        for corners in traced(plane, 0.5):
            if len(corners) >= LEAST_CORNERS:
                yield carried.to_world(np.column_stack([corners, np.full(len(corners), k)]))


def _around(solid: np.ndarray, grid: Volume, field: DisplacementField) -> Volume:
    """The part of the grid that a solid may come to lie in: its box, moved and with a margin."""
    box = bounding_box(solid)
    assert box is not None, "the solid is not empty"
    index = np.argwhere(solid)[:, ::-1]
    points = grid.to_world(index[:: max(1, len(index) // 5000)])
    shift, _ = invert_at(field, points)
    moved = grid.to_index(points + shift)
    margin = np.ceil(10.0 / grid.spacing).astype(int)
    size = np.array(grid.shape[::-1])
    low = np.clip(np.floor(moved.min(axis=0)).astype(int) - margin, 0, size - 1)
    high = np.clip(np.ceil(moved.max(axis=0)).astype(int) + margin + 1, low + 1, size)
    affine = grid.affine.copy()
    affine[:3, 3] = grid.to_world(low)
    return Volume(np.zeros((high - low)[::-1], np.uint8), affine)


def _contour(kind: str, points: np.ndarray) -> Dataset:
    """One item of a Contour Sequence; numbers have at most 16 characters."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.ContourGeometricType = kind
    item.NumberOfContourPoints = len(points)
    item.ContourData = [f"{each:.4f}" for each in points.ravel()]
    return item


def _drop_references(dataset: Dataset) -> None:
    """Take out what names the slices on which the contours were drawn, where they no longer lie."""
    for frame in dataset.get("ReferencedFrameOfReferenceSequence") or []:
        if "RTReferencedStudySequence" in frame:
            del frame.RTReferencedStudySequence
    for name in ("PredecessorStructureSetSequence",):
        if name in dataset:
            delattr(dataset, name)
