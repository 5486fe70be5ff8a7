"""The part of HDF5 in which ITK writes transforms, read with bounded steps and checked sums.

The HDF5 library trusts what it reads: one damaged byte can keep it busy for ever, or end the process. This reader knows
superblock 2, object headers 2, links that stand in them, and datasets in one piece (HDF5 File Format Specification
version 3.0, sections II.A, IV.A and III.E). Everything else is :class:`UnknownLayout`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MAX_HEADER = 1 << 16
"""Bytes of one block of an object's header."""

MAX_BLOCKS = 64
"""Blocks of an object's header, and links of a group."""

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_DATASPACE, _DATATYPE, _LINK, _LAYOUT, _FILTERS, _CONTINUATION = 0x01, 0x03, 0x06, 0x08, 0x0B, 0x10
_DOUBLE = bytes.fromhex("11203f000800000000004000340b0034ff030000")
"""Datatype message of float64, little-endian."""


class UnknownLayout(Exception):
    """The file may be sound, but this reader does not know its layout."""


class Damaged(Exception):
    """The file contradicts itself; the text says how."""


@dataclass(frozen=True)
class Dataset:
    """A dataset in one piece: its shape, datatype message, and place in the file in bytes."""

    shape: tuple[int, ...]
    datatype: bytes
    address: int
    length: int


