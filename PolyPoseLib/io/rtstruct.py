"""RT structure sets: closed planar contours, read from the file with bounds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.contour_volume import Roi, contours_as_labels
from PolyPoseLib.io.dicom import read_dataset
from PolyPoseLib.io.dicom_seg import MAX_SEGMENTS, segment_name

MAX_BYTES = 256 << 20
"""Larger files are refused unread: the text of some ten million points."""

MAX_CONTOURS = 300_000
MAX_POINTS = 10_000_000
"""Of the file together."""

FARTHEST_MM = 1e5
"""No patient has points farther from the origin."""

_LONGEST_NUMBER = 64
"""Bytes of a number as text; DICOM allows 16."""

_CLOSED = ("CLOSED_PLANAR", "CLOSEDPLANAR_XOR")


_BODY_NAMES = ("body", "external", "skin", "outline", "patient")
"""In lower case, for files that do not say what a structure is."""


@dataclass
class ContourCount:
    """What was read so far."""

    contours: int = 0
    points: int = 0
    others: int = 0


def read_rtstruct(path: Path, reference: Volume | None) -> Segmentation:
    """Read an RT structure set as labels on the CT's grid.

    Parameters
    ----------
    path
        The file; pydicom's warnings should be silenced.
    reference
        The CT; a grid of the contours' own is made where it is None, or where they lie oblique in it.

    Raises
    ------
    InputError
        No closed contour, contours that are not flat or outside of the CT, too many, or points that are none.

    """
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise InputError(
            f"{path}: a structure set of {size >> 20} MiB is too large: export fewer structures, at most "
            f"{MAX_BYTES >> 20} MiB."
        )
    try:
        whole = read_dataset(path, force=True)
    except InputError as error:
        raise InputError(f"{path} {error}") from None
    listed = whole.get("StructureSetROISequence") or []
    drawn = whole.get("ROIContourSequence") or []
    if not 1 <= len(listed) <= MAX_SEGMENTS or len(drawn) > MAX_SEGMENTS:
        raise InputError(
            f"{path}: the structure set lists {len(listed)} structures: give one of 1 to {MAX_SEGMENTS}."
        )
    names = {
        int(each.ROINumber): segment_name(each.get("ROIName"), f"ROI {each.ROINumber}") for each in listed
    }
    contours: dict[int, list[np.ndarray]] = {number: [] for number in names}
    count = ContourCount()
    for each in drawn:
        number = int(each.ReferencedROINumber)
        if number not in contours:
            raise InputError(
                f"{path}: contours belong to a structure that it does not list: export it again."
            )
        contours[number] += closed_contours(each.get("ContourSequence") or [], count, path)
    if not any(contours.values()):
        raise InputError(
            f"{path}: the structure set holds no closed contour: draw structures as closed contours slice by slice, or "
            "give a label map."
        )
    warnings = ()
    if count.others:
        warnings = (f"{count.others} open lines of the structure set were left out: they enclose nothing.",)
    bodies = _bodies(whole, names)
    rois = [Roi(name, contours[number], number in bodies) for number, name in names.items()]
    return contours_as_labels(rois, reference, str(path), warnings)


def _bodies(whole: Any, names: dict[int, str]) -> set[int]:
    """Numbers of the structures that are the patient's outline, which all others overlap."""
    external = {
        int(each.ReferencedROINumber)
        for each in whole.get("RTROIObservationsSequence") or []
        if str(each.get("RTROIInterpretedType") or "").strip().upper() == "EXTERNAL"
        and "ReferencedROINumber" in each
    }
    return external | {number for number, name in names.items() if name.lower() in _BODY_NAMES}


def closed_contours(items: Any, count: ContourCount, path: Path) -> list[np.ndarray]:
    """Points (N, 3) LPS mm of the closed contours of one structure, each once."""
    found: dict[bytes, np.ndarray] = {}
    for each in items:
        count.contours += 1
        if count.contours > MAX_CONTOURS:
            raise InputError(f"{path}: it has more than {MAX_CONTOURS} contours: export fewer structures.")
        kind = str(each.get("ContourGeometricType") or "").strip().upper()
        if kind not in _CLOSED:
            count.others += kind != "POINT"
            continue
        points = contour_points(each, count, path)
        if len(points):
            # Twice the same contour would be a hole in itself.
            found.setdefault(points.tobytes(), points)
    return list(found.values())


def contour_points(contour: Any, count: ContourCount, path: Path) -> np.ndarray:
    """Contour Data (3006,0050) as (N, 3), 0 where it is empty."""
    # The bytes are converted at once: number by number, pydicom takes minutes.
    element = contour.get_item("ContourData")
    raw = None if element is None else element.value
    if raw is None or not len(raw):
        return np.empty((0, 3))
    amount = raw.count(b"\\") + 1 if isinstance(raw, bytes) else len(raw)
    count.points += amount // 3
    if count.points > MAX_POINTS:
        raise InputError(f"{path}: it has more than {MAX_POINTS} points: export fewer structures.")
    try:
        numbers = raw.rstrip(b" \0").split(b"\\") if isinstance(raw, bytes) else [float(n) for n in raw]
        if any(isinstance(each, bytes) and len(each) > _LONGEST_NUMBER for each in numbers):
            raise ValueError
        points = np.array(numbers).astype(np.float64)
    except (TypeError, ValueError):
        points = np.array([np.nan])
    if points.size % 3 or not (np.abs(points) <= FARTHEST_MM).all():
        raise InputError(
            f"{path}: contour {count.contours} has points that are no places in mm: export it again."
        )
    return points.reshape(-1, 3)
