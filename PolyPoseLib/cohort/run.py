"""One run of a cohort, from its entries to its summary."""

from __future__ import annotations

import dataclasses
import logging
import secrets
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from PolyPoseLib.cohort.clusters import machines
from PolyPoseLib.cohort.dispatch import Dispatcher
from PolyPoseLib.cohort.needs import memory_needs
from PolyPoseLib.data.cohort.entries import CohortEntry
from PolyPoseLib.data.cohort.job import StudyJob
from PolyPoseLib.data.cohort.outcome import Outcome
from PolyPoseLib.data.cohort.progress import CohortProgress
from PolyPoseLib.data.cohort.settings import ClusterSettings, StudySettings
from PolyPoseLib.io.cohort.outcome_files import read_outcome
from PolyPoseLib.io.cohort.report import write_summary
from PolyPoseLib.io.cohort.rows import StudySummary

_LOG = logging.getLogger(__name__)

STAGE = "studies"
"""Of progress."""


@dataclass(frozen=True)
class Cohort:
    """What is registered, how, and where.

    Parameters
    ----------
    entries : tuple of CohortEntry
        The studies.
    folder : Path
        Of the cohort, held by this process (``opened_cohort``).
    study : StudySettings
        How each is registered.
    cluster : ClusterSettings
        On which machines.

    """

    entries: tuple[CohortEntry, ...]
    folder: Path
    study: StudySettings
    cluster: ClusterSettings


def run_cohort(cohort: Cohort, progress: Callable[[CohortProgress], None]) -> list[StudySummary]:
    """Register all studies of a cohort that have not been, and write its summary.

    Parameters
    ----------
    cohort : Cohort
        What to do.
    progress : callable
        Called whenever a study has ended.

    Returns
    -------
    list of StudySummary
        Of all studies, the worst first.

    Raises
    ------
    InputError
        The machines cannot be had.
    KeyboardInterrupt
        After the processes were ended and the summary of what is finished was written.

    """
    needs = memory_needs(cohort.entries, cohort.study)
    jobs = [
        StudyJob(entry.identity, str(entry.study), str(cohort.folder), str(entry.place), need, cohort.study)
        for entry, need in zip(cohort.entries, needs, strict=True)
    ]
    outcomes: dict[str, Outcome] = {}
    try:
        with machines(cohort.cluster, cohort.folder) as at:
            _LOG.info("Dashboard of the workers: %s", at.dashboard or "none")
            dispatcher = Dispatcher(at, secrets.token_hex(8), cohort.cluster.retries)
            try:
                tell = _Teller(len(jobs), progress)
                for outcome in dispatcher.outcomes(jobs):
                    outcomes[outcome.identity] = outcome
                    tell(outcome)
            except BaseException:
                dispatcher.end()
                raise
    except KeyboardInterrupt as interrupt:
        found = [_known(cohort, entry, outcomes) for entry in cohort.entries]
        write_summary(cohort.folder, found)
        kept = sum(each.has_result for each in found)
        raise KeyboardInterrupt(
            f"{kept} of {len(found)} studies have a result: run the same command again to go on"
        ) from interrupt
    return write_summary(cohort.folder, [outcomes[entry.identity] for entry in cohort.entries])


def _known(cohort: Cohort, entry: CohortEntry, outcomes: dict[str, Outcome]) -> Outcome:
    """What is known of a study when a run is interrupted: from this run, or kept from an earlier one."""
    if entry.identity in outcomes:
        return outcomes[entry.identity]
    kept = read_outcome(cohort.folder, entry.identity) or Outcome(entry.identity)
    return dataclasses.replace(kept, stamps={})


class _Teller:
    """Reports how far the run is."""

    def __init__(self, total: int, progress: Callable[[CohortProgress], None]) -> None:
        self._total = total
        self._progress = progress
        self._began = time.monotonic()
        self._verdicts: list[str] = []

    def __call__(self, outcome: Outcome) -> None:
        """One study has ended."""
        self._verdicts.append(outcome.verdict)
        if outcome.verdict not in ("done", "untrusted"):
            _LOG.warning("%s: %s: %s", outcome.identity, outcome.verdict, outcome.reason)
        self._progress(
            CohortProgress(
                STAGE,
                len(self._verdicts),
                self._total,
                None,
                time.monotonic() - self._began,
                study=outcome.identity,
                verdict=outcome.verdict,
                exit_status=outcome.exit_status,
                reused=outcome.reused,
                untrusted=self._verdicts.count("untrusted"),
                failed=sum(each not in ("done", "untrusted") for each in self._verdicts),
            )
        )


def verdict_counts(summaries: Sequence[StudySummary]) -> dict[str, int]:
    """How many studies have which verdict."""
    verdicts = [each.outcome.verdict for each in summaries]
    return {each: verdicts.count(each) for each in dict.fromkeys(verdicts)}
