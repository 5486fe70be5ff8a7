"""One run of a benchmark: every system on every case, as far as there are no rows of it."""

from __future__ import annotations

import contextlib
import dataclasses
import logging
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PolyPoseLib import __version__
from PolyPoseLib.benchmark.digests import file_digest, run_digest, system_digest
from PolyPoseLib.benchmark.earlier_files import finished_row, forget_unread
from PolyPoseLib.benchmark.processes import InterruptedRun, know_cases, run_system, unread_row
from PolyPoseLib.benchmark.rows import unread_name
from PolyPoseLib.benchmark.systems import NamedSystem
from PolyPoseLib.benchmark.weights_given import PER_SUBJECT, given_weights
from PolyPoseLib.cohort.child import end_children
from PolyPoseLib.data.benchmark.job import CT, DONE, TRUTH, UNREAD, CaseSource, KnownCase, RunJob, RunSettings
from PolyPoseLib.data.benchmark.progress import RUNNING, BenchmarkProgress
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.benchmark_folder import data_stamp
from PolyPoseLib.io.benchmark.readers import READERS
from PolyPoseLib.io.benchmark.row_files import Row
from PolyPoseLib.simulation.independent_projector import projector_name

_LOG = logging.getLogger(__name__)

STAGE = "runs"
"""Of progress."""

_PAUSE_SECONDS = 1.0
"""Windows interrupts no thread that waits for ever."""


@dataclass(frozen=True)
class Benchmark:
    """What is compared, on what, and how.

    Attributes
    ----------
    sources : tuple of CaseSource
        One for each subject and set of views.
    systems : tuple of NamedSystem
        In the order of the tables.
    folder : Path
        Of the benchmark, held by this process (``opened_benchmark``).
    settings : RunSettings
        The same for all runs.
    weights : {str: Path}
        {system: file of its trained weights}, of "system@views" or "system@subject" for these alone.
    jobs : int
        Runs at the same time.
    limit_seconds : float or None
        A run that takes longer is ended.
    keep_fields, draw : bool
        Whether the fields that were found are kept, and pictures drawn, too.

    """

    sources: tuple[CaseSource, ...]
    systems: tuple[NamedSystem, ...]
    folder: Path
    settings: RunSettings
    weights: Mapping[str, Path] = dataclasses.field(default_factory=dict)
    jobs: int = 1
    limit_seconds: float | None = None
    keep_fields: bool = False
    draw: bool = False


def run_benchmark(benchmark: Benchmark, progress: Callable[[BenchmarkProgress], None]) -> list[Row]:
    """Run all systems on all cases that have no scores yet.

    A system that fails, crashes, takes too long, or cannot run here, has a row that says so, and the others go on.

    Parameters
    ----------
    benchmark : Benchmark
        What to do.
    progress : callable
        Called whenever a run has begun or ended.

    Returns
    -------
    list of dict
        The rows of this call, in the order of its cases and systems, each in a file already.

    Raises
    ------
    InputError
        A user's own system or a file of weights cannot be read.
    KeyboardInterrupt
        After the processes were ended; rows that were finished stay.

    """
    plan = _Plan(benchmark, progress)
    with ThreadPoolExecutor(benchmark.jobs) as pool:
        try:
            _work_off(plan, pool, benchmark.jobs)
        except BaseException as error:
            end_children(plan.run)
            if isinstance(error, KeyboardInterrupt):
                raise KeyboardInterrupt(
                    f"{plan.finished} of {plan.total} runs have ended: run the same command with --resume to go on"
                ) from error
            raise
    return plan.ordered_rows()


def _work_off(plan: _Plan, pool: ThreadPoolExecutor, at_once: int) -> None:
    """Read cases and run systems on those that are known, before further cases are read."""
    waiting: deque[Callable[[], _Tasks]] = deque(
        partial(plan.read, number) for number in range(len(plan.benchmark.sources))
    )
    running: set[Future[_Tasks]] = set()
    while waiting or running:
        while waiting and len(running) < at_once:
            running.add(pool.submit(waiting.popleft()))
        ended, running = wait(running, _PAUSE_SECONDS, FIRST_COMPLETED)
        for each in ended:
            waiting.extendleft(reversed(each.result()))


