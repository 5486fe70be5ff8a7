"""The columns of a benchmark's tables: what is read from a row, its unit, and which way is better."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Row = Mapping[str, Any]
"""One system on one case: "case", "dataset", "subject", "views", "system", "status" ("done", "failed" or "skipped"),
"reason", "seconds", "cpu_seconds", "peak_memory_mib", "notes", "trained_on" (one of TRAINED_ON; may be absent) and
"scores", which is what score_case gives."""


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes
    ----------
    span
        Heading over several columns: a group, "deformation" or "cost".
    measure
        Heading of the column: "Dice".
    unit
        "mm", "" for none.
    decimals
        Of the mean and the standard deviation.
    better
        "higher" or "lower"; nothing is marked in a column where it is None.
    tested
        Whether systems are compared in it by a test.
    path
        Keys of a row that lead to the number.

    """

    span: str
    measure: str
    unit: str
    decimals: int
    better: Literal["higher", "lower"] | None
    tested: bool
    path: tuple[str, ...]

    @property
    def key(self) -> tuple[str, str, str]:
        """Unique in a table."""
        return self.span, self.measure, self.unit

    @property
    def title(self) -> str:
        """The whole heading on one line: "bones: HD95 (mm)"."""
        return f"{self.span}: {self.heading}"

    @property
    def heading(self) -> str:
        """Without the span: "HD95 (mm)"."""
        return f"{self.measure} ({self.unit})" if self.unit else self.measure

    def value(self, row: Row) -> float | None:
        """The number of a row; None where it has none."""
        return number_at(row, self.path)


def number_at(row: Any, path: Sequence[str]) -> float | None:
    """A finite number in nested mappings; None where there is none."""
    for key in path:
        if not isinstance(row, Mapping) or key not in row:
            return None
        row = row[key]
    if isinstance(row, bool) or not isinstance(row, int | float) or not math.isfinite(row):
        return None
    return float(row)


Better = Literal["higher", "lower"]

_IN_3D: tuple[tuple[str, str, int, Better, str], ...] = (
    ("Dice", "", 3, "higher", "dice"),
    ("HD95", "mm", 2, "lower", "hd95_mm"),
    ("TRE", "mm", 2, "lower", "tre_mean_mm"),
)
_IN_2D: tuple[tuple[str, str, int, Better, str], ...] = (
    ("Dice", "", 3, "higher", "dice"),
    ("HD95", "px", 2, "lower", "hd95_px"),
    ("HD95", "mm", 2, "lower", "hd95_mm"),
)
_WHOLE: tuple[tuple[str, str, str, int, bool, tuple[str, ...]], ...] = (
    ("deformation", "folds", "%", 2, True, ("scores", "folds_percent")),
    ("deformation", "SD log|J|", "", 3, True, ("scores", "sd_log_jacobian")),
    ("cost", "time", "s", 1, False, ("seconds",)),
    ("cost", "CPU time", "s", 1, False, ("cpu_seconds",)),
    ("cost", "peak memory", "MiB", 0, False, ("peak_memory_mib",)),
)


def columns_of(rows: Sequence[Row]) -> list[Column]:
    """The columns in which any row has a number, in the order of the tables."""
    return [column for column in _all_columns(rows) if any(column.value(row) is not None for row in rows)]


def _all_columns(rows: Sequence[Row]) -> Iterator[Column]:
    for name in group_names(rows):
        for measure, unit, decimals, better, key in _IN_3D:
            yield Column(name, measure, unit, decimals, better, True, ("scores", "groups", name, key))
    for name in group_names(rows, lambda scores: scores.get("held_out") or {}):
        for measure, unit, decimals, better, key in _IN_2D:
            path = ("scores", "held_out", "groups", name, key)
            # In pixels and in mm the same distances are told twice: one of them is tested.
            yield Column(f"{name}, held-out X-rays", measure, unit, decimals, better, unit != "mm", path)
    for span, measure, unit, decimals, tested, path in _WHOLE:
        yield Column(span, measure, unit, decimals, "lower", tested, path)


def group_names(
    rows: Sequence[Row], part: Callable[[Mapping[str, Any]], Mapping[str, Any]] = lambda scores: scores
) -> list[str]:
    """Names of the groups in the rows' scores, or in a part of them, in the order in which they appear."""
    names: dict[str, None] = {}
    for row in rows:
        names |= dict.fromkeys(part(row.get("scores") or {}).get("groups") or {})
    return list(names)
