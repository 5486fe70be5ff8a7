"""The processes of a benchmark, from outside: started, ended in time, and what they leave taken over as rows."""

from __future__ import annotations

import hashlib
import sys
import tempfile
from pathlib import Path

from PolyPoseLib.benchmark.earlier_files import put_row
from PolyPoseLib.benchmark.hidden_names import HiddenNames
from PolyPoseLib.benchmark.measures import Measures
from PolyPoseLib.benchmark.rows import log_path, new_row_path, row_of, row_path
from PolyPoseLib.cohort.child import ChildEnd, run_child
from PolyPoseLib.cohort.child_words import child_environment, last_sentence, signal_name
from PolyPoseLib.data.benchmark.job import FAILED, CaseSource, KnownCase, RunJob
from PolyPoseLib.errors import InputError, cut, one_line
from PolyPoseLib.io.benchmark.benchmark_folder import CASES, LOGS
from PolyPoseLib.io.benchmark.jobs import job_text, read_cases, source_text
from PolyPoseLib.io.benchmark.row_files import Row, read_row, write_row


class InterruptedRun(Exception):
    """The benchmark was ended before this process had."""


def know_cases(source: CaseSource, folder: Path, stamp: str, run: str) -> tuple[KnownCase, ...]:
    """The cases of a source, read by a process of its own unless they are known from an earlier run.

    Parameters
    ----------
    source : CaseSource
        Of one subject.
    folder : Path
        Of the benchmark.
    stamp : str
        Of the data as they are now.
    run : str
        Name of the benchmark's run, by which its processes are ended.

    Raises
    ------
    InputError
        The data are damaged; one sentence.
    InterruptedRun
        The benchmark was ended meanwhile.

    """
    text = source_text(source)
    key = hashlib.sha256(text.encode()).hexdigest()[:16]
    path = folder / CASES / f"{key}.json"
    if (known := read_cases(path, stamp, source)) is not None:
        return known
    log = folder / LOGS / f"reading-{key}.log"
    end, said = _ended(["know_cases", text, str(path), stamp], source, log, run, (1, None))
    known = read_cases(path, stamp, source)
    if known is None or end.status != 0:
        raise InputError(said or f"{source.subject}: reading it {_how(end)}; see {LOGS}/{log.name}.")
    return known


def run_system(job: RunJob, run: str, limit_seconds: float | None) -> Row:
    """Run one system on one case in a process of its own.

    Parameters
    ----------
    job : RunJob
        What to run.
    run : str
        Name of the benchmark's run.
    limit_seconds : float or None
        It is ended after that.

    Returns
    -------
    dict
        Its row, which is in its place already, unless that holds scores and this run could not run.

    Raises
    ------
    InterruptedRun
        The benchmark was ended meanwhile; there is no row of this run.

    """
    new = new_row_path(job)
    new.unlink(missing_ok=True)
    share = job.settings.threads, limit_seconds
    end, said = _ended(["run_system", job_text(job)], job.case.source, log_path(job), run, share)
    row = read_row(new)
    if row is not None and row["digest"] == job.digest:
        put_row(job, row)  # also of a process that a library brought down at its very end
        return row
    if end.late:
        reason = f"It took longer than the limit of {limit_seconds:g} s and was ended."
    else:
        reason = said or f"It {_how(end)}; see {LOGS}/{log_path(job).name}."
    row = row_of(job, FAILED, reason, Measures(end.seconds, end.cpu_seconds, end.peak_memory_mib))
    put_row(job, row)
    return row


def unread_row(job: RunJob, reason: str) -> Row:
    """The row of a system whose case cannot be read; it is written, too."""
    row = row_of(job, FAILED, f"The case could not be read: {reason}", Measures())
    write_row(row_path(job), row)
    return row


def _ended(
    words: list[str], source: CaseSource, log: Path, run: str, share: tuple[int, float | None]
) -> tuple[ChildEnd, str]:
    """How a process of this package ended, and the last sentence that it said; raises InterruptedRun.

    words: of the command: its module and what it is given. source: whose names its log must not hold. share: threads,
    and seconds after which it is ended.
    """
    log.touch()
    began = log.stat().st_size
    command = [sys.executable, "-m", f"PolyPoseLib.benchmark.{words[0]}", *words[1:]]
    # Whatever a system leaves among temporary files goes with it, also when it is killed.
    with tempfile.TemporaryDirectory(prefix="polypose-benchmark-", ignore_cleanup_errors=True) as temporary:
        environment = child_environment(share[0]) | {"TMPDIR": temporary, "TEMP": temporary, "TMP": temporary}
        try:
            end = run_child(command, environment, log, run, share[1])
        finally:
            said = cut(one_line(last_sentence(log, began)), 1000)
            HiddenNames(source).in_file(log)
    if end is None or end.asked:
        raise InterruptedRun
    return end, said


def _how(end: ChildEnd) -> str:
    """The end of a process that said nothing."""
    if end.status >= 0:
        return f"ended with exit status {end.status} and left no scores"
    name = signal_name(-end.status)
    memory = (
        f", as a rule for lack of memory: it had {end.peak_memory_mib:.0f} MiB" if name == "SIGKILL" else ""
    )
    return f"was killed by the system ({name}{memory})"
