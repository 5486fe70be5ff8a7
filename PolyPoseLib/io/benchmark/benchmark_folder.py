"""The folder of a benchmark: made, known again, and held by one run at a time."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.places import files_below
from PolyPoseLib.io.locks import locked
from PolyPoseLib.io.marked_folders import FolderMark, require_parent, resolved_places

MARK = "benchmark.json"
"""The file by which a folder is known to be a benchmark's."""

CASES, ROWS, LOGS = "cases", "rows", "logs"
TABLES, FIGURES, FIELDS, PICTURES = "tables", "figures", "fields", "pictures"
"""Folders in it."""

VERSION = 1

_MARK = FolderMark("benchmark", MARK, VERSION)


@contextmanager
def opened_benchmark(folder: Path, dataset: str, data: Path, resume: bool) -> Iterator[Path]:
    """Hold the folder of a benchmark for a run: made where it is absent or empty, gone on with where that was asked.

    Parameters
    ----------
    folder : Path
        Of the benchmark.
    dataset : str
        Layout of the data; a folder holds rows of one.
    data : Path
        That the folder must neither be nor hold, nor lie in.
    resume : bool
        Whether an earlier run is gone on with.

    Yields
    ------
    Path
        The folder, resolved.

    Raises
    ------
    InputError
        It holds something else, or an earlier run that is not to be resumed; cannot be made; is too near to the
        data; or another run holds it.

    """
    target, source = resolved_places(folder, data)
    if target == source or target.is_relative_to(source) or source.is_relative_to(target):
        raise InputError(
            f"{folder}: the benchmark and its data {data} must lie beside each other: choose another --output."
        )
    _require_place(folder, target, dataset, resume)
    with locked(target, str(folder)):
        target.mkdir(exist_ok=True)
        _MARK.write(target, dataset=dataset)
        for each in (CASES, ROWS, LOGS):
            (target / each).mkdir(exist_ok=True)
        yield target


def _require_place(folder: Path, target: Path, dataset: str, resume: bool) -> None:
    """Refuse what cannot be a benchmark's folder; raises InputError."""
    require_parent(folder, target)
    fields = _MARK.require_place(folder, target)
    if fields is None:
        return
    if fields.get("dataset") != dataset:
        raise InputError(
            f"{folder}: it holds a benchmark of {fields.get('dataset')}, not of {dataset}: choose another --output."
        )
    if not resume:
        raise InputError(
            f"{folder}: it holds an earlier run: add --resume to go on with it, or choose a new or empty folder."
        )


def data_stamp(data: Path) -> str:
    """A digest of the names, sizes and times of change of all files in the data, a folder or a file.

    As long as it stays, cases need not be read again to know that they are the same. Files that lie elsewhere, behind
    links, are no part of the data. Raises OSError where the system refuses.
    """
    data = data.resolve()
    return files_stamp(files_below(data, data), data)


def files_stamp(files: Iterable[Path], root: Path) -> str:
    """A digest of the names below the root, sizes and times of change of some files; raises OSError."""
    found = hashlib.sha256()
    for path in sorted(files):
        status = path.stat()
        line = f"{os.path.relpath(path, root)} {status.st_size} {status.st_mtime_ns}\n"
        found.update(line.encode("utf-8", "surrogateescape"))
    return found.hexdigest()
