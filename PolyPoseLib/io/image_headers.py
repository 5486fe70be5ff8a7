"""Headers of image files that would end the process inside the toolkit or hold it for hours, refused before it reads.

Its parsers copy some fields into buffers of fixed size, take a number of axes without a bound, and use a file name as
the format of a text.  The limits here were found by experiment, with a margin; whole and usual files are far from them.
"""

from __future__ import annotations

import re
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.detached_data import HEADER_ENDINGS, MAX_HEADER_BYTES
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.inflation import MAX_SKIPPED_BYTES
from PolyPoseLib.io.nifti import NIFTI_ENDINGS, pair_of, read_header

MAX_FIELD_BYTES = 900
"""A longer standard field of NRRD overruns a buffer of the toolkit when it puts it into an error's text."""

MAX_LINES = 50_000
"""The toolkit's time grows with the square of the number of fields."""

MAX_AXES = 10
"""More axes overrun arrays of both formats."""

_NRRD_END = re.compile(rb"\n\r?\n|\r\r")
_COMPRESSED = re.compile(rb"[ \t]*encoding[ \t]*:[ \t]*(?:gz|bz)", re.IGNORECASE)
_SKIP = re.compile(rb"[ \t]*(?:line|byte)[ \t]*skip[ \t]*:[ \t]*([-+]?[0-9]+)", re.IGNORECASE)
_META_END = re.compile(rb"^[ \t]*ElementDataFile[^\n]*", re.MULTILINE | re.IGNORECASE)
_META_AXES = re.compile(rb"^[ \t]*NDims[ \t]*[=:]?([^\n]*)", re.MULTILINE | re.IGNORECASE)
_WHOLE = re.compile(rb"\d{1,2}")


def refuse_hostile_header(path: Path, where: str) -> None:
    """Refuse a MetaImage, NRRD or NIfTI file whose header the toolkit does not survive.

    Parameters
    ----------
    path
        The file; other kinds pass.
    where
        Opening of the sentence.

    Raises
    ------
    InputError
        The sentence says which field is at fault.

    """
    name = path.name.lower()
    if not path.is_file():
        return
    if name.endswith(NIFTI_ENDINGS):
        fault = _nifti_fault(path)
    elif name.endswith(HEADER_ENDINGS):
        with path.open("rb") as stream:
            head = stream.read(MAX_HEADER_BYTES)
        fault = (_nrrd_fault if name.endswith((".nrrd", ".nhdr")) else _metaimage_fault)(head)
    else:
        return
    if fault:
        raise InputError(
            f"{where}: the file is damaged or cut short, or no image: its header {fault}; save the image again."
        )


def _nrrd_fault(head: bytes) -> str | None:
    """What is wrong with the header of a NRRD file; None where nothing is."""
    end = _NRRD_END.search(head)
    lines = re.split(rb"[\r\n]+", head[: end.start()] if end else head)
    if len(lines) > MAX_LINES:
        return f"has more than {MAX_LINES} fields"
    compressed = any(_COMPRESSED.match(line) for line in lines)
    for line in lines:
        if _is_free_text(line):
            continue
        if compressed and (skip := _SKIP.match(line)) and abs(int(skip[1][:20])) > MAX_SKIPPED_BYTES:
            return f"skips more than {MAX_SKIPPED_BYTES >> 20} MiB of compressed voxels"
        field, _, value = line.partition(b":")
        if len(line) > MAX_FIELD_BYTES and field.strip().lower() != b"content":
            shown = field.decode("ascii", "replace")[:20].strip()
            return f'has the field "{_printable(shown)}" of {len(line)} bytes'
        if field.strip().lower() == b"dimension" and _axes(value) is None:
            return f"does not state a dimension from 1 to {MAX_AXES}"
    return None


def _is_free_text(line: bytes) -> bool:
    """Whether a line is a comment or a pair of key and value, which may be of any length."""
    key = line.find(b":=")
    colon = line.find(b": ")
    return line.startswith(b"#") or (key >= 0 and (colon < 0 or key < colon) and b"\0" not in line)


def _nifti_fault(path: Path) -> str | None:
    """What is wrong with the header of a NIfTI or Analyze file; None where nothing is, or where it is none."""
    for half in pair_of(path):
        refuse_special_file(half)
    try:
        offset = read_header(path).offset
    except InputError:
        return None
    return None if offset <= MAX_SKIPPED_BYTES else "places the voxels beyond the end of any such file"


def _metaimage_fault(head: bytes) -> str | None:
    """What is wrong with the header of a MetaImage file; None where nothing is."""
    end = _META_END.search(head)
    fields = head[: end.start()] if end else head
    if fields.count(b"\n") > MAX_LINES:
        return f"has more than {MAX_LINES} fields"
    if any(_axes(match[1]) is None for match in _META_AXES.finditer(fields)):
        return f"does not state NDims from 1 to {MAX_AXES}"
    return None


def _axes(value: bytes) -> int | None:
    """A number of axes that the toolkit survives; None for any other value."""
    value = value.strip()
    return int(value) if _WHOLE.fullmatch(value) and 1 <= int(value) <= MAX_AXES else None


def _printable(text: str) -> str:
    """The text without letters that a console would obey."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
