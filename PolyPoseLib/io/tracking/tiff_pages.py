"""Pages of a TIFF file, each written as a file of its own, so that one page at a time is in memory.

The image toolkit reads all pages of a file at once. A page is a directory of fields and the pieces (strips or tiles)
that two of them name (TIFF 6.0, sections 2 and 15); pieces are copied as they are, whatever their compression.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from PolyPoseLib.errors import InputError

MAX_PAGES = 200_000
"""Directories that are looked for."""

MAX_FIELDS = 4096
"""Fields of a directory; more are no picture's."""

MAX_VALUE_BYTES = 1 << 26
"""Of the fields of one page: a list of a million pieces has less."""

MAX_PAGE_BYTES = 1 << 30
"""Of all pieces of one page."""

_SIZES = {
    1: 1,
    2: 1,
    3: 2,
    4: 4,
    5: 8,
    6: 1,
    7: 1,
    8: 2,
    9: 4,
    10: 8,
    11: 4,
    12: 8,
    13: 4,
    16: 8,
    17: 8,
    18: 8,
}
"""Bytes of a value of each type."""

_CODES = {3: "H", 4: "I", 13: "I", 16: "Q", 18: "Q"}
"""Types of whole numbers."""

_WIDTH, _HEIGHT = 256, 257
_PIECES = ((273, 279), (324, 325))
"""Places and lengths of strips, and of tiles."""

_ELSEWHERE = (330, 34665, 34853)
"""Fields that lead to further directories, which a page does not need."""


@dataclass(frozen=True)
class Form:
    """How a TIFF file writes its numbers.

    Attributes
    ----------
    order
        "<" or ">".
    big
        Whether it is a BigTIFF, with places of 8 bytes.

    """

    order: str
    big: bool

    @property
    def place(self) -> str:
        """Code of a place."""
        return self.order + ("Q" if self.big else "I")

    @property
    def counter(self) -> str:
        """Code of the number of a directory's fields."""
        return self.order + ("Q" if self.big else "H")

    @property
    def inline(self) -> int:
        """Bytes of a value that a field holds itself."""
        return 8 if self.big else 4

    @property
    def field_bytes(self) -> int:
        """Bytes of a field."""
        return 20 if self.big else 12


@dataclass(frozen=True)
class Pages:
    """A TIFF file and the places of its directories."""

    path: Path
    form: Form
    places: tuple[int, ...]

    @classmethod
    def of(cls, path: Path, where: str) -> Pages:
        """Look for all pages of a file; raises InputError where it is none, or endless."""
        try:
            with path.open("rb") as stream:
                form, place = _begin(stream)
                places: list[int] = []
                seen: set[int] = set()
                while place and place not in seen:
                    seen.add(place)
                    places.append(place)
                    if len(places) > MAX_PAGES:
                        raise InputError(f"{where} has more than {MAX_PAGES} pages; give shorter sequences.")
                    place = _next(stream, form, place)
        except (OSError, struct.error, OverflowError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"{where} is damaged or no TIFF file; export it again.") from error
        if not places:
            raise InputError(f"{where} holds no page; export it again.")
        return cls(path, form, tuple(places))

    def size(self, index: int, where: str) -> tuple[int, int]:
        """(H, W) that a page states, as it is stored; raises InputError."""
        fields = self._fields(index, where)
        try:
            width, height = (_whole(fields[tag], self.form)[0] for tag in (_WIDTH, _HEIGHT))
        except (KeyError, IndexError) as error:
            raise InputError(f"{where} is damaged: it does not state its size; export it again.") from error
        return height, width

    def write(self, index: int, target: Path, where: str) -> None:
        """Write one page as a file of its own; raises InputError where it is damaged or cut short."""
        fields = self._fields(index, where)
        pieces = next((pair for pair in _PIECES if all(tag in fields for tag in pair)), None)
        if pieces is None:
            raise InputError(f"{where} is damaged: it does not say where its pixels are; export it again.")
        places, lengths = (_whole(fields[tag], self.form) for tag in pieces)
        if len(places) != len(lengths) or sum(lengths) > MAX_PAGE_BYTES:
            raise InputError(
                f"{where} is damaged: its strips or tiles contradict each other; export it again."
            )
        with self.path.open("rb") as stream, target.open("wb") as page:
            page.write(_header(self.form))
            new_places = []
            for place, length in zip(places, lengths, strict=True):
                stream.seek(place)
                content = stream.read(length)
                if len(content) < length:
                    raise InputError(f"{where} is cut short: its pixels are missing; copy the file again.")
                new_places.append(page.tell())
                page.write(content + b"\0" * (length % 2))
            kind = 16 if self.form.big else 4
            code = self.form.order + str(len(places)) + _CODES[kind]
            fields[pieces[0]] = (kind, len(places), struct.pack(code, *new_places))
            _write_directory(page, fields, self.form)

    def _fields(self, index: int, where: str) -> dict[int, tuple[int, int, bytes]]:
        """{tag: (type, count, value)} of one page."""
        try:
            with self.path.open("rb") as stream:
                return _directory(stream, self.form, self.places[index])
        except (OSError, struct.error, OverflowError, ValueError) as error:
            raise InputError(f"{where} is damaged: its fields cannot be read; export it again.") from error


