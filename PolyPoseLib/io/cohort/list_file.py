"""LIST.csv: a study a line, by the columns id and study."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from PolyPoseLib.data.cohort.entries import MAX_STUDIES, require_count
from PolyPoseLib.errors import InputError, cut, nearest
from PolyPoseLib.io.files import read_text

COLUMNS = ("id", "study")
"""That a list must have; others are passed over."""

MAX_BYTES = 256 << 20


def read_list(path: Path) -> list[tuple[int, str, str]]:
    """Number of the line, id and study of every line that is not empty.

    Raises
    ------
    InputError
        No text, no such columns, or a line that is no CSV; the sentence names the line and the fix.

    """
    text = read_text(path, "a CSV file with the columns id,study, or a folder of studies", MAX_BYTES)
    rows = csv.reader(io.StringIO(text, newline=""), strict=True)
    found: list[tuple[int, str, str]] = []
    try:
        first = next(filter(any, rows), [])
        header = [each.strip().lower() for each in first]
        places = [_column(header, name, path) for name in COLUMNS]
        for row in rows:
            if not any(each.strip() for each in row):
                continue
            cells = [row[place].strip() if place < len(row) else "" for place in places]
            if any("\n" in each or "\r" in each for each in cells):
                raise InputError(
                    f"{path}: line {rows.line_num}: a cell goes over several lines: close its quotation mark."
                )
            found.append((rows.line_num, cells[0], cells[1]))
            if len(found) > MAX_STUDIES:
                require_count(len(found), str(path))
    except csv.Error as error:
        raise InputError(f"{path}: line {rows.line_num} is no CSV ({error}): correct it there.") from error
    return found


def _column(header: list[str], name: str, path: Path) -> int:
    """Place of a column; raises InputError where it is missing or there twice."""
    count = header.count(name)
    if count == 1:
        return header.index(name)
    if count > 1:
        raise InputError(f'{path}: the first line has the column "{name}" {count} times: keep one of them.')
    for sign, what in ((";", "semicolons"), ("\t", "tabs")):
        if any(sign in each for each in header):
            raise InputError(f"{path}: its columns are separated by {what}: save it with commas.")
    alike = nearest(name, header)
    hint = f' (it has "{cut(alike, 40)}")' if alike else ""
    raise InputError(
        f'{path}: the first line has no column "{name}"{hint}: begin with {",".join(COLUMNS)}, then one study a line.'
    )
