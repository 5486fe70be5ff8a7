"""What a worker does with one study: know it again, or register it in a process of its own and keep its outcome."""

from __future__ import annotations

import dataclasses
import functools
import os
import platform
import signal
import sys
import tempfile
from pathlib import Path

from PolyPoseLib import __version__
from PolyPoseLib.cohort.child import ChildEnd, run_child
from PolyPoseLib.cohort.child_words import child_environment, last_sentence, signal_name
from PolyPoseLib.data.cohort.job import StudyJob
from PolyPoseLib.data.cohort.outcome import DONE, INTERRUPTED, UNTRUSTED, WRONG_INPUT, Outcome
from PolyPoseLib.errors import LESS_MEMORY, cut, one_line
from PolyPoseLib.io.cohort.cohort_folder import LOGS
from PolyPoseLib.io.cohort.fingerprint import fingerprint
from PolyPoseLib.io.cohort.outcome_files import read_outcome, write_outcome
from PolyPoseLib.io.locks import locked

_WAIT_SECONDS = 30.0
"""For an attempt whose worker was killed to end."""

_MACHINE = (LESS_MEMORY, "the disk is full", "memory ran out")
"""Parts of the sentences about wrong input by which the machine is at fault."""


def run_study(job: StudyJob, run: str) -> Outcome:
    """Register one study, unless nothing of it has changed since it was.

    Parameters
    ----------
    job : StudyJob
        The study; its folders are seen by this machine.
    run : str
        Name of the cohort's run.

    Returns
    -------
    Outcome
        What became of it, kept in the cohort's folder already; without the stamps of its files, which are many.

    """
    folder = Path(job.folder)
    earlier = read_outcome(folder, job.identity)
    known = {} if earlier is None or job.settings.rehash else earlier.stamps
    digest, stamps = fingerprint(Path(job.study), job.settings.options, job.settings.allow_outside, known)
    if earlier is not None and earlier.settles(digest, job.settings.retry_failed) and _is_there(job, earlier):
        return dataclasses.replace(earlier, reused=True, stamps={})
    log = folder / LOGS / f"{job.identity}.log"
    attempt = 1 + _attempts(log, digest)
    with log.open("a", encoding="utf-8") as stream:
        stream.write(f"{_mark(digest)} attempt {attempt} on {platform.node()}, PolyPose {__version__}\n")
    began = log.stat().st_size
    (folder / job.place).parent.mkdir(parents=True, exist_ok=True)
    with locked((folder / job.place).resolve(), job.identity, _WAIT_SECONDS):
        pass
    end = run_child(command_of(job), environment_of(job), log, run, job.settings.limit_seconds)
    if end is None or end.asked:
        return Outcome(job.identity, INTERRUPTED, "It was interrupted.", attempts=attempt)
    outcome = dataclasses.replace(
        _outcome(job, end, last_sentence(log, began)),
        digest=digest,
        stamps=stamps,
        attempts=attempt,
        worker=platform.node(),
        expected_memory_mib=float(job.memory_mib),
    )
    write_outcome(folder, outcome)
    return dataclasses.replace(outcome, stamps={})


def command_of(job: StudyJob) -> list[str]:
    """The command that registers a study."""
    settings = job.settings
    program = settings.program or (sys.executable, "-m", "PolyPoseLib.cohort.guarded")
    command = [*program, "register", job.study, "--output", str(Path(job.folder, job.place)), "--overwrite"]
    command += ["--progress", "none", "--threads", str(settings.threads)]
    for name, value in settings.options.items():
        command += [f"--{name}", str(value)]
    return command + (["--allow-outside"] if settings.allow_outside else [])


def environment_of(job: StudyJob) -> dict[str, str]:
    """The variables of that process: its threads, its compiled loops, and where this package is."""
    environment = child_environment(job.settings.threads)
    if job.settings.cache == "worker":
        environment["NUMBA_CACHE_DIR"] = worker_cache()
    return environment


@functools.cache
def worker_cache() -> str:
    """A folder of compiled loops for this worker, on a disk of its machine, readable by this user alone.

    Shared file systems are slow with many small files, and loops that were compiled for another processor are wrong.
    It goes with the worker.
    """
    global _cache_folder
    _cache_folder = tempfile.TemporaryDirectory(prefix="polypose-numba-", ignore_cleanup_errors=True)
    return _cache_folder.name


_cache_folder: tempfile.TemporaryDirectory | None = None


def _is_there(job: StudyJob, outcome: Outcome) -> bool:
    """Whether the result that an earlier run left is in its place."""
    if not outcome.has_result:
        return True
    return outcome.place == job.place and Path(job.folder, job.place, "result.json").is_file()


def _outcome(job: StudyJob, end: ChildEnd, said: str) -> Outcome:
    """What a process's end means."""
    status, reason, transient = end.status, said, False
    if end.late:
        reason = f"It took longer than the limit of {job.settings.limit_seconds:.0f} s and was ended."
    elif status < 0:
        transient = True
        reason = f"The system killed it ({signal_name(-status)}){_perhaps_memory(job, end)}."
    elif status not in (DONE, UNTRUSTED):
        transient = status != WRONG_INPUT or any(part in said for part in _MACHINE)
        reason = said or f"It ended with exit status {status} and said nothing."
    return Outcome(
        job.identity,
        status if not end.late or status < 0 else -int(signal.SIGTERM),
        "" if status == DONE else _without_folder(reason, job),
        place=job.place if status in (DONE, UNTRUSTED) else "",
        seconds=end.seconds,
        cpu_seconds=end.cpu_seconds,
        peak_memory_mib=end.peak_memory_mib,
        transient=transient,
    )


def _perhaps_memory(job: StudyJob, end: ChildEnd) -> str:
    """What a kill that nothing explains is as a rule."""
    if end.status != -getattr(signal, "SIGKILL", 9):
        return ""
    return f", as a rule for lack of memory: it had {end.peak_memory_mib:.0f} MiB, {job.memory_mib} were set aside"


def _without_folder(text: str, job: StudyJob) -> str:
    """A sentence without the paths of the study's folder and the cohort's, which are long and the same everywhere."""
    for folder in (str(Path(job.study).parent), job.folder):
        text = text.replace(f"{folder}{os.sep}", "")
    return cut(one_line(text), 1000)


def _mark(digest: str) -> str:
    """Begins the line of a log that begins an attempt."""
    return f"--- {digest[:16]}"


def _attempts(log: Path, digest: str) -> int:
    """Attempts that a log tells of for a content."""
    try:
        with log.open(encoding="utf-8", errors="replace") as stream:
            return sum(line.startswith(_mark(digest)) for line in stream)
    except FileNotFoundError:
        return 0
