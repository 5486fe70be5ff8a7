"""Sizes of a study from the headers of its files, in milliseconds: nothing is decoded, and nothing native reads them.

Whatever cannot be told is left to the registration, which refuses damaged files with a sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PolyPoseLib.data.cohort.sizes import StudySizes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import paths as study_paths
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.dicom import looks_like_dicom, quiet_pydicom, read_dataset
from PolyPoseLib.io.nifti import NIFTI_ENDINGS, read_header

_TAGS = ["Rows", "Columns", "NumberOfFrames", "PixelSpacing", "SliceThickness", "SpacingBetweenSlices"]

_USUAL_SPACING = (1.0, 1.0, 1.0)

_MOST = 1e11
"""Voxels; a header that states more is damaged."""


def sizes_of(study: Path, allow_outside: bool) -> StudySizes | None:
    """The sizes of a study; None where they cannot be told, as of one that is wrong."""
    try:
        fields = study_schema.read(study)
        shape, spacing = _ct_size(_path(fields["ct"], study, allow_outside))
        pixels = tuple(_pixels(xray, study, allow_outside) for xray in fields["xrays"])
        if not 0 < shape[0] * shape[1] * shape[2] < _MOST or min(spacing) <= 0:
            return None
        return StudySizes(shape, spacing, len(fields["structures"]), pixels)
    except Exception:  # damaged headers raise nearly every kind; here they may not end a cohort
        return None


def _path(name: str, study: Path, allow_outside: bool) -> Path:
    return study_paths.resolve(name, "file", study.parent.resolve(), allow_outside)


def _ct_size(path: Path) -> tuple[tuple[int, int, int], tuple[float, float, float]]:
    """Voxels along (k, j, i), and spacing along (i, j, k) in mm."""
    if path.is_dir():
        return _dicom_size(path)
    if path.name.lower().endswith(NIFTI_ENDINGS):
        header = read_header(path)
        i, j, k = (int(each) for each in header.sizes[:3])
        x, y, z = (abs(float(each)) for each in header.spacing[:3])
        return (k, j, i), (x, y, z)
    # Voxels of a compressed CT take about a byte each; one that is not counts double, which is on the safe side.
    side = max(1, round(path.stat().st_size ** (1 / 3)))
    return (side, side, side), _USUAL_SPACING


def _dicom_size(folder: Path) -> tuple[tuple[int, int, int], tuple[float, float, float]]:
    """Of a folder of slices: all files count as slices of the first one's size."""
    files = sorted(each for each in folder.rglob("*") if each.is_file())
    header = next(each for each in map(_dicom_header, files[:20]) if each is not None)
    slices = max(len(files), int(header.get("NumberOfFrames", 1) or 1))
    row, column = (float(each) for each in header.get("PixelSpacing", (1.0, 1.0)))
    apart = header.get("SpacingBetweenSlices") or header.get("SliceThickness") or 1.0
    return (slices, int(header.Rows), int(header.Columns)), (column, row, abs(float(apart)))


def _dicom_header(path: Path) -> Any | None:
    """The few attributes that tell sizes; None where it is no DICOM image."""
    if not looks_like_dicom(path):
        return None
    try:
        with quiet_pydicom():
            header = read_dataset(path, stop_before_pixels=True, specific_tags=_TAGS, force=True)
        return header if "Rows" in header and "Columns" in header else None
    except InputError:
        return None


def _pixels(xray: Mapping[str, Any], study: Path, allow_outside: bool) -> int:
    """Pixels of an X-ray; of a picture that is no DICOM, a byte of its file counts as one."""
    path = _path(xray["image"], study, allow_outside)
    header = _dicom_header(path) if path.is_file() else None
    if header is not None:
        return int(header.Rows) * int(header.Columns)
    return path.stat().st_size
