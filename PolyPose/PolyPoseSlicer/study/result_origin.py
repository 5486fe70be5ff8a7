"""Remembers in a kept result folder which segments it was made from, so that labels get their names back."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import slicer

_FILE = "segments.json"


def remember_segments(folder: str | Path, segmentation: slicer.vtkMRMLSegmentationNode) -> None:
    """Write the segments' IDs into a result folder; label n + 1 of the result is number n of them."""
    with contextlib.suppress(OSError):
        text = json.dumps(list(segmentation.GetSegmentation().GetSegmentIDs()))
        (Path(folder) / _FILE).write_text(text, encoding="utf-8")


def made_from(folder: str | Path, segmentation: slicer.vtkMRMLSegmentationNode | None) -> bool:
    """Whether a result folder was made from the segments of this segmentation."""
    if segmentation is None:
        return False
    with contextlib.suppress(OSError, ValueError):
        stored = json.loads((Path(folder) / _FILE).read_text(encoding="utf-8"))
        return stored == list(segmentation.GetSegmentation().GetSegmentIDs())
    return False
