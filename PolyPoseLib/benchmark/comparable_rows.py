"""Rows of earlier calls that can stand in one table with those of this call."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from pathlib import Path

from PolyPoseLib.data.benchmark.job import DONE, SKIPPED
from PolyPoseLib.evaluation.benchmark.table_rows import view_set
from PolyPoseLib.io.benchmark.benchmark_folder import ROWS
from PolyPoseLib.io.benchmark.row_files import Row, read_row

_LOG = logging.getLogger(__name__)


def comparable_rows(rows: Sequence[Row], folder: Path) -> list[Row]:
    """The rows of a call, at least one, with those of earlier calls that can stand in one table with them.

    Left out, and logged, are rows of other settings or versions of PolyPose, of a case that has changed since, of a
    system with other code than its newest row has, and in one table also with other weights: a line of a table is one
    system on one set of data. A case that could not be read stays among them until it was read. Where a system could
    not run in this call, the scores that it has from an earlier one are taken.
    """
    known = _Known(rows)
    pairs = {_pair(row): row for row in rows}
    found: dict[Path, Row] = {}
    left_out = taken = 0
    for path in _newest_first((folder / ROWS).glob("*.json")):
        row = read_row(path)
        if row is None:
            continue
        ours = pairs.get(_pair(row))
        if ours is not None and (ours["status"] != SKIPPED or row["status"] != DONE):
            continue
        if not known.has_place_for(row):
            left_out += 1
        elif ours is not None:
            known.add(row)
            pairs[_pair(row)] = row
            taken += 1
        else:
            known.add(row)
            found[path] = row
    if left_out:
        _LOG.warning(
            "%d rows of earlier runs are left out of the tables: their data, settings, weights, code or version "
            "differ; name their systems in --methods to run them again.",
            left_out,
        )
    if taken:
        _LOG.warning(
            "%d runs that were skipped now have scores of an earlier call, which stand in the tables.", taken
        )
    return [*pairs.values(), *(found[path] for path in sorted(found))]


class _Known:
    """What the rows of the tables share."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._first = rows[0]
        self._cases = {row["case"]: row["case_digest"] for row in rows}
        self._systems: dict[str, str] = {}
        self._weights: dict[tuple[str, str, str], str] = {}
        for row in rows:
            if row["status"] != SKIPPED:  # what could not run says nothing of the system in the table
                self.add(row)

    def has_place_for(self, row: Row) -> bool:
        """Whether a row differs from them in nothing that they share."""
        return (
            all(row[name] == self._first[name] for name in ("settings", "polypose"))
            and self._cases.get(row["case"], row["case_digest"]) == row["case_digest"]
            and self._systems.get(row["system"], row["system_digest"]) == row["system_digest"]
            and self._weights.get(_line(row), row["weights_digest"]) == row["weights_digest"]
        )

    def add(self, row: Row) -> None:
        """Take a row among them."""
        self._cases[row["case"]] = row["case_digest"]
        self._systems[row["system"]] = row["system_digest"]
        self._weights[_line(row)] = row["weights_digest"]


def _pair(row: Row) -> tuple[str, str]:
    return row["case"], row["system"]


def _line(row: Row) -> tuple[str, str, str]:
    """A system in a table."""
    return row["system"], row["dataset"], view_set(row)


def _newest_first(paths: Iterable[Path]) -> list[Path]:
    """Files by the time when they were written; of those of one time, by name."""
    return sorted(sorted(paths), key=lambda path: path.stat().st_mtime_ns, reverse=True)
