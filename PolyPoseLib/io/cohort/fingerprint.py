"""A study's fingerprint: a digest of all its files, its options and this version, by which finished studies are known.

Files are read when they are new, or when their size or time of change is; ``rehash`` reads all of them.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from PolyPoseLib import __version__
from PolyPoseLib.data.cohort.outcome import FileStamp
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import paths as study_paths
from PolyPoseLib.io import study_schema

_XRAY_FILES = ("image", "mask", "calibration")

_BLOCK_BYTES = 1 << 22

_SETTLED_NS = 2_000_000_000
"""A file that changed so shortly before it was read may change again without a new time: it is not remembered."""


def fingerprint(
    study: Path, options: Mapping[str, Any], allow_outside: bool, known: Mapping[str, FileStamp]
) -> tuple[str, dict[str, FileStamp]]:
    """The digest of a study, and the stamps of its files.

    Parameters
    ----------
    study : Path
        Its study.json; a damaged study has a digest, too.
    options : mapping
        That win over the study's.
    allow_outside : bool
        Whether files outside of its folder are read.
    known : {str: FileStamp}
        Of an earlier run; empty to read everything.

    Returns
    -------
    digest : str
        64 hexadecimal digits.
    stamps : {str: FileStamp}
        Under digests of the files' names, since names may be patients'.

    """
    digest = hashlib.sha256(json.dumps([__version__, dict(options)], sort_keys=True).encode())
    stamps: dict[str, FileStamp] = {}
    for name, path in study_files(study, allow_outside):
        key = hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:24]
        stamp = _stamp(path, known.get(key))
        digest.update(f"{key} {stamp.sha256}\n".encode())
        if stamp.changed_ns:
            stamps[key] = stamp
    return digest.hexdigest(), stamps


def study_files(study: Path, allow_outside: bool) -> Iterator[tuple[str, Path]]:
    """Every file that a study is read from, with a name that tells it from the others, in an order of their own."""
    yield "study", study
    try:
        named = list(_named(study, study_schema.read(study), allow_outside))
    except InputError:
        return  # its registration says what is wrong; its own text is all that tells it from another
    for field, target in named:
        for path in _files_of(target):
            # Relative to the study, so that a cohort that was moved as a whole is known again.
            yield f"{field}:{os.path.relpath(path, study.parent)}", path


def _named(study: Path, fields: Mapping[str, Any], allow_outside: bool) -> Iterator[tuple[str, Path]]:
    """Field and resolved path of every file or folder that a study names and that may be read."""
    given: list[tuple[str, Any]] = [(field, fields[field]) for field in ("ct", "segmentation")]
    given.append(("camera_model", (fields.get("options") or {}).get("camera_model")))
    for number, xray in enumerate(fields["xrays"]):
        given += [(f"xray {number} {field}", xray.get(field)) for field in _XRAY_FILES]
    for field, name in given:
        if not isinstance(name, str):
            continue
        try:
            yield field, study_paths.resolve(name, field, study.parent.resolve(), allow_outside)
        except InputError:
            continue


def _files_of(target: Path) -> list[Path]:
    """The files of a folder, or a file with those that reading it opens."""
    if target.is_dir():
        return sorted(each for each in target.rglob("*") if each.is_file())
    try:
        return [target, *sorted(study_paths.files_behind(target))]
    except (InputError, OSError):
        return [target]


def _stamp(path: Path, known: FileStamp | None) -> FileStamp:
    """What a file is now; one that cannot be read, and one that may still change, has no time."""
    try:
        status = path.stat()
        if known and (known.size, known.changed_ns) == (status.st_size, status.st_mtime_ns):
            return known
        found = hashlib.sha256()
        with path.open("rb") as stream:
            while block := stream.read(_BLOCK_BYTES):
                found.update(block)
    except OSError as error:
        return FileStamp(0, 0, f"unreadable {error.errno}")
    settled = status.st_mtime_ns + _SETTLED_NS < time.time_ns()
    return FileStamp(status.st_size, status.st_mtime_ns if settled else 0, found.hexdigest())
