"""The warped labels as an RT Structure Set (PS3.3 A.19): many planning systems read contours, not segmentations."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.mask_contours import outlines
from PolyPoseLib.io.dicom_export.objects import Export, Series
from PolyPoseLib.io.dicom_export.references import references
from PolyPoseLib.io.dicom_export.registrations import Warped
from PolyPoseLib.io.dicom_export.segmentation import Segment
from PolyPoseLib.io.dicom_export.taken_over import REGION

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

STRUCTURE_SET = "1.2.840.10008.5.1.4.1.1.481.3"

_STUDY = "1.2.840.10008.3.1.2.3.1"
"""Detached Study Management, retired: what structure sets still have to call a study."""

_IMPLICIT = "1.2.840.10008.1.2"
"""Transfer syntax whose texts may be longer than 64 KiB, as the points of a large contour are."""

_TURN = 0.618034
"""Of the colour wheel from one structure to the next: no two among many are alike."""


def structure_set(
    export: Export, series: Series, warped: Warped, labels: Volume, segments: Sequence[Segment]
) -> Dataset:
    """Closed planar contours in the frame of reference of the patient as X-rayed.

    Parameters
    ----------
    export
        Patient, study and time.
    series
        The object's own.
    warped
        The CT series on whose slices the contours lie.
    labels
        On the grid of its slices.
    segments
        The structures; others are left out.

    Returns
    -------
    Dataset
        An RT Structure Set Storage object.

    """
    from pydicom.uid import UID

    made = export.new_object(STRUCTURE_SET, series, 1, export.posture_frame)
    for keyword in REGION:  # not of structure sets
        made.pop(keyword, None)
    made.file_meta.TransferSyntaxUID = UID(_IMPLICIT)
    made.OperatorsName = ""
    made.StructureSetLabel = "POLYPOSE"
    made.StructureSetDescription = export.note
    made.StructureSetDate, made.StructureSetTime = export.date, export.time
    made.ReferencedFrameOfReferenceSequence = [_frame(export, warped)]
    made.StructureSetROISequence = [_structure(export, n, each) for n, each in enumerate(segments, start=1)]
    boxes = find_objects(labels.voxels)
    made.ROIContourSequence = [
        _contours(number, _Region(each.label, boxes[each.label - 1]), labels, warped)
        for number, each in enumerate(segments, start=1)
    ]
    made.RTROIObservationsSequence = [_observation(n) for n in range(1, len(segments) + 1)]
    return made


def _frame(export: Export, warped: Warped) -> Dataset:
    """The frame of reference, and the series in it."""
    from pydicom.dataset import Dataset

    series, study, frame = Dataset(), Dataset(), Dataset()
    series.SeriesInstanceUID = warped.series.uid
    series.ContourImageSequence = references(warped.images)
    study.ReferencedSOPClassUID = _STUDY
    study.ReferencedSOPInstanceUID = export.taken.StudyInstanceUID
    study.RTReferencedSeriesSequence = [series]
    frame.FrameOfReferenceUID = export.posture_frame
    frame.RTReferencedStudySequence = [study]
    return frame


def _structure(export: Export, number: int, segment: Segment) -> Dataset:
    """A structure's number and name."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.ROINumber = number
    item.ReferencedFrameOfReferenceUID = export.posture_frame
    item.ROIName = segment.name
    item.ROIGenerationAlgorithm = "SEMIAUTOMATIC"
    return item


@dataclass(frozen=True)
class _Region:
    """A label, and the box (k, j, i) that holds it."""

    label: int
    box: tuple[slice, slice, slice]


def _contours(number: int, region: _Region, labels: Volume, warped: Warped) -> Dataset:
    """A structure's contours, slice by slice."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.ROIDisplayColor = [round(255 * each) for each in colorsys.hsv_to_rgb(number * _TURN % 1, 0.7, 1.0)]
    item.ReferencedROINumber = number
    corner = np.array([region.box[2].start, region.box[1].start])
    found = []
    for k, section in enumerate(labels.voxels[region.box], start=region.box[0].start):
        for outline in outlines(section == region.label):
            flat = np.column_stack([outline + corner, np.full(len(outline), k)])
            found.append(_contour(labels.to_world(flat), warped, k))
    item.ContourSequence = found
    return item


def _contour(points: np.ndarray, warped: Warped, k: int) -> Dataset:
    """One contour (N, 3), LPS mm, on slice k."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.ContourImageSequence = references([warped.images[k]])
    item.ContourGeometricType = "CLOSED_PLANAR"
    item.NumberOfContourPoints = len(points)
    text = "\\".join([f"{each:.4f}" for each in points.ravel().tolist()])
    _set_decimals(item, "ContourData", text)
    return item


def _set_decimals(item: Dataset, keyword: str, text: str) -> None:
    """Give an item decimal strings as they are written: a toolkit takes minutes to check millions of numbers."""
    from pydicom.datadict import tag_for_keyword
    from pydicom.dataelem import RawDataElement
    from pydicom.tag import Tag

    tag = Tag(tag_for_keyword(keyword) or 0)
    value = text.encode("ascii") + b" " * (len(text) % 2)
    item[tag] = RawDataElement(tag, "DS", len(value), value, 0, True, True)


def _observation(number: int) -> Dataset:
    """What a structure is to a plan: nothing is said."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.ObservationNumber = item.ReferencedROINumber = number
    item.RTROIInterpretedType = item.ROIInterpreter = ""
    return item
