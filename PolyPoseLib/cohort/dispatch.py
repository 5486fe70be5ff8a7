"""Studies handed to workers, and their outcomes collected: again elsewhere where a machine was at fault."""

from __future__ import annotations

import errno
import logging
import math
import queue
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from PolyPoseLib.cohort.child import end_children
from PolyPoseLib.cohort.clusters import Machines, workers_of
from PolyPoseLib.cohort.study_task import run_study
from PolyPoseLib.data.cohort.job import StudyJob
from PolyPoseLib.data.cohort.outcome import INTERRUPTED, WRONG_INPUT, Outcome, lost
from PolyPoseLib.data.cohort.settings import MEMORY, THREADS
from PolyPoseLib.errors import InputError, cut, one_line

if TYPE_CHECKING:
    from distributed import Future

_LOG = logging.getLogger(__name__)

MORE_MEMORY = 1.5
"""Times the memory of before is set aside for a study that the system has killed."""

_KILLED = -9
"""Exit status of a process that was killed, as a rule for lack of memory."""

_DISK_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))

_TICK_SECONDS = 1.0


@dataclass
class _Task:
    """A study on its way."""

    job: StudyJob
    attempts: int = 0
    submissions: int = 0
    avoided: set[str] = field(default_factory=set)
    pinned: frozenset[str] = frozenset()
    future: Future | None = None


class Dispatcher:
    """The studies of one run.

    Parameters
    ----------
    at : Machines
        The workers.
    run : str
        Name of the run.
    retries : int
        Further attempts of a study.

    """

    def __init__(self, at: Machines, run: str, retries: int) -> None:
        self._at = at
        self._run = run
        self._retries = retries
        self._ended: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._tasks: dict[str, _Task] = {}

    def outcomes(self, jobs: Sequence[StudyJob]) -> Iterator[Outcome]:
        """The outcome of every study as it becomes known; the largest studies begin first, lest one be late."""
        for job in jobs:
            refusal = self._refusal(job)
            if refusal is not None:
                yield refusal
                continue
            self._tasks[job.identity] = _Task(job)
            self._submit(self._tasks[job.identity])
        while self._tasks:
            try:
                identity, future = self._ended.get(timeout=_TICK_SECONDS)
            except queue.Empty:
                self._release_stranded()
                continue
            task = self._tasks.get(identity)
            if task is None or task.future is not future:
                continue
            outcome = self._outcome_of(task)
            if outcome.transient and task.attempts <= self._retries:
                self._try_elsewhere(task, outcome)
                continue
            del self._tasks[identity]
            yield outcome

    def end(self) -> None:
        """End what runs, on all workers, and forget what has not begun."""
        futures = [task.future for task in self._tasks.values() if task.future is not None]
        self._tasks.clear()
        try:
            self._at.client.cancel(futures, force=True)
            ended = self._at.client.run(end_children, self._run, on_error="ignore")
            _LOG.debug("processes ended: %s", ended)
        except Exception as error:  # a scheduler that is gone: its workers end their processes themselves
            _LOG.debug("the workers could not be told to end: %s", error)

    def _submit(self, task: _Task) -> None:
        job = task.job
        task.attempts += 1
        task.submissions += 1
        resources = None
        if self._at.resources is not None:
            resources = {THREADS: job.settings.threads, MEMORY: job.memory_mib}
        task.pinned = self._others(task)
        task.future = self._at.client.submit(
            run_study,
            job,
            self._run,
            # Never a key of before: to cancel that one would cancel this one as well.
            key=f"study-{job.identity}-{self._run}-{task.submissions}",
            pure=False,
            resources=resources,
            priority=job.memory_mib,
            workers=list(task.pinned) or None,
        )
        task.future.add_done_callback(_teller(self._ended.put, job.identity))

    def _others(self, task: _Task) -> frozenset[str]:
        """Workers on which a study has not failed yet, where it has failed on some and the others would do."""
        if not task.avoided:
            return frozenset()
        workers = workers_of(self._at.client)
        return frozenset(
            address
            for address, each in workers.items()
            if address not in task.avoided and self._offers(each.get("resources") or {}, task.job)
        )

    def _offers(self, resources: dict[str, float], job: StudyJob) -> bool:
        if self._at.resources is None:
            return True
        enough = resources.get(MEMORY, 0) >= job.memory_mib
        return enough and resources.get(THREADS, 0) >= job.settings.threads

    def _release_stranded(self) -> None:
        """Give studies that wait for workers that are gone to any worker."""
        pinned = [task for task in self._tasks.values() if task.pinned]
        if not pinned:
            return
        there = set(workers_of(self._at.client))
        for task in pinned:
            if not task.pinned & there and task.future is not None:
                task.future.cancel(force=True)
                task.avoided.clear()
                task.attempts -= 1
                self._submit(task)

    def _try_elsewhere(self, task: _Task, outcome: Outcome) -> None:
        """Submit a study again."""
        _LOG.warning("%s: %s It is tried again.", task.job.identity, outcome.reason)
        if outcome.exit_status == _KILLED and self._at.resources is not None:
            more = min(math.ceil(MORE_MEMORY * task.job.memory_mib), int(self._at.resources[MEMORY]))
            task.job = replace(task.job, memory_mib=more)
        if task.future is not None:
            task.avoided |= set(self._places(task.future))
        self._submit(task)

    def _places(self, future: Future) -> tuple[str, ...]:
        """Addresses of the workers that hold a future's outcome: where it ran."""
        try:
            found: Any = self._at.client.who_has([future])
            return tuple(next(iter(found.values()), ()))
        except Exception:
            return ()

    def _outcome_of(self, task: _Task) -> Outcome:
        """What a future that has ended tells."""
        assert task.future is not None
        identity = task.job.identity
        if task.future.status == "cancelled":
            return lost(identity, "It was interrupted.", INTERRUPTED)
        error = task.future.exception()
        if error is None:
            return task.future.result()
        if isinstance(error, InputError):
            return lost(identity, str(error))
        if type(error).__name__ == "KilledWorker":
            return lost(
                identity,
                "The worker ended while it registered, as a rule for lack of memory or at the end of its job's time.",
            )
        if isinstance(error, OSError) and error.errno in _DISK_FULL:
            return lost(identity, "The disk is full: free some space, and run the same command again.")
        return lost(
            identity, f"The worker failed ({type(error).__name__}: {cut(one_line(str(error)), 300)})."
        )

    def _refusal(self, job: StudyJob) -> Outcome | None:
        """The outcome of a study that no worker could ever take, which would otherwise wait for ever."""
        largest = self._at.resources
        if largest is None:
            return None
        if job.settings.threads > largest[THREADS]:
            return lost(
                job.identity,
                f"It takes {job.settings.threads} threads, a worker has {largest[THREADS]:.0f}: lower --threads.",
                WRONG_INPUT,
            )
        if job.memory_mib > largest[MEMORY]:
            return lost(
                job.identity,
                f"It takes about {job.memory_mib} MiB of memory, a worker has {largest[MEMORY]:.0f}: give fewer "
                "--workers or more --memory.",
                WRONG_INPUT,
            )
        return None


def _teller(tell: Callable[[tuple[str, Any]], None], identity: str) -> Callable[[Any], None]:
    """What a future calls at its end."""
    return lambda future: tell((identity, future))
