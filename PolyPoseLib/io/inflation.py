"""The bound on what compressed files may grow to: the one place that knows it, for every format.

Compressed bytes are read with a limit, or compared with the most that they can stand for, before anything is allocated.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

MAX_INFLATED_BYTES = 1 << 30
"""Most that one compressed DICOM file may grow to."""

MAX_SKIPPED_BYTES = 1 << 28
"""Most that a header may place before the voxels of a compressed image: all of it is decompressed."""

DEFLATE_RATIO = 1032
"""Most bytes that one byte of deflate, zlib or gzip can stand for."""

_SPARE_BYTES = 1 << 16
"""What the headers of one compressed frame may take."""


class BoundedFile(io.BufferedReader):
    """A DICOM file for pydicom, which inflates all that follows the file meta information at once.

    It takes these bytes by a `read` without a size, and only these.
    """

    def read(self, size: int | None = -1, /) -> bytes:
        """The bytes; raises InputError when the rest of the file would inflate beyond the limit."""
        content = super().read(size)
        if (size is None or size < 0) and inflates_beyond(content, MAX_INFLATED_BYTES):
            raise InputError(too_large())
        return content


def too_large() -> str:
    """What is wrong with a file that grows without bounds, to follow its name."""
    return f"is compressed and grows beyond {MAX_INFLATED_BYTES >> 20} MiB, more than an image has: export it again."


def inflates_beyond(content: bytes, limit: int) -> bool:
    """Whether raw deflated bytes hold more than a limit; no more than it is ever inflated, and little is kept."""
    if len(content) * DEFLATE_RATIO <= limit:
        return False
    inflate, total, pending = zlib.decompressobj(-zlib.MAX_WBITS), 0, content
    try:
        while pending and not inflate.eof and total <= limit:
            total += len(inflate.decompress(pending, 1 << 22))
            pending = inflate.unconsumed_tail
    except zlib.error:
        return False
    return total > limit


def archive_holds_more(path: Path, limit: int) -> bool:
    """Whether a zip archive says that its members are larger than a limit together; other files are False."""
    try:
        with zipfile.ZipFile(path) as archive:
            return sum(member.file_size for member in archive.infolist()) > limit
    except (zipfile.BadZipFile, NotImplementedError, ValueError, OverflowError):
        return False


def frame_fault(dataset: Dataset) -> str | None:
    """Why the compressed frames of a DICOM file must not be decompressed; None where they may.

    Decoders allocate what the frame's own header says, and expand what they are given; the file's header says how large
    the image is.
    """
    from pydicom.encaps import generate_frames

    if not dataset.file_meta.TransferSyntaxUID.is_encapsulated or "PixelData" not in dataset:
        return None
    rows, columns = int(dataset.Rows), int(dataset.Columns)
    samples = int(dataset.get("SamplesPerPixel") or 1)
    whole = rows * columns * samples * max(int(dataset.BitsAllocated) // 8, 1)
    frames = max(int(dataset.get("NumberOfFrames") or 1), 1)
    for frame in generate_frames(dataset.PixelData, number_of_frames=frames):
        if len(frame) > 2 * whole + _SPARE_BYTES:
            return f"holds {len(frame)} compressed bytes for an image of {whole}"
        size = codestream_size(frame)
        if size is not None and size != (rows, columns):
            return f"holds a compressed image of {size[0]} x {size[1]} pixels and claims {rows} x {columns}"
    return None


def codestream_size(frame: bytes) -> tuple[int, int] | None:
    """(rows, columns) that a JPEG, JPEG-LS or JPEG 2000 stream states; None for others, or where it does not."""
    if frame[:4] == b"\xff\x4f\xff\x51" and len(frame) >= 24:
        right, down, left, top = (int.from_bytes(frame[at : at + 4], "big") for at in (8, 12, 16, 20))
        return (down - top, right - left)
    if frame[:2] != b"\xff\xd8":
        return None
    place = 2
    while place + 9 <= len(frame) and frame[place] == 0xFF:
        marker = frame[place + 1]
        if marker == 0xFF:  # a fill byte
            place += 1
        elif (0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC)) or marker == 0xF7:
            rows, columns = (int.from_bytes(frame[at : at + 2], "big") for at in (place + 5, place + 7))
            return (rows, columns) if rows else None
        elif marker == 0xDA:
            return None
        else:
            place += 2 + int.from_bytes(frame[place + 2 : place + 4], "big")
    return None
