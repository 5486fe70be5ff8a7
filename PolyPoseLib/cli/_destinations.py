"""Files that a subcommand will write: refused, before any work, where they would replace what the study needs."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import refuse_special_file

_XRAY_FILES = ("image", "mask", "calibration")
_OPTION_FILES = ("camera_model", "preview")


def check_json_destinations(
    study: Path, fields: Mapping[str, Any], output: Path, report: Path | None
) -> None:
    """Refuse places to which the study or the report of what was found must not, or cannot, be written.

    study: the study's file, whose fields are ``fields``; output: where it is written with its cameras, its own place as
    a rule. Raises InputError.
    """
    check_writable(output, "--output")
    named = dict(named_files(fields, study.resolve().parent))
    _check_replaceable(output, "--output", named)
    if report is None:
        return
    check_writable(report, "--report")
    for other, what in ((study, "the study itself"), (output, "the file of --output")):
        if _is_same(report, other):
            raise InputError(f"{report}: this is {what}: choose another --report.")
    _check_replaceable(report, "--report", named)


def named_files(fields: Mapping[str, Any], folder: Path) -> Iterator[tuple[str, Path]]:
    """Every file or folder that a study's fields name, whether it exists or not, as (field, path)."""
    for field in ("ct", "segmentation"):
        yield field, folder / fields[field]
    for option in _OPTION_FILES:
        name = (fields.get("options") or {}).get(option)
        if name:
            yield f'options"."{option}', folder / name
    for number, xray in enumerate(fields["xrays"]):
        for field in _XRAY_FILES:
            if isinstance(xray.get(field), str):
                yield f'xrays"[{number}]."{field}', folder / xray[field]


def check_writable(path: Path, option: str) -> None:
    """Refuse a file that cannot be written, before the work; raises InputError, naming the option."""
    if path.is_dir():
        raise InputError(f"{path}: this is a folder: give a file for {option}.")
    parent = path.absolute().parent
    if not parent.is_dir():
        raise InputError(f"{path}: the folder {parent} does not exist: make it, or choose another {option}.")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(
            f"{path}: nothing can be written in {parent}: check its permissions or choose another {option}."
        )


def _check_replaceable(path: Path, option: str, named: Mapping[str, Path]) -> None:
    """Refuse to replace a file that the study names, or one that is no JSON: a slice of its CT, for example."""
    for field, file in named.items():
        if _is_same(path, file):
            raise InputError(f'{path}: the study reads this file as "{field}": choose another {option}.')
    if not path.exists():
        return
    refuse_special_file(path)
    with path.open("rb") as stream:
        start = stream.read(4096).removeprefix(b"\xef\xbb\xbf").lstrip()
    if start and not start.startswith(b"{"):
        raise InputError(f"{path}: this file is no JSON and is not replaced: choose another {option}.")


def _is_same(first: Path, second: Path) -> bool:
    """Whether two paths lead to one file, which need not exist; a path that cannot be followed leads to none."""
    try:
        return first.resolve() == second.resolve() or os.path.samefile(first, second)
    except (OSError, ValueError, RuntimeError):  # absent, a zero byte in the name, a circle of links
        return False
