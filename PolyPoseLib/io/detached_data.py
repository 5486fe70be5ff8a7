"""Where a MetaImage or NRRD header says that its voxels are: behind the header, or in other files.

The toolkit follows such a name without asking, to any place on the disk.  A header that is ambiguous is
therefore refused.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import refuse_special_file

HEADER_ENDINGS = (".mhd", ".mha", ".nhdr", ".nrrd")
"""File names whose header may keep the voxels in another file."""

MAX_HEADER_BYTES = 1 << 22
"""Longer headers are refused: what they name at their end would not be seen."""

_META_MARK = re.compile(rb"elementdatafile", re.IGNORECASE)
_META_FIELD = re.compile(rb"(?:\A|(?<=\n))[ \t]*ElementDataFile[ \t]*[=:]([^\n]*)")
_NRRD_FIELD = re.compile(r"^\s*data\s*file\s*:(?!=)(.*)$", re.IGNORECASE)


def data_place(header: Path) -> str | None:
    """What the header names as the place of its voxels: a file, a pattern or "LIST"; None when they follow in it.

    Raises
    ------
    InputError
        The header is longer than MAX_HEADER_BYTES, no file, or ambiguous; the sentence names the file.

    """
    refuse_special_file(header, header.name)
    with header.open("rb") as stream:
        head = stream.read(MAX_HEADER_BYTES + 1)
    is_meta = header.name.lower().endswith((".mhd", ".mha"))
    place = _metaimage_place(head, header.name) if is_meta else _nrrd_place(head, header.name)
    if place is not None and (not place or any(ord(letter) < 32 or ord(letter) == 127 for letter in place)):
        raise _unclear(header.name)
    return place


def refuse_special_data(header: Path) -> None:
    """Refuse a header whose voxels come from a pipe, a socket or a device; raises InputError that names the header.

    An ambiguous header, or one that names several files, is left to `PolyPoseLib.io.paths`, which refuses it unless
    the caller allows it.
    """
    if not header.name.lower().endswith(HEADER_ENDINGS):
        return
    try:
        place = data_place(header)
    except InputError:
        return
    if place is not None and not names_several_files(place):
        refuse_special_file(header.parent / place, f'{header} reads its voxels from "{place}"')


def is_in_several_files(header: Path) -> bool:
    """Whether a header names a list or a sequence of files, or cannot be understood; other files are False."""
    if not header.name.lower().endswith(HEADER_ENDINGS):
        return False
    try:
        place = data_place(header)
    except InputError:
        return True
    return place is not None and names_several_files(place)


def names_several_files(place: str) -> bool:
    """Whether a place that data_place returned stands for a list or a numbered sequence of files."""
    return "%" in place or place.upper().startswith("LIST")


def _metaimage_place(head: bytes, name: str) -> str | None:
    """The value of ElementDataFile, which ends a MetaImage header; both of its separators count."""
    marks = list(_META_MARK.finditer(head))
    if not marks:
        if len(head) > MAX_HEADER_BYTES:
            raise _too_long(name)
        return None
    field = _META_FIELD.search(head)
    # A second mark, or one inside another field's value, may be the one that the toolkit takes.
    if len(marks) > 1 or field is None:
        raise _unclear(name)
    value = os.fsdecode(field[1]).strip()
    return None if value.upper() == "LOCAL" else value


def _nrrd_place(head: bytes, name: str) -> str | None:
    """The value of "data file", anywhere before the empty line that ends a NRRD header."""
    end = re.search(rb"\n\r?\n", head)
    if end is None and len(head) > MAX_HEADER_BYTES:
        raise _too_long(name)
    lines = re.split(r"[\r\n]+", os.fsdecode(head[: end.start()] if end else head))
    found = [match[1].strip() for match in map(_NRRD_FIELD.match, lines) if match]
    if len(found) > 1:
        raise _unclear(name)
    return found[0] if found else None


def _too_long(name: str) -> InputError:
    """The error about a header without an end."""
    return InputError(
        f"{name}: its header is longer than {MAX_HEADER_BYTES >> 20} MiB: save the image again without comments."
    )


def _unclear(name: str) -> InputError:
    """The error about a header that can be read in two ways."""
    return InputError(
        f"{name}: its header does not say clearly which file holds the voxels: save header and voxels as one file."
    )
