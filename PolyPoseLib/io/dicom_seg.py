"""DICOM segmentations: binary, fractional and label map, one multi-frame file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.errors import InputError, one_line
from PolyPoseLib.geometry.grid import bounding_box
from PolyPoseLib.io.dicom import raw_value, refuse_swollen
from PolyPoseLib.io.label_merge import LabelMerge
from PolyPoseLib.io.machine_memory import require_room
from PolyPoseLib.io.seg_frames import SegFrames, seg_frames
from PolyPoseLib.io.slice_pixels import decompressed, whole_file

MAX_SEGMENTS = 1000
"""More are refused: no study has as many structures."""

MAX_VOXELS = 1 << 30
"""Of the grid: 1024 x 1024 x 1024."""

_LONGEST_NAME = 200
"""Characters; DICOM allows 64."""

Frame = Callable[[int], np.ndarray]


@dataclass(frozen=True)
class _Pixels:
    """What the header says about the pixels: the file's dataset, and rows, columns and bits of one."""

    whole: Any
    path: Path
    rows: int
    columns: int
    bits: int


def segment_name(name: Any, fallback: str) -> str:
    """The name of a segment as it may be shown, and be listed in a study; the fallback where it is empty."""
    return one_line(" ".join(str(name or "").split())[:_LONGEST_NAME]) or fallback


def read_seg(path: Path) -> Segmentation:
    """Read a DICOM SEG; a fraction of one half and more is inside.

    A voxel of several segments goes to the smallest of them, with a warning, as in a folder of masks.

    Parameters
    ----------
    path
        The file; pydicom's warnings should be silenced.

    Raises
    ------
    InputError
        Surfaces, frames without a place, sizes that are none, or damaged pixels.

    """
    whole = whole_file(path)
    kind = str(raw_value("SegmentationType", whole) or "").strip().upper()
    bits = raw_value("BitsAllocated", whole)
    if (kind, bits) not in (
        ("BINARY", 1),
        ("BINARY", 8),
        ("FRACTIONAL", 8),
        ("LABELMAP", 8),
        ("LABELMAP", 16),
    ):
        raise InputError(
            f"{path}: a DICOM segmentation must be BINARY, FRACTIONAL or LABELMAP with 1, 8 or 16 bits a pixel: export "
            "it again as one of these, or as a label map."
        )
    rows, columns = raw_value("Rows", whole), raw_value("Columns", whole)
    numbers, names = _segments(whole, path)
    frames = seg_frames(whole, path)
    if not (isinstance(rows, int) and isinstance(columns, int) and rows > 0 and columns > 0):
        raise InputError(f"{path}: the segmentation does not say how large its frames are: export it again.")
    if rows * columns * frames.depth > MAX_VOXELS:
        raise InputError(
            f"{path}: the segmentation claims {frames.depth} planes of {rows} x {columns} voxels, which is too "
            "much: crop it, or export it again if it is smaller."
        )
    require_room(3.0 * rows * columns * frames.depth, str(path))
    pixels = _Pixels(whole, path, rows, columns, int(bits))
    read = _frame_reader(pixels, len(frames.planes))
    merge = LabelMerge(names, (frames.depth, rows, columns))
    if kind == "LABELMAP":
        padding = raw_value("PixelPaddingValue", whole)
        warnings = _fill_label_map(
            merge, frames, read, {0, *([padding] if isinstance(padding, int) else [])}, numbers
        )
    else:
        largest = float(raw_value("MaximumFractionalValue", whole) or 255) if kind == "FRACTIONAL" else 1.0
        _fill_masks(merge, frames, read, (numbers, largest / 2, path))
        warnings = ()
    return merge.segmentation(frames.affine, str(path), warnings)


