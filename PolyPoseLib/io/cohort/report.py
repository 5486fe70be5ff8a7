"""The summary of a cohort: its tables and its page, from what became of each study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PolyPoseLib.data.cohort.outcome import Outcome
from PolyPoseLib.io.cohort.index_page import write_index
from PolyPoseLib.io.cohort.rows import StudySummary, rows_of, summary_of
from PolyPoseLib.io.cohort.tables import write_tables


def write_summary(folder: Path, outcomes: Sequence[Outcome]) -> list[StudySummary]:
    """Write summary.csv, summary.parquet and index.html into the cohort's folder.

    Returns what they hold, the worst first. Raises OSError where the system refuses.
    """
    summaries = [summary_of(folder, each) for each in outcomes]
    write_tables(folder, list(rows_of(summaries)))
    write_index(folder, summaries)
    return sorted(summaries, key=lambda each: each.rank)
