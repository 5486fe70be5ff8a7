"""How a picture is to be turned for display: the orientation that TIFF, and EXIF in JPEG and PNG, may state."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

MAX_PAGES = 65_536
"""Directories of a TIFF file that are looked at."""

MAX_SEGMENTS = 1000
"""Segments of a JPEG or chunks of a PNG file that are looked at: EXIF stands near the beginning."""

MAX_FIELDS = 4096
"""Fields of a directory that are looked at."""

_ORIENTATION, _SHORT = 274, 3


@dataclass(frozen=True)
class Stated:
    """An orientation, 1 to 8, with the place in the file where its two bytes stand, in this byte order."""

    value: int
    offset: int
    order: str


def orientations(path: Path) -> list[Stated | None]:
    """What a picture says of each of its pages; damaged and other files say nothing.

    Parameters
    ----------
    path
        A TIFF, JPEG or PNG file, by its content.

    Returns
    -------
    list
        One member a page of a TIFF file, one for other pictures; None where there is no orientation from 1 to 8.

    """
    pages: list[Stated | None] = []
    try:
        with path.open("rb") as stream:
            start = _tiff_start(stream)
            if start is not None:
                pages.extend(_directories(stream, start, MAX_PAGES if start == 0 else 1))
    except (OSError, struct.error, OverflowError):
        pass
    return pages or [None]


def orientation_of(path: Path, frame: int | None = None) -> int:
    """Orientation, 1 to 8, of a picture's page (the first by default); 1, as stored, where the file does not say."""
    pages = orientations(path)
    stated = pages[frame] if frame is not None and 0 <= frame < len(pages) else pages[0]
    return stated.value if stated else 1


def turned(pixels: np.ndarray, orientation: int) -> np.ndarray:
    """Pixels (H, W), or (W, H) from orientation 5 on, as they are to be displayed; TIFF 6.0 and EXIF, tag 274."""
    if orientation >= 5:
        pixels = pixels.T
    return {1: pixels, 2: pixels[:, ::-1], 3: pixels[::-1, ::-1], 4: pixels[::-1]}[
        {5: 1, 6: 2, 7: 3, 8: 4}.get(orientation, orientation)
    ]


def _tiff_start(stream: BinaryIO) -> int | None:
    """Where the TIFF structure begins: the file itself, or its EXIF block; None where there is none."""
    head = stream.read(8)
    if head[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return 0
    if head[:2] == b"\xff\xd8":
        return _in_jpeg(stream)
    return _in_png(stream) if head == b"\x89PNG\r\n\x1a\n" else None


def _in_jpeg(stream: BinaryIO) -> int | None:
    """Place of the EXIF block's TIFF structure in a JPEG file."""
    stream.seek(2)
    for _ in range(MAX_SEGMENTS):
        marker, size = struct.unpack(">HH", stream.read(4))
        if marker < 0xFF00 or marker == 0xFFDA or size < 2:
            return None
        place = stream.tell()
        if marker == 0xFFE1 and stream.read(6) == b"Exif\0\0":
            return place + 6
        stream.seek(place + size - 2)
    return None


def _in_png(stream: BinaryIO) -> int | None:
    """Place of the eXIf chunk's TIFF structure in a PNG file."""
    for _ in range(MAX_SEGMENTS):
        size, kind = struct.unpack(">I4s", stream.read(8))
        if kind == b"eXIf":
            return stream.tell()
        if kind == b"IEND":
            return None
        stream.seek(size + 4, 1)
    return None


def _directories(stream: BinaryIO, start: int, most: int) -> Iterator[Stated | None]:
    """What each image file directory states, one after the other; a directory is looked at once."""
    stream.seek(start)
    head = stream.read(8)
    order = "<" if head[:2] == b"II" else ">"
    (version,) = struct.unpack(order + "H", head[2:4])
    if version not in (42, 43):
        return
    big = version == 43
    number, counter, size = ("Q", "Q", 20) if big else ("I", "H", 12)
    (place,) = struct.unpack(order + number, stream.read(8) if big else head[4:8])
    seen: set[int] = set()
    while place and place not in seen and len(seen) < most:
        seen.add(place)
        stream.seek(start + place)
        (count,) = struct.unpack(order + counter, stream.read(struct.calcsize(counter)))
        first = stream.tell()
        yield _stated(stream.read(size * min(count, MAX_FIELDS)), size, first, order)
        stream.seek(first + size * count)
        (place,) = struct.unpack(order + number, stream.read(struct.calcsize(number)))


def _stated(fields: bytes, size: int, first: int, order: str) -> Stated | None:
    """The orientation in the fields of one directory, each of so many bytes, the first at this place of the file."""
    value = size - 4 if size == 12 else size - 8  # where a field keeps a value that is short enough
    for at in range(0, len(fields) - size + 1, size):
        tag, kind = struct.unpack(order + "HH", fields[at : at + 4])
        if (tag, kind) == (_ORIENTATION, _SHORT):
            (orientation,) = struct.unpack(order + "H", fields[at + value : at + value + 2])
            return Stated(orientation, first + at + value, order) if 1 <= orientation <= 8 else None
    return None