def _begin(stream: BinaryIO) -> tuple[Form, int]:
    """The file's form and the place of its first directory."""
    head = stream.read(16)
    order = {b"II": "<", b"MM": ">"}.get(head[:2])
    if order is None:
        raise ValueError
    (version,) = struct.unpack(order + "H", head[2:4])
    if version == 42:
        return Form(order, False), struct.unpack(order + "I", head[4:8])[0]
    if version != 43 or struct.unpack(order + "HH", head[4:8]) != (8, 0):
        raise ValueError
    return Form(order, True), struct.unpack(order + "Q", head[8:16])[0]


def _next(stream: BinaryIO, form: Form, place: int) -> int:
    """The place of the directory after the one at a place, 0 after the last."""
    count = _count(stream, form, place)
    stream.seek(count * form.field_bytes, 1)
    return struct.unpack(form.place, stream.read(struct.calcsize(form.place)))[0]


def _count(stream: BinaryIO, form: Form, place: int) -> int:
    """How many fields a directory has; the stream stands at the first of them."""
    stream.seek(place)
    (count,) = struct.unpack(form.counter, stream.read(struct.calcsize(form.counter)))
    if not 0 < count <= MAX_FIELDS:
        raise ValueError
    return count


def _directory(stream: BinaryIO, form: Form, place: int) -> dict[int, tuple[int, int, bytes]]:
    """{tag: (type, count, value)} of the directory at a place."""
    count = _count(stream, form, place)
    entries = stream.read(count * form.field_bytes)
    fields: dict[int, tuple[int, int, bytes]] = {}
    head = struct.Struct(form.order + ("HHQ" if form.big else "HHI"))
    left = MAX_VALUE_BYTES
    for at in range(0, len(entries), form.field_bytes):
        tag, kind, number = head.unpack_from(entries, at)
        if tag in _ELSEWHERE or kind not in _SIZES:
            continue
        size = _SIZES[kind] * number
        value = entries[at + head.size : at + form.field_bytes]
        if size > form.inline:
            left -= size
            if left < 0:
                raise ValueError
            stream.seek(struct.unpack(form.place, value)[0])
            value = stream.read(size)
        if len(value) < size:
            raise ValueError
        fields[tag] = (kind, number, value[:size])
    return fields


def _whole(field: tuple[int, int, bytes], form: Form) -> tuple[int, ...]:
    """The whole numbers of a field; none where it holds others."""
    kind, number, value = field
    return struct.unpack(f"{form.order}{number}{_CODES[kind]}", value) if kind in _CODES else ()


def _header(form: Form) -> bytes:
    """The beginning of a file whose directory is written later."""
    mark = b"II" if form.order == "<" else b"MM"
    if form.big:
        return mark + struct.pack(form.order + "HHHQ", 43, 8, 0, 0)
    return mark + struct.pack(form.order + "HI", 42, 0)


def _write_directory(page: BinaryIO, fields: dict[int, tuple[int, int, bytes]], form: Form) -> None:
    """Write values, then the directory as the last one, and name its place in the header."""
    entries = []
    for tag, (kind, number, value) in sorted(fields.items()):
        if len(value) > form.inline:
            place = page.tell()
            page.write(value + b"\0" * (len(value) % 2))
            value = struct.pack(form.place, place)
        head = struct.pack(form.order + ("HHQ" if form.big else "HHI"), tag, kind, number)
        entries.append(head + value.ljust(form.inline, b"\0"))
    place = page.tell()
    page.write(struct.pack(form.counter, len(entries)) + b"".join(entries) + struct.pack(form.place, 0))
    page.seek(8 if form.big else 4)
    page.write(struct.pack(form.place, place))
