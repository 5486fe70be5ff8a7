"""Cases read from their data, once to know them and again by every process that runs a system on one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from PolyPoseLib.benchmark.digests import digest_of
from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.job import CaseSource, KnownCase
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.readers import READERS


def cases_of(source: CaseSource) -> Iterator[BenchmarkCase]:
    """The cases of a source, one after another; raises InputError for damaged data."""
    yield from READERS[source.dataset].cases(Path(source.root), source.subject, [source.views])


def known_cases(source: CaseSource) -> tuple[KnownCase, ...]:
    """Read all cases of a source, and keep what tells them from others; raises InputError for damaged data."""
    found = [
        KnownCase(source, case.name, case.subject, case.views, digest_of(case)) for case in cases_of(source)
    ]
    if not found:
        raise InputError(f"{source.subject}: its data give no case: check the subject's files and --views.")
    return tuple(found)


def read_known(known: KnownCase) -> BenchmarkCase:
    """Read a case again; raises InputError when it is no longer what it was, or the data are damaged."""
    case = next((case for case in cases_of(known.source) if case.name == known.name), None)
    if case is None or digest_of(case) != known.digest:
        raise InputError(
            f"{known.name}: it is not the case that was read at first: its data have changed meanwhile; run the "
            "command again with --resume."
        )
    return case
