"""Cases read from their data, once to know them and again by every process that runs a system on one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from PolyPoseLib.benchmark.digests import case_digest, content_digest
from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.job import CaseSource, KnownCase
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.benchmark_folder import files_stamp
from PolyPoseLib.io.benchmark.readers import READERS


def cases_of(source: CaseSource) -> Iterator[BenchmarkCase]:
    """The cases of a source, one after another; raises InputError for damaged data."""
    yield from READERS[source.dataset].cases(Path(source.root), source.subject, [source.views])


def known_cases(source: CaseSource) -> tuple[KnownCase, ...]:
    """Read all cases of a source, and keep what tells them from others; raises InputError for damaged data."""
    stamp = _files_told(source, files_stamp)  # before they are read, so that a change meanwhile is seen
    content = _files_told(source, content_digest)
    found = [
        KnownCase(
            source, case.name, case.subject, case.views, case_digest(case, content), _stamp(case, stamp)
        )
        for case in cases_of(source)
    ]
    if not found:
        raise InputError(f"{source.subject}: its data give no case: check the subject's files and --views.")
    return tuple(found)


def read_known(known: KnownCase) -> BenchmarkCase:
    """Read a case again; raises InputError when it is no longer what it was, or the data are damaged."""
    case = next((case for case in cases_of(known.source) if case.name == known.name), None)
    now = _files_told(known.source, files_stamp)
    if case is None or _stamp(case, now) != known.stamp:
        raise InputError(
            f"{known.name}: it is not the case that was read at first: its data, or the program that renders its "
            "X-rays, have changed meanwhile; run the command again with --resume."
        )
    return case


def _files_told(source: CaseSource, tell: Callable[[list[Path], Path], str]) -> str:
    """What is told of all files that the cases of a source are made of; raises InputError."""
    root = Path(source.root)
    try:
        return tell(READERS[source.dataset].files(root, source.subject), root)
    except OSError as error:
        raise InputError(
            f"{error.filename}: the file cannot be read ({error.strerror}): check its permissions."
        ) from error


def _stamp(case: BenchmarkCase, files: str) -> str:
    return f"{files} {case.projector}".rstrip()
