"""Whether two DICOM files share their coordinates, by Frame of Reference UID (0020,0052)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from PolyPoseLib.io.dicom import looks_like_dicom, quiet_pydicom, raw_value, read_dataset
from PolyPoseLib.io.dicom_segments import find_dicom_segmentation

_MAX_FILES = 5000
"""Of a folder that are looked at; the first of the CT usually answers."""

_TAGS = ["FrameOfReferenceUID", "ReferencedFrameOfReferenceSequence", "StructureSetROISequence"]


def other_frame_warnings(segmentation: Path, ct: Path) -> tuple[str, ...]:
    """A warning where a DICOM segmentation was made in another frame of reference than every slice of a DICOM CT.

    Parameters
    ----------
    segmentation, ct
        Files or folders; nothing is said where one of them has no such frame.

    """
    found = find_dicom_segmentation(segmentation)
    own = _frames(found[0]) if found else set()
    if found is None or not own:
        return ()
    others: set[str] = set()
    for file in _files(ct):
        if file != found[0]:
            others |= _frames(file)
            if not own.isdisjoint(others):
                return ()
    if not others:
        return ()
    return (
        "The segmentation says that it was drawn on another scan than this CT (their frames of reference differ): "
        "check that the bones' outlines lie on the CT.",
    )


def _files(path: Path) -> Iterator[Path]:
    """The files of a CT."""
    if not path.is_dir():
        yield path
        return
    with os.scandir(path) as entries:
        names = sorted(each.name for each in islice(entries, _MAX_FILES))
    yield from (path / name for name in names)


def _frames(file: Path) -> set[str]:
    """Frames of reference that a file names; none where it is no DICOM."""
    try:
        if not file.is_file() or not looks_like_dicom(file):
            return set()
        header = read_dataset(file, stop_before_pixels=True, specific_tags=_TAGS, force=True)
        with quiet_pydicom():
            places: list[Any] = [header, *(raw_value(_TAGS[1], header) or [])]
            named = [raw_value("FrameOfReferenceUID", each) for each in places]
            drawn = raw_value(_TAGS[2], header) or []
            named += [raw_value("ReferencedFrameOfReferenceUID", each) for each in drawn]
    except Exception:  # whoever reads the file says what is wrong with it
        return set()
    return {str(each).strip() for each in named if each is not None}
