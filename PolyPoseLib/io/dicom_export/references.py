"""References from one object to others (PS3.3 10.3, C.12.2)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from PolyPoseLib.io.dicom_export.source import SourceImage

if TYPE_CHECKING:
    from pydicom.dataset import Dataset


def references(images: Iterable[SourceImage]) -> list[Dataset]:
    """Items that name images, the frames of one file together."""
    from pydicom.dataset import Dataset

    frames: dict[tuple[str, str], list[int]] = {}
    for image in images:
        known = frames.setdefault((image.sop_class, image.sop_instance), [])
        known += [] if image.frame is None else [image.frame]
    items = []
    for (sop_class, sop_instance), numbers in frames.items():
        item = Dataset()
        item.ReferencedSOPClassUID, item.ReferencedSOPInstanceUID = sop_class, sop_instance
        if numbers:
            item.ReferencedFrameNumber = numbers
        items.append(item)
    return items


def referenced_series(uid: str, images: Sequence[SourceImage]) -> Dataset:
    """An item of the Common Instance Reference module that names the files of a series."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.SeriesInstanceUID = uid
    item.ReferencedInstanceSequence = references(replace(each, frame=None) for each in images)
    return item


def images_of(headers: Iterable[Dataset]) -> list[SourceImage]:
    """The images that were written, as objects refer to them."""
    return [
        SourceImage(str(each.SOPClassUID), str(each.SOPInstanceUID), float(each.SliceLocation))
        for each in headers
    ]