def _segments(whole: Any, path: Path) -> tuple[list[int], list[str]]:
    """Numbers and names of the segments."""
    items = raw_value("SegmentSequence", whole) or []
    if not 1 <= len(items) <= MAX_SEGMENTS:
        raise InputError(
            f"{path}: it lists {len(items)} segments: give a segmentation of 1 to {MAX_SEGMENTS} segments."
        )
    numbers = [int(each.get("SegmentNumber") or 0) for each in items]
    if len(set(numbers)) != len(numbers) or min(numbers) < 0 or max(numbers) > 65535:
        raise InputError(f"{path}: the segments' numbers are no different whole numbers: export it again.")
    kept = [
        (number, segment_name(each.get("SegmentLabel"), f"Segment {number}"))
        for number, each in zip(numbers, items, strict=True)
        if number
    ]
    if not kept:
        raise InputError(f"{path}: it lists no segment but the background: export the segmentation again.")
    return [n for n, _ in kept], [name for _, name in kept]


def _frame_reader(pixels: _Pixels, count: int) -> Frame:
    """A function from a frame's number to its stored values, (rows, columns)."""
    whole, path = pixels.whole, pixels.path
    size = pixels.rows, pixels.columns
    if whole.file_meta.TransferSyntaxUID.is_encapsulated:
        require_room(2.0 * count * size[0] * size[1] * max(pixels.bits // 8, 1), str(path))
        refuse_swollen(whole, str(path))
        stored = decompressed(whole, path).reshape(-1, *size)
        if len(stored) != count:
            raise _short(path)
        return lambda number: stored[number]
    content, area = whole.PixelData, size[0] * size[1]
    if not whole.file_meta.TransferSyntaxUID.is_little_endian:
        raise InputError(f"{path}: segmentations in big-endian order are not read: export it again.")
    if len(content) * 8 < count * area * pixels.bits:
        raise _short(path)
    if pixels.bits == 1:
        packed = np.frombuffer(content, np.uint8)

        def unpacked(number: int) -> np.ndarray:
            first, skipped = divmod(number * area, 8)
            part = packed[first : first + (skipped + area + 7) // 8]
            return np.unpackbits(part, bitorder="little")[skipped : skipped + area].reshape(size)

        return unpacked
    plain = np.frombuffer(content, f"<u{pixels.bits // 8}", count * area).reshape(count, *size)
    return lambda number: plain[number]


def _short(path: Path) -> InputError:
    """The error about pixels that are not all there."""
    return InputError(
        f"{path}: the segmentation is cut short: its header promises more pixels; copy it again."
    )


def _fill_masks(
    merge: LabelMerge, frames: SegFrames, read: Frame, content: tuple[list[int], float, Path]
) -> None:
    """Add the frames of each segment; content: the segments' numbers, the smallest value inside, and the file."""
    numbers, inside, path = content
    if not np.isin(frames.segments, numbers).all():
        raise InputError(
            f"{path}: a frame belongs to a segment that the file does not list: export it again."
        )
    shape = merge.labels.shape
    for which, number in enumerate(numbers):
        own = np.flatnonzero(frames.segments == number)
        if not own.size:
            continue
        low, high = int(frames.planes[own].min()), int(frames.planes[own].max())
        mask = np.zeros((high - low + 1, *shape[1:]), bool)
        for frame in own:
            mask[frames.planes[frame] - low] |= read(int(frame)) >= inside
        box = bounding_box(mask)
        if box is not None:
            merge.add(which, mask[box], (low + box[0].start, box[1].start, box[2].start))


def _fill_label_map(
    merge: LabelMerge, frames: SegFrames, read: Frame, background: set[int], numbers: list[int]
) -> tuple[str, ...]:
    """Take over the frames' numbers; a warning about voxels whose number the file does not name."""
    lookup = np.zeros(1 << 16, np.int16)
    lookup[numbers] = merge.numbers
    known = np.zeros(1 << 16, bool)
    known[[*numbers, *(each for each in background if 0 <= each < 1 << 16)]] = True
    lost = 0
    for frame, plane in enumerate(frames.planes):
        values = read(frame)
        found = lookup[values]
        np.copyto(merge.labels[plane], found, where=found > 0)
        lost += int(values.size - np.count_nonzero(known[values]))
    if not lost:
        return ()
    return (
        f"{lost} voxels of the segmentation hold numbers that its file does not name; they were left out.",
    )
