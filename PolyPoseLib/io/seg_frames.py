"""Frames of a DICOM segmentation: the plane and the segment of each, on one even grid."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.shear import SHEAR_TOLERANCE_MM
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import raw_value

MAX_FRAMES = 300_000
"""More are refused: 117 segments of a scan of 1,500 slices have 175,000."""

MAX_PLANES = 10_000
"""Of the grid, with those that the file leaves out because nothing is in them."""

_OFF_PLANE = 0.1
"""Largest deviation of a frame from its plane, as a share of the planes' distance."""


@dataclass(frozen=True)
class SegFrames:
    """Where the frames are.

    Attributes
    ----------
    planes
        (F,) whole numbers, the index k of each frame.
    segments
        (F,) Referenced Segment Number, 0 in a label map, which needs none.
    affine
        (4, 4) index (i, j, k, 1) to LPS mm.
    depth
        Planes of the grid.

    """

    planes: np.ndarray
    segments: np.ndarray
    affine: np.ndarray
    depth: int


def seg_frames(whole: Any, path: Path) -> SegFrames:
    """Read the functional groups (DICOM C.7.6.16) of a segmentation.

    Raises
    ------
    InputError
        No or too many frames, frames without a place, or planes that are no even stack.

    """
    count = int(raw_value("NumberOfFrames", whole) or 0)
    groups = raw_value("PerFrameFunctionalGroupsSequence", whole) or []
    if not 1 <= count <= MAX_FRAMES or len(groups) != count:
        raise InputError(
            f"{path}: the segmentation must say for each of 1 to {MAX_FRAMES} frames where it is: export it again."
        )
    shared = (raw_value("SharedFunctionalGroupsSequence", whole) or [{}])[0]
    first = (groups[0], shared)
    axes = _axes(_numbers(first, "PlaneOrientationSequence", "ImageOrientationPatient", 6, path), path)
    spacing = _numbers(first, "PixelMeasuresSequence", "PixelSpacing", 2, path)
    if (spacing <= 0).any():
        raise InputError(f"{path}: the segmentation's PixelSpacing is zero: export it again.")
    places = np.empty((count, 3))
    segments = np.zeros(count, np.int64)
    for number, group in enumerate(groups):
        places[number] = _numbers((group, shared), "PlanePositionSequence", "ImagePositionPatient", 3, path)
        for own, tag, same in (
            ("PlaneOrientationSequence", "ImageOrientationPatient", axes.ravel()),
            ("PixelMeasuresSequence", "PixelSpacing", spacing),
        ):
            if own in group and not np.allclose(
                _numbers((group,), own, tag, len(same), path), same, atol=1e-3
            ):
                raise InputError(
                    f"{path}: its frames have different directions or spacings: export it on one grid."
                )
        which = _value((group, shared), "SegmentIdentificationSequence", "ReferencedSegmentNumber")
        segments[number] = 0 if which is None else int(which)
    normal = np.cross(axes[0], axes[1])
    along = places @ normal
    origin = places[np.argmin(along)]
    along = along - along.min()
    step = _plane_distance(along, _stated_distances(first), path)
    planes = np.rint(along / step).astype(np.int64)
    off = np.linalg.norm(places - origin - np.outer(along, normal), axis=1)
    if (off > SHEAR_TOLERANCE_MM).any():
        raise InputError(
            f"{path}: its frames lie beside each other, not in one stack: export it on the CT's grid."
        )
    affine = np.eye(4)
    affine[:3, :3] = np.stack([axes[0] * spacing[1], axes[1] * spacing[0], normal * step], axis=1)
    affine[:3, 3] = origin
    return SegFrames(planes, segments, affine, int(planes.max()) + 1)


def _value(sources: tuple[Any, ...], group: str, tag: str) -> Any:
    """An attribute of a functional group, from the first source that has it; None where none does."""
    for source in sources:
        macro = source.get(group)
        if macro and tag in macro[0]:
            return macro[0].get(tag)
    return None


def _numbers(sources: tuple[Any, ...], group: str, tag: str, length: int, path: Path) -> np.ndarray:
    """Finite numbers of a functional group, (length,); raises InputError where there are none."""
    value = _value(sources, group, tag)
    try:
        numbers = np.array([float(each) for each in value], dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (length,) or not (np.abs(numbers) < 1e6).all():
        raise InputError(
            f"{path}: a frame of the segmentation has no valid {tag}, so that its place in the patient is unknown: "
            "export it again."
        )
    return numbers


def _axes(numbers: np.ndarray, path: Path) -> np.ndarray:
    """(2, 3) unit vectors along a row and down a column."""
    axes = numbers.reshape(2, 3)
    if not np.allclose(axes @ axes.T, np.eye(2), atol=1e-2):
        raise InputError(
            f"{path}: ImageOrientationPatient is not two perpendicular unit vectors: export it again."
        )
    row = axes[0] / np.linalg.norm(axes[0])
    column = axes[1] - (axes[1] @ row) * row
    return np.stack([row, column / np.linalg.norm(column)])


def _stated_distances(sources: tuple[Any, ...]) -> list[float]:
    """Spacing Between Slices, then Slice Thickness, where they are lengths."""
    found = []
    for tag in ("SpacingBetweenSlices", "SliceThickness"):
        value = _value(sources, "PixelMeasuresSequence", tag)
        if value is not None and 1e-3 < abs(float(value)) < 1e3:
            found.append(abs(float(value)))
    return found


def _plane_distance(along: np.ndarray, stated: list[float], path: Path) -> float:
    """Distance of planes in mm that puts every frame on one; files leave empty planes out, and some state nonsense.

    Neighbouring planes decide where there are some: a stated distance that is half of theirs would leave gaps.
    """
    different = np.unique(np.round(along, 3))
    gaps = np.diff(different)
    gaps = gaps[gaps > 0.01]
    if not gaps.size:
        return stated[0] if stated else 1.0
    closest = gaps[gaps < 1.1 * gaps.min()]
    usual = float(np.median(closest))
    span = float(along.max())
    whole = span / max(
        round(span / usual), 1
    )  # positions are rounded, and their sum is known better than one
    has_neighbours = len(gaps) > 1 and 2 * len(closest) >= len(gaps)
    for step in (
        [whole, *stated] if has_neighbours else [*stated, whole] if len(gaps) == 1 else stated or [whole]
    ):
        index = along / step
        if index.max() < MAX_PLANES and (np.abs(index - np.rint(index)) <= _OFF_PLANE).all():
            return step
    raise InputError(
        f"{path}: the segmentation's planes are unevenly spaced, or more than {MAX_PLANES}: export it on the CT's grid."
    )
