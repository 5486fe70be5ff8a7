"""What became of each study, one JSON file a study, written whole as soon as it is known."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from PolyPoseLib.data.cohort.outcome import FileStamp, Outcome
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Record,
    boolean,
    json_text,
    nonempty,
    object_of,
    parse_object,
    real,
    string,
    whole_number,
)
from PolyPoseLib.io.whole_files import replaced_whole

VERSION = 1

OUTCOMES = "outcomes"
"""Folder within the cohort's."""

_LEAST_STATUS = -256
_NUMBERS = ("seconds", "cpu_seconds", "peak_memory_mib", "expected_memory_mib")


def outcome_path(folder: Path, identity: str) -> Path:
    """Where the outcome of a study is kept in the cohort's folder."""
    return folder / OUTCOMES / f"{identity}.json"


def write_outcome(folder: Path, outcome: Outcome) -> None:
    """Keep what became of a study; raises OSError where the system refuses."""
    fields = {"version": VERSION, **dataclasses.asdict(outcome)}
    del fields["reused"]
    with replaced_whole(outcome_path(folder, outcome.identity)) as path:
        path.write_text(json_text(fields), encoding="utf-8")


def read_outcome(folder: Path, identity: str) -> Outcome | None:
    """What became of a study in an earlier run; None where nothing is kept, or it is damaged or of another version."""
    path = outcome_path(folder, identity)
    if not path.is_file():
        return None
    try:
        record = Record(parse_object(read_text(path, "an outcome"), path.name))
        if record.fields.get("version") != VERSION:
            return None
        return _parsed(record, identity)
    except InputError:
        return None


def _parsed(record: Record, identity: str) -> Outcome:
    """The outcome in a file; raises InputError where a field is wrong."""
    if record.required("identity", nonempty) != identity:
        raise InputError('"identity" is of another study.')
    numbers: dict[str, Any] = {
        name: math.nan if (value := record.optional(name, real)) is None else value for name in _NUMBERS
    }
    return Outcome(
        identity,
        exit_status=record.optional("exit_status", whole_number(_LEAST_STATUS)),
        reason=record.required("reason", string),
        digest=record.required("digest", string),
        place=record.required("place", string),
        attempts=record.required("attempts", whole_number(0)),
        worker=record.required("worker", string),
        transient=record.required("transient", boolean),
        stamps=record.required("stamps", object_of(_stamp)),
        **numbers,
    )


def _stamp(value: Any, place: str) -> FileStamp:
    record = Record.within(value, place)
    return FileStamp(
        record.required("size", whole_number(0)),
        record.required("changed_ns", whole_number(0)),
        record.required("sha256", nonempty),
    )
