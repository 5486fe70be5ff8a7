"""A bound on the items of sequences in a DICOM file: eight bytes make one, and a toolkit takes a thousand for it."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path

from PolyPoseLib.errors import InputError

MAX_ITEMS = 3_000_000
"""A segmentation of 300,000 frames has some two million."""

_MARKS = (b"\xfe\xff\x00\xe0", b"\xff\xfe\xe0\x00")
"""The tag Item (FFFE,E000), in either order of bytes; pixels hold it by chance once in 4 GiB."""

_CHUNK = 1 << 20
_DEFLATED = b"1.2.840.10008.1.2.1.99"
"""Transfer syntax of files that are deflated after their file meta information."""


def refuse_many_items(path: Path) -> None:
    """Refuse a file with more items than any segmentation has, before they are made; raises InputError."""
    found, before = 0, b""
    for chunk in _content(path):
        window = before + chunk
        found += sum(window.count(mark) for mark in _MARKS)
        before = window[-3:]
        if found > MAX_ITEMS:
            raise InputError(
                f"{path}: it has more than {MAX_ITEMS} items of sequences, more than a segmentation has: export it "
                "again with fewer structures."
            )


def _content(path: Path) -> Iterator[bytes]:
    """The bytes of a file in parts, inflated where it is deflated; a damaged one ends where it can be read to."""
    with path.open("rb") as stream:
        head = stream.read(1024)
        if head[128:132] != b"DICM" or _DEFLATED not in head:
            yield head
            while chunk := stream.read(_CHUNK):
                yield chunk
            return
        stream.seek(144 + int.from_bytes(head[140:144], "little"))
        inflate = zlib.decompressobj(-zlib.MAX_WBITS)
        try:
            while not inflate.eof and (chunk := inflate.unconsumed_tail or stream.read(_CHUNK)):
                yield inflate.decompress(chunk, _CHUNK)
        except zlib.error:
            return
