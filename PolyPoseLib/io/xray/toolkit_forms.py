"""Pictures in a form that the toolkit reads whole: it knows no gray with alpha, and turns TIFF by way of 8 bits."""

from __future__ import annotations

import shutil
import struct
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.orientation import orientations

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_GRAY, _GRAY_ALPHA, _RGBA = 0, 4, 6


@contextmanager
def readable_form(path: Path) -> Iterator[Path]:
    """A file that holds the same pixels and that the toolkit reads in full depth and as stored: mostly the file itself.

    Parameters
    ----------
    path
        A picture.

    Raises
    ------
    InputError
        There is no room for a copy.

    """
    make = _maker(path)
    if make is None:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
        copy = Path(folder) / f"copy{path.suffix}"
        try:
            make(path, copy)
        except OSError as error:
            raise InputError(
                f"{path.name} cannot be copied to the temporary folder ({error.strerror}); free some space there."
            ) from error
        yield copy


def _maker(path: Path) -> Callable[[Path, Path], None] | None:
    """What makes a copy that the toolkit reads; None where it reads the file itself."""
    name = path.name.lower()
    if name.endswith((".tif", ".tiff")):
        return _unturned if any(stated and stated.value != 1 for stated in orientations(path)) else None
    return _with_wider_gray if name.endswith(".png") and gray_alpha_depth(path) else None


def _unturned(path: Path, copy: Path) -> None:
    """Copy a TIFF file with every page's orientation set to "as stored"."""
    shutil.copyfile(path, copy)
    with copy.open("r+b") as stream:
        for stated in orientations(path):
            if stated is not None:
                stream.seek(stated.offset)
                stream.write(struct.pack(stated.order + "H", 1))


def gray_alpha_depth(path: Path) -> int:
    """Bits of a gray value in a PNG file of gray with alpha, 8 or 16; 0 for every other file."""
    try:
        with path.open("rb") as stream:
            head = stream.read(26)
    except OSError:
        return 0
    if len(head) < 26 or head[:8] != _SIGNATURE or head[12:16] != b"IHDR" or head[25] != _GRAY_ALPHA:
        return 0
    return head[24] if head[24] in (8, 16) else 0


def gray_of(pixels: np.ndarray, depth: int) -> np.ndarray:
    """The gray values of what was read from a copy of a PNG file whose `gray_alpha_depth` this is."""
    if depth == 8:
        return (pixels >> 8).astype(np.uint8)
    return pixels[..., 0].astype(np.uint16) << 8 | pixels[..., 1]


def _with_wider_gray(path: Path, copy: Path) -> None:
    """Copy a PNG file of gray with alpha as one of 16-bit gray, or of four channels where its gray has 16 bits.

    PNG's filters and compression see bytes alone, and how many make one pixel, which stays the same.
    """
    with path.open("rb") as source, copy.open("wb") as target:
        target.write(source.read(8))
        while len(head := source.read(8)) == 8:
            size, kind = struct.unpack(">I4s", head)
            if kind == b"IDAT":
                target.write(head)
                _copy(source, target, size + 4)
            elif kind == b"IHDR":
                content = bytearray(source.read(size)[:13])
                content[8:10] = (16, _GRAY) if content[8] == 8 else (8, _RGBA)
                target.write(struct.pack(">I", len(content)) + kind + content)
                target.write(struct.pack(">I", zlib.crc32(kind + content)))
                source.seek(4, 1)
            else:
                source.seek(size + 4, 1)
        target.write(struct.pack(">I4sI", 0, b"IEND", zlib.crc32(b"IEND")))


def _copy(source: BinaryIO, target: BinaryIO, size: int) -> None:
    """Copy so many bytes, or what is left."""
    while size > 0 and (content := source.read(min(size, 1 << 20))):
        target.write(content)
        size -= len(content)
