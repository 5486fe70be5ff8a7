"""What crosses to the processes of a benchmark and what is kept of its cases, as JSON."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PolyPoseLib.data.benchmark.job import DATASETS, CaseSource, KnownCase, RunJob, RunSettings
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Record,
    boolean,
    json_text,
    list_of,
    nonempty,
    one_of,
    parse_object,
    string,
    whole_number,
)
from PolyPoseLib.io.whole_files import replaced_whole

_VERSION = 2

_KEPT = ("name", "subject", "views", "digest", "stamp")
"""Fields of a case beside its source."""


def source_text(source: CaseSource) -> str:
    """A source on one line."""
    return json.dumps(dataclasses.asdict(source))


def parse_source_text(text: str) -> CaseSource:
    """What ``source_text`` wrote; raises InputError for anything else."""
    return parse_source(parse_object(text, "The source of a benchmark's cases"), "source")


def job_text(job: RunJob) -> str:
    """A job on one line."""
    return json.dumps(dataclasses.asdict(job))


def parse_job_text(text: str) -> RunJob:
    """What ``job_text`` wrote; raises InputError for anything else."""
    record = Record(parse_object(text, "A run of a benchmark"))
    return RunJob(
        case=record.required("case", parse_case),
        system=record.required("system", nonempty),
        path=record.required("path", nonempty),
        settings=record.required("settings", parse_settings),
        folder=record.required("folder", nonempty),
        digest=record.required("digest", nonempty),
        system_digest=record.required("system_digest", nonempty),
        weights_digest=record.required("weights_digest", string),
        weights=record.required("weights", string),
        keep_field=record.required("keep_field", boolean),
        draw=record.required("draw", boolean),
    )


def parse_source(value: Any, place: str) -> CaseSource:
    """Parser of a source."""
    record = Record.within(value, place)
    return CaseSource(
        record.required("dataset", one_of(DATASETS)),
        record.required("root", nonempty),
        record.required("subject", nonempty),
        record.required("views", nonempty),
    )


def parse_case(value: Any, place: str) -> KnownCase:
    """Parser of a case that was read once."""
    record = Record.within(value, place)
    texts = (record.required(name, nonempty) for name in _KEPT)
    return KnownCase(record.required("source", parse_source), *texts)


def parse_settings(value: Any, place: str) -> RunSettings:
    """Parser of the settings that all runs share."""
    record = Record.within(value, place)
    return RunSettings(
        record.required("threads", whole_number(1)),
        record.required("device", nonempty),
        record.required("seed", whole_number(0)),
    )


def write_cases(path: Path, stamp: str, cases: Sequence[KnownCase]) -> None:
    """Keep what the cases of a source are, without where it is; stamp: of the data from which they were read.

    Raises OSError where the system refuses.
    """
    kept = [{name: getattr(each, name) for name in _KEPT} for each in cases]
    fields = {"version": _VERSION, "stamp": stamp, "cases": kept}
    with replaced_whole(path) as temporary:
        temporary.write_text(json_text(fields), encoding="utf-8")


def read_cases(path: Path, stamp: str, source: CaseSource) -> tuple[KnownCase, ...] | None:
    """The cases of a source that were kept; None where there are none, or they are of other data or damaged."""

    def parse(value: Any, place: str) -> KnownCase:
        record = Record.within(value, place)
        return KnownCase(source, *(record.required(name, nonempty) for name in _KEPT))

    if not path.is_file():
        return None
    try:
        record = Record(parse_object(read_text(path, "a benchmark's cases"), path.name))
        if record.fields.get("version") != _VERSION or record.fields.get("stamp") != stamp:
            return None
        return tuple(record.required("cases", list_of(parse)))
    except InputError:
        return None
