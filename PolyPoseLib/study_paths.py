"""Which files a study may name: those in its own folder, unless the user allows others."""

from __future__ import annotations

import re
from pathlib import Path

from PolyPoseLib.errors import InputError

_DATA_FIELD = re.compile(r"^\s*(?:ElementDataFile\s*=|data ?file\s*:)\s*(.+?)\s*$", re.IGNORECASE)

_DETACHED_HEADERS = (".mhd", ".nhdr", ".mha", ".nrrd")


def resolve(name: str, field: str, folder: Path, allow_outside: bool) -> Path:
    """The existing path that a field names, relative to the study's folder.

    Links are followed first, so a link that leaves the folder is refused as "../" is. Raises InputError.
    """
    if not isinstance(name, str) or not name.strip() or "\0" in name:
        raise InputError(f'"{field}" is {name!r}: give the path of a file, relative to the study\'s folder.')
    path = folder / name
    try:
        target = path.resolve()
        exists = target.exists()
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f'"{field}" names "{name}", a path that cannot be followed: correct it.') from error
    if not allow_outside and not _is_inside(target, folder):
        raise InputError(
            f'"{field}" names "{name}", outside the study\'s folder: move it into the folder, or allow it '
            "with --allow-outside."
        )
    if not exists:
        raise InputError(
            f'"{field}" names "{name}", but there is no such file in {folder}: correct the name.'
        )
    if not allow_outside:
        for part in _files_behind(target):
            if not _is_inside(part.resolve(), folder):
                raise InputError(
                    f'"{field}" names "{name}", which reads "{part.name}" outside the study\'s folder: '
                    "move that into the folder, or allow it with --allow-outside."
                )
    return target


def _is_inside(target: Path, folder: Path) -> bool:
    """Whether a resolved path is in the folder or below it."""
    return target.is_relative_to(folder.resolve())


def _files_behind(path: Path) -> list[Path]:
    """Further files that reading this one opens: a folder's slices, the data of a detached header."""
    if path.is_dir():
        return [file for file in path.rglob("*") if file.is_symlink()]
    name = path.name.lower()
    if name.endswith(".hdr"):
        return [
            path.with_suffix(ending) for ending in (".img", ".img.gz") if path.with_suffix(ending).exists()
        ]
    if name.endswith((".img", ".img.gz")):
        return [path.parent / (path.name.split(".img")[0] + ".hdr")]
    return _detached_data(path) if name.endswith(_DETACHED_HEADERS) else []


def _detached_data(header: Path) -> list[Path]:
    """The data files that a MetaImage or NRRD header names, and those listed below a LIST."""
    with header.open("rb") as stream:
        text = stream.read(1 << 20).decode("latin-1").replace("\r\n", "\n")
    lines = (text.split("\n\n", 1)[0] if text.startswith("NRRD") else text).split("\n")
    for number, line in enumerate(lines):
        match = _DATA_FIELD.match(line)
        if not match or match[1].upper() == "LOCAL":
            continue
        value = match[1]
        if value.upper().startswith("LIST"):
            return [header.parent / each.strip() for each in lines[number + 1 :] if each.strip()]
        pattern = re.match(r"^(\S*%\d*d\S*)\s", value + " ")
        return [header.parent / (pattern[1] if pattern else value)]
    return []
