"""A benchmark's rows as tables: Markdown, CSV and LaTeX, and every number in one long table."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from PolyPoseLib.errors import InputError, one_line
from PolyPoseLib.evaluation.benchmark.columns import Row
from PolyPoseLib.evaluation.benchmark.statistics import OURS, Table, tables_of
from PolyPoseLib.evaluation.benchmark.table_rows import table_rows
from PolyPoseLib.io.benchmark import words
from PolyPoseLib.io.benchmark.latex_table import latex
from PolyPoseLib.io.benchmark.markdown_table import markdown
from PolyPoseLib.io.cohort.tables import csv_cell
from PolyPoseLib.io.tracking.file_names import file_stems
from PolyPoseLib.io.whole_files import replaced_whole

LONG_TABLE = "scores.csv"

STATUSES = ("done", "failed", "skipped")

_TEXTS = ("dataset", "views", "subject", "case", "system", "status")
_LONG_COLUMNS = (*_TEXTS, "reason", "part", "view", "name", "measure", "value")
_COSTS = ("seconds", "cpu_seconds", "peak_memory_mib")


def write_tables(rows: Sequence[Row], folder: Path, ours: str = OURS) -> list[str]:
    """Write the tables of a benchmark.

    Parameters
    ----------
    rows : sequence of Row
        One per system and case, those that failed or were skipped included: they become lines with their reasons.
    folder : Path
        There; files of the same names are replaced.
    ours : str
        The system that is tested against its best rival.

    Returns
    -------
    list of str
        Names of the files: one .md, .csv and .tex per data set and set of views, and "scores.csv", which has every
        number of every row.

    Raises
    ------
    InputError
        There are no rows, or one lacks a field; the sentence says which.
    OSError
        The system refuses.

    """
    check_rows(rows)
    tables, groups = tables_of(rows, ours), table_rows(rows)
    names = []
    for table, stem in zip(tables, table_stems(tables), strict=True):
        own = groups[table.dataset, table.views]
        texts = {"md": markdown(table, own), "csv": _wide(table), "tex": latex(table, own, stem)}
        for ending, text in texts.items():
            names.append(f"{stem}.{ending}")
            _write(folder / names[-1], text)
    _write(folder / LONG_TABLE, _csv_text([_LONG_COLUMNS, *_long(rows)]))
    return [*names, LONG_TABLE]


def table_stems(tables: Sequence[Table]) -> tuple[str, ...]:
    """Names of the tables' files without their endings."""
    return file_stems([f"table-{table.dataset}-{table.views}" for table in tables])


def check_rows(rows: Sequence[Row]) -> None:
    """Refuse rows of which no table can be made; raises InputError."""
    if not rows:
        raise InputError("There are no rows: run the benchmark first.")
    for number, row in enumerate(rows, start=1):
        missing = next((name for name in _TEXTS if not isinstance(row.get(name), str)), None)
        if missing is not None:
            raise InputError(f'Row {number} of the benchmark has no text "{missing}": run its case again.')
        if row["status"] not in STATUSES:
            raise InputError(
                f"Row {number} of the benchmark has the status {row['status']!r}, which is none of "
                f"{', '.join(STATUSES)}: run its case again."
            )
        if row["status"] == "done" and not isinstance(row.get("scores"), Mapping):
            raise InputError(
                f'Row {number} of the benchmark is done but has no "scores": run its case again.'
            )


def _write(path: Path, text: str) -> None:
    with replaced_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace", newline="")


def _csv_text(lines: Sequence[Sequence[Any]]) -> str:
    stream = io.StringIO(newline="")
    csv.writer(stream, lineterminator="\n").writerows([[csv_cell(each) for each in line] for line in lines])
    return stream.getvalue()


def _wide(table: Table) -> str:
    """The table as its readers see it, with more digits and everything in a column of its own."""
    heads = [
        part
        for column in table.columns
        for part in (
            f"{column.title} mean",
            f"{column.title} sd",
            f"{column.title} n",
            f"{column.title} rank",
        )
    ]
    lines: list[list[Any]] = [["dataset", "views", "system", "cases_done", "cases", *heads, "remarks"]]
    for line in table.lines:
        values: list[Any] = []
        for column in table.columns:
            cell = line.cells.get(column.key)
            values += [None, None, 0] if cell is None else [cell.mean, cell.sd, len(cell.values)]
            values.append(_rank(table, column.key, line.system))
        remarks = "; ".join(filter(None, (words.training(line, table.subjects), words.remarks(line))))
        lines.append([table.dataset, table.views, line.system, line.done, line.cases, *values, remarks])
    return _csv_text(lines)


def _rank(table: Table, key: tuple[str, str, str], system: str) -> int | None:
    if system in table.best.get(key, ()):
        return 1
    return 2 if system in table.second.get(key, ()) else None


def _long(rows: Sequence[Row]) -> Iterator[list[Any]]:
    """One line per number; one without a number for a row that has none."""
    for row in rows:
        first = [one_line(row[name]) for name in _TEXTS]
        first.append(one_line(str(row.get("reason") or "")))
        numbers = [("cost", "", "", name, row[name]) for name in _COSTS if row.get(name) is not None]
        if row["status"] == "done":
            numbers += list(_numbers(row["scores"]))
        for number in numbers or [("", "", "", "", None)]:
            yield [*first, *(one_line(text) for text in number[:4]), _plain(number[4])]


def _numbers(scores: Mapping[str, Any]) -> Iterator[tuple[str, str, str, str, Any]]:
    """(part, view, name, measure, value) of every number in the scores."""
    for path, value in _leaves(scores, ()):
        above, measure = list(path[:-1]), path[-1]
        part = above.pop(0) if above else "whole"
        view = ""
        if part == "held_out" and above:
            part = f"held_out {above.pop(0)}"
            if part == "held_out views" and above:
                view = above.pop(0)
        yield part, view, " / ".join(above), measure, value


def _leaves(value: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    if isinstance(value, Mapping):
        for key, each in value.items():
            yield from _leaves(each, (*path, str(key)))
    elif path and (value is None or isinstance(value, int | float)):
        yield path, value


def _plain(value: Any) -> Any:
    """Booleans as 0 and 1: the column holds numbers."""
    return int(value) if isinstance(value, bool) else value
