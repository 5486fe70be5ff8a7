"""The table of a cohort as summary.csv, for spreadsheets, and as summary.parquet, for programs."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from PolyPoseLib.io.cohort.rows import COLUMNS, Cell
from PolyPoseLib.io.whole_files import replaced_whole

CSV, PARQUET = "summary.csv", "summary.parquet"

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
"""Beginnings of a text that a spreadsheet computes instead of showing it."""


def write_tables(folder: Path, rows: Sequence[dict[str, Cell]]) -> None:
    """Write both tables; raises OSError where the system refuses."""
    with replaced_whole(folder / CSV) as path:
        _write_csv(path, rows)
    with replaced_whole(folder / PARQUET) as path:
        _write_parquet(path, rows)


def _write_csv(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    with path.open("w", encoding="utf-8", newline="", errors="backslashreplace") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows:
            writer.writerow([csv_cell(row[name]) for name in COLUMNS])


def csv_cell(value: Cell) -> str:
    """A cell; texts that a spreadsheet would compute get an apostrophe, by which it shows them."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, str):
        return f"'{value}" if value.lstrip(" ").startswith(_FORMULA) else value
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _write_parquet(path: Path, rows: Sequence[dict[str, Cell]]) -> None:
    import pyarrow
    from pyarrow import parquet

    kinds = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64()}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in COLUMNS.items()])
    columns = [
        pyarrow.array([_parquet_cell(row[name]) for row in rows], kinds[kind])
        for name, kind in COLUMNS.items()
    ]
    parquet.write_table(pyarrow.Table.from_arrays(columns, schema=schema), path)


def _parquet_cell(value: Cell) -> Cell:
    """A cell as Parquet holds it: what is not known is null, and a text is one that UTF-8 knows."""
    if isinstance(value, float) and math.isnan(value):
        return None
    return value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value
