"""Tables and figures that a benchmark has written, known by their content, so that no file of a user's is removed."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.benchmark_folder import FIGURES, TABLES
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, json_text, nonempty, object_of, parse_object
from PolyPoseLib.io.whole_files import replaced_whole

LIST = "outputs.json"
"""In the benchmark's folder."""

_VERSION = 1


def replace_written(folder: Path, names: Mapping[str, list[str]]) -> None:
    """Take note of what was written now, and remove what earlier calls noted and this one did not write.

    A file that is not in the list, or has changed since, is a user's own and stays.

    Parameters
    ----------
    folder : Path
        Of the benchmark.
    names : {str: list of str}
        Names of the files that were written now, by their folders, TABLES and FIGURES.

    Raises
    ------
    OSError
        The system refuses to read or write; a file that cannot be removed stays in the list.

    """
    now = {f"{place}/{name}" for place, found in names.items() for name in found}
    written = {path: _digest(folder / path) for path in sorted(now)}
    for path, digest in _read(folder).items():
        if path not in now and _is_own(folder / path, digest):
            try:
                (folder / path).unlink()
            except OSError:
                written[path] = digest
    with replaced_whole(folder / LIST) as temporary:
        temporary.write_text(json_text({"version": _VERSION, "files": written}), encoding="utf-8")


def _read(folder: Path) -> dict[str, str]:
    """{path: digest} of earlier calls; none where there is no list or a damaged one."""
    path = folder / LIST
    if not path.is_file():
        return {}
    try:
        record = Record(parse_object(read_text(path, "a benchmark's list of files"), LIST))
        if record.fields.get("version") != _VERSION:
            return {}
        found: dict[str, Any] = record.required("files", object_of(nonempty))
    except InputError:
        return {}
    return {path: digest for path, digest in found.items() if _is_place(path)}


def _is_place(path: str) -> bool:
    """Whether a path of the list is that of a file directly in one of the folders."""
    place, slash, name = path.partition("/")
    return (
        bool(slash) and place in (TABLES, FIGURES) and Path(name).name == name and name not in ("", ".", "..")
    )


def _is_own(path: Path, digest: str) -> bool:
    with contextlib.suppress(OSError):
        return path.is_file() and not path.is_symlink() and _digest(path) == digest
    return False


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