class Hdf5File:
    """A file's objects by their addresses; the file is held open for a ``with`` block.

    Raises ``UnknownLayout`` and ``Damaged`` where it is opened and read.
    """

    def __init__(self, path: Path) -> None:
        self._stream = path.open("rb")
        self._size = path.stat().st_size
        try:
            head = self._bytes(0, 48)
            if head[:8] != _SIGNATURE:
                raise Damaged("it is no HDF5 file")
            if head[8:11] != bytes((2, 8, 8)):
                raise UnknownLayout
            _check_sum(head)
            base, _, end, self.root = struct.unpack_from("<4Q", head, 12)
            if base != 0:
                raise UnknownLayout
            if end != self._size:
                raise Damaged(f"it has {self._size} bytes instead of {end}")
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> Hdf5File:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def links(self, address: int) -> dict[str, int]:
        """Addresses of a group's members by their names."""
        links = {}
        for kind, body in self._messages(address):
            if kind == _LINK:
                name, target = _link(body)
                links[name] = target
        if len(links) > MAX_BLOCKS:
            raise UnknownLayout
        return links

    def dataset(self, address: int) -> Dataset:
        """What a dataset's header says."""
        found = {kind: body for kind, body in self._messages(address)}
        if _FILTERS in found or not {_DATASPACE, _DATATYPE, _LAYOUT} <= set(found):
            raise UnknownLayout
        space, layout = found[_DATASPACE], found[_LAYOUT]
        if space[0] != 2 or layout[:2] != b"\x03\x01":
            raise UnknownLayout
        rank = space[1]
        if len(space) < 4 + 8 * rank or len(layout) < 18:
            raise Damaged("a header is too short")
        shape = struct.unpack_from(f"<{rank}Q", space, 4)
        return Dataset(shape, found[_DATATYPE], *struct.unpack_from("<2Q", layout, 2))

    def doubles(self, address: int) -> np.ndarray:
        """The values of a dataset of float64."""
        dataset = self.dataset(address)
        if dataset.datatype[: len(_DOUBLE)] != _DOUBLE:
            raise UnknownLayout
        if dataset.length != 8 * math.prod(dataset.shape):
            raise Damaged("a dataset's size contradicts its shape")
        self._require_inside(dataset.address, dataset.length)
        self._stream.seek(dataset.address)
        values = np.fromfile(self._stream, "<f8", dataset.length // 8)
        return values.reshape(dataset.shape)

    def text(self, address: int) -> str:
        """The text of a dataset of one string, which stands in a global heap."""
        dataset = self.dataset(address)
        if dataset.datatype[:1] != b"\x19" or dataset.length != 16:
            raise UnknownLayout
        length, heap, wanted = struct.unpack("<IQI", self._bytes(dataset.address, 16))
        for number, body in self._heap_objects(heap):
            if number == wanted:
                return body[:length].decode("utf-8", "replace").rstrip("\0")
        raise Damaged("one of its texts has no content")

    def _heap_objects(self, address: int) -> Iterator[tuple[int, bytes]]:
        """Numbers and contents of a global heap's objects."""
        head = self._bytes(address, 16)
        size = struct.unpack_from("<Q", head, 8)[0]
        if head[:5] != b"GCOL\x01" or not 16 <= size <= MAX_HEADER:
            raise Damaged("a heap is damaged")
        heap, place = self._bytes(address, size), 16
        while place + 16 <= size:
            number, length = struct.unpack_from("<H6xQ", heap, place)
            if number == 0:  # free space up to the end
                return
            if place + 16 + length > size:
                raise Damaged("a heap is damaged")
            yield number, heap[place + 16 : place + 16 + length]
            place += 16 + (length + 7) // 8 * 8

    def _messages(self, address: int) -> Iterator[tuple[int, bytes]]:
        """Kinds and bodies of an object's header messages, those of its continuations included."""
        head = self._bytes(address, min(6 + 16 + 4 + 8, self._size - address) if address < self._size else 6)
        if head[:4] != b"OHDR" or head[4] != 2:
            raise UnknownLayout
        flags = head[5]
        place = 6 + (16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        size = int.from_bytes(head[place : place + width], "little")
        place += width
        blocks = [(address, place, place + size + 4)]
        for count, (start, skip, length) in enumerate(blocks):
            if length > MAX_HEADER or count > MAX_BLOCKS:
                raise Damaged("a header is too long")
            block = self._bytes(start, length)
            _check_sum(block)
            for kind, body in _split_messages(block[skip:-4], ordered=bool(flags & 4)):
                if kind != _CONTINUATION:
                    yield kind, body
                    continue
                if len(body) < 16:
                    raise Damaged("a header is too short")
                more, more_length = struct.unpack_from("<2Q", body)
                if more_length < 8 or self._bytes(more, 4) != b"OCHK":
                    raise Damaged("a header's continuation is missing")
                blocks.append((more, 4, more_length))

    def _bytes(self, address: int, length: int) -> bytes:
        self._require_inside(address, length)
        self._stream.seek(address)
        return self._stream.read(length)

    def _require_inside(self, address: int, length: int) -> None:
        if address + length > self._size:
            raise Damaged("it is cut short, or an address leads out of it")


def _split_messages(block: bytes, ordered: bool) -> Iterator[tuple[int, bytes]]:
    """Kinds and bodies of the messages in one block of a header, without its sum."""
    head = 6 if ordered else 4
    place = 0
    while place + head <= len(block):
        kind, length = struct.unpack_from("<BH", block, place)
        body = block[place + head : place + head + length]
        if len(body) < length:
            raise Damaged("a header's message is cut short")
        yield kind, body
        place += head + length


def _link(body: bytes) -> tuple[str, int]:
    """Name and target of a hard link's message."""
    try:
        flags, place = body[1], 2
        if flags & 0x08:
            if body[place] != 0:
                raise UnknownLayout  # a soft or external link
            place += 1
        place += (8 if flags & 0x04 else 0) + (1 if flags & 0x10 else 0)
        width = 1 << (flags & 3)
        length = int.from_bytes(body[place : place + width], "little")
        place += width
        name = body[place : place + length].decode("utf-8", "replace")
        return name, struct.unpack_from("<Q", body, place + length)[0]
    except (IndexError, struct.error):
        raise Damaged("a link is cut short") from None


def _check_sum(block: bytes) -> None:
    """Compare a block's last four bytes with the sum of the others."""
    if lookup3(block[:-4]) != int.from_bytes(block[-4:], "little"):
        raise Damaged("a checksum is wrong")


def lookup3(data: bytes) -> int:
    """Bob Jenkins's hash lookup3 with the initial value 0, by which HDF5 guards its headers."""
    a = b = c = (0xDEADBEEF + len(data)) & 0xFFFFFFFF
    if not data:
        return c
    place = 0
    while len(data) - place > 12:
        x, y, z = struct.unpack_from("<3I", data, place)
        a, b, c = (a + x) & 0xFFFFFFFF, (b + y) & 0xFFFFFFFF, (c + z) & 0xFFFFFFFF
        a = ((a - c) & 0xFFFFFFFF) ^ _rotated(c, 4)
        c = (c + b) & 0xFFFFFFFF
        b = ((b - a) & 0xFFFFFFFF) ^ _rotated(a, 6)
        a = (a + c) & 0xFFFFFFFF
        c = ((c - b) & 0xFFFFFFFF) ^ _rotated(b, 8)
        b = (b + a) & 0xFFFFFFFF
        a = ((a - c) & 0xFFFFFFFF) ^ _rotated(c, 16)
        c = (c + b) & 0xFFFFFFFF
        b = ((b - a) & 0xFFFFFFFF) ^ _rotated(a, 19)
        a = (a + c) & 0xFFFFFFFF
        c = ((c - b) & 0xFFFFFFFF) ^ _rotated(b, 4)
        b = (b + a) & 0xFFFFFFFF
        place += 12
    x, y, z = struct.unpack("<3I", data[place:].ljust(12, b"\0"))
    a, b, c = (a + x) & 0xFFFFFFFF, (b + y) & 0xFFFFFFFF, (c + z) & 0xFFFFFFFF
    c = ((c ^ b) - _rotated(b, 14)) & 0xFFFFFFFF
    a = ((a ^ c) - _rotated(c, 11)) & 0xFFFFFFFF
    b = ((b ^ a) - _rotated(a, 25)) & 0xFFFFFFFF
    c = ((c ^ b) - _rotated(b, 16)) & 0xFFFFFFFF
    a = ((a ^ c) - _rotated(c, 4)) & 0xFFFFFFFF
    b = ((b ^ a) - _rotated(a, 14)) & 0xFFFFFFFF
    return ((c ^ b) - _rotated(b, 24)) & 0xFFFFFFFF


def _rotated(value: int, bits: int) -> int:
    """A 32-bit value turned to the left."""
    return ((value << bits) | (value >> (32 - bits))) & 0xFFFFFFFF