class _Plan:
    """What is to do and what came of it. Its tasks run in threads, and give the tasks that follow from them."""

    def __init__(self, benchmark: Benchmark, progress: Callable[[BenchmarkProgress], None]) -> None:
        self.benchmark = benchmark
        self.run = secrets.token_hex(8)
        self._progress = progress
        self._began = time.monotonic()
        self._stamp = " ".join((__version__, projector_name(), data_stamp(Path(benchmark.sources[0].root))))
        self._code = {each.name: each.code for each in benchmark.systems}
        self._weights = {path: file_digest(path) for path in benchmark.weights.values()}
        self._cases = [1] * len(benchmark.sources)
        self._rows: dict[tuple[int, int, int], Row] = {}
        self._sources: dict[str, CaseSource] = {}
        self._warned: set[tuple[str, str]] = set()
        self._trained: set[tuple[str, str]] = set()
        self._lock = threading.Lock()

    @property
    def total(self) -> int:
        """Runs as far as the cases are known; a set of views that was not read yet counts as one case."""
        return sum(self._cases) * len(self.benchmark.systems)

    @property
    def finished(self) -> int:
        """Runs that have a row."""
        return len(self._rows)

    def ordered_rows(self) -> list[Row]:
        """By subject, case and system."""
        return [self._rows[key] for key in sorted(self._rows)]

    def read(self, number: int) -> _Tasks:
        """Read the cases of a source; gives the runs on them."""
        source = self.benchmark.sources[number]
        numbers = range(len(self.benchmark.systems))
        try:
            cases = know_cases(source, self.benchmark.folder, self._stamp, self.run)
            self._require_new(cases, source)
            forget_unread(source, self.benchmark.folder)
        except InterruptedRun:
            return []
        except InputError as error:
            name = unread_name(source)
            subject, views = READERS[source.dataset].row_names(source.subject, source.views)
            unread = KnownCase(source, name, subject, views, UNREAD, UNREAD)
            for system in numbers:
                row = unread_row(self._job(unread, system), str(error))
                self._end((number, 0, system), row)
            return []
        self._cases[number] = len(cases)
        return [
            partial(self.attempt, (number, place, system), case)
            for place, case in enumerate(cases)
            for system in numbers
        ]

    def _require_new(self, cases: tuple[KnownCase, ...], source: CaseSource) -> None:
        """Raise InputError where another set of views gave a case of the same name, whose rows these would replace."""
        for case in cases:
            with self._lock:
                first = self._sources.setdefault(case.name, source)
            if first != source:
                raise InputError(
                    f'its case of the views "{source.views}" has the name of that of "{first.views}", {case.name}: '
                    "run one of the two into another --output."
                )

    def attempt(self, key: tuple[int, int, int], case: KnownCase) -> _Tasks:
        """Run a system on a case, unless its row is there."""
        job = self._job(case, key[2])
        if (earlier := finished_row(job)) is not None:
            self._end(key, earlier, reused=True)
            return []
        self._tell({"case": job.case.name, "system": job.system, "status": RUNNING})
        with contextlib.suppress(InterruptedRun):
            self._end(key, run_system(job, self.run, self.benchmark.limit_seconds))
        return []

    def _job(self, case: KnownCase, number: int) -> RunJob:
        system, settings = self.benchmark.systems[number], self.benchmark.settings
        given = given_weights(self.benchmark.weights, system.name, case.source)
        weights = "" if given is None else self._weights[given.path]
        code = self._code[system.name]
        more = {"keep_field": self.benchmark.keep_fields, "draw": self.benchmark.draw}
        return RunJob(
            case,
            system.name,
            system.path,
            settings,
            folder=str(self.benchmark.folder),
            digest=run_digest(case.digest, code, settings, weights),
            system_digest=system_digest(code),
            weights_digest=weights if given is None or not given.of_subject else PER_SUBJECT,
            weights="" if given is None else str(given.path),
            **more,
        )

    def _end(self, key: tuple[int, int, int], row: Row, reused: bool = False) -> None:
        """A run has ended."""
        if row["status"] != DONE:
            self._warn(row)
        elif row.get("trained_on") in (CT, TRUTH):
            self._warn_of_training(row)
        with self._lock:
            self._rows[key] = row
        self._tell({name: row[name] for name in ("case", "system", "status")}, reused)

    def _warn(self, row: Row) -> None:
        """Say why a run has no scores; of data that cannot be read once for all systems and views."""
        what = f"{row['system']} on {row['case']}: {row['status']}"
        if row["case_digest"] == UNREAD:
            what = row["subject"]
            with self._lock:
                if (what, row["reason"]) in self._warned:
                    return
                self._warned.add((what, row["reason"]))
        _LOG.warning("%s: %s", what, row["reason"])

    def _warn_of_training(self, row: Row) -> None:
        """Say once of a system and a subject that the scores are of a patient that it knows."""
        known = row["system"], row["subject"]
        with self._lock:
            if known in self._trained:
                return
            self._trained.add(known)
        _LOG.warning(
            "%s was trained on %s of %s: its scores there say nothing of other patients, and its table marks them.",
            row["system"],
            "the true posture" if row["trained_on"] == TRUTH else "the CT",
            row["subject"],
        )

    def _tell(self, what: dict[str, str], reused: bool = False) -> None:
        with self._lock:
            seconds = time.monotonic() - self._began
            self._progress(
                BenchmarkProgress(STAGE, self.finished, self.total, None, seconds, **what, reused=reused)
            )


_Tasks = list[Callable[[], "_Tasks"]]
