"""Rows of a benchmark, one JSON file each, written whole as soon as its run has ended."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PolyPoseLib.data.benchmark.job import DATASETS, STATUSES, TRAINED_ON
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.jobs import parse_settings
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Record,
    json_text,
    list_of,
    nonempty,
    object_of,
    one_of,
    parse_object,
    real,
    string,
)
from PolyPoseLib.io.whole_files import replaced_whole

VERSION = 2
"""Another one wherever a row of before would say something else than one of today: such rows are run again."""

Row = dict[str, Any]


def write_row(path: Path, row: Mapping[str, Any]) -> None:
    """Write a row; raises OSError where the system refuses."""
    with replaced_whole(path) as temporary:
        temporary.write_text(json_text({"version": VERSION, **row}), encoding="utf-8")


def read_row(path: Path) -> Row | None:
    """A row; None where there is none, or it is damaged or of another version."""
    if not path.is_file():
        return None
    try:
        row = parse_object(read_text(path, "a benchmark's row"), path.name)
        return _checked(row) if row.get("version") == VERSION else None
    except InputError:
        return None


def _checked(row: Row) -> Row:
    """The row when its fields are what tables are made of; raises InputError."""
    record = Record(row)
    for name in ("case", "dataset", "subject", "views", "system", "polypose"):
        record.required(name, nonempty)
    for name in ("digest", "case_digest", "system_digest"):
        record.required(name, nonempty)
    record.required("weights_digest", string)
    record.required("dataset", one_of(DATASETS))
    record.required("status", one_of(STATUSES))
    record.required("reason", string)
    record.required("settings", parse_settings)
    record.required("notes", list_of(string))
    record.optional("trained_on", one_of(TRAINED_ON))
    record.required("scores", object_of(lambda value, place: value))
    for name in ("seconds", "cpu_seconds", "peak_memory_mib"):
        record.optional(name, real)
    return row
