"""The rows of a cohort's table: one for every structure of every study, and one for a study without a result."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.cohort.outcome import VERDICTS, Outcome
from PolyPoseLib.data.result import StructureResult
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, list_of, object_of, parse_object, string
from PolyPoseLib.io.result_records import in_order_of_labels, read_labelled

RESULT = "result.json"

COLUMNS: dict[str, type] = {
    "study": str,
    "verdict": str,
    "exit_status": int,
    "reasons": str,
    "structure": str,
    "rotation_deg": float,
    "left_mm": float,
    "back_mm": float,
    "up_mm": float,
    "distance_mm": float,
    "along_mm": float,
    "across_mm": float,
    "rotation_about_view_deg": float,
    "rotation_across_deg": float,
    "doubts": str,
    "warnings": int,
    "seconds": float,
    "cpu_seconds": float,
    "peak_memory_mib": float,
    "expected_memory_mib": float,
    "attempts": int,
    "worker": str,
    "result": str,
}
"""Names and types; NaN and None stand for what is not known."""

_INTERVALS = ("along_mm", "across_mm", "rotation_about_view_deg", "rotation_across_deg")

Cell = str | int | float | None


@dataclass(frozen=True)
class StudySummary:
    """What became of a study, with the parts of its result.json that the table shows.

    Parameters
    ----------
    outcome : Outcome
        Of the study.
    structures : {str: StructureResult}
        Empty where there is no result.
    reasons : tuple of str
        Why it has no result, or why this must not be trusted.
    warnings : int
        How many the result states.

    """

    outcome: Outcome
    structures: Mapping[str, StructureResult]
    reasons: tuple[str, ...]
    warnings: int = 0

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Structures whose pose is flagged as uncertain."""
        return tuple(name for name, each in self.structures.items() if each.doubts)

    @property
    def largest_interval_mm(self) -> float:
        """The largest 95 % interval of a position, mm; NaN where none is stated."""
        widths = [_interval(each, name) for each in self.structures.values() for name in _INTERVALS[:2]]
        known = [each for each in widths if not math.isnan(each)]
        return max(known, default=math.nan)

    @property
    def rank(self) -> tuple[int, int, float, str]:
        """Sorts the worst first: the verdict, then uncertain structures, then the largest interval."""
        width = self.largest_interval_mm
        worst = VERDICTS.index(self.outcome.verdict)
        return worst, -len(self.doubtful), 0.0 if math.isnan(width) else -width, self.outcome.identity


def summary_of(folder: Path, outcome: Outcome) -> StudySummary:
    """What the table shows of a study; a result that cannot be read is a reason and no end."""
    given = (outcome.reason,) if outcome.reason else ()
    if not outcome.has_result:
        return StudySummary(outcome, {}, given)
    path = folder / outcome.place / RESULT
    try:
        fields = Record(parse_object(read_text(path, "a folder that register wrote"), RESULT))
        structures = in_order_of_labels(fields.required("structures", object_of(read_labelled)))
        distrust = tuple(fields.required("distrust", list_of(string)))
        warnings = len(fields.required("warnings", list_of(string)))
    except InputError as error:
        return StudySummary(outcome, {}, (*given, f"The result cannot be read: {error}"))
    return StudySummary(outcome, structures, distrust or given, warnings)


def rows_of(summaries: Sequence[StudySummary]) -> Iterator[dict[str, Cell]]:
    """The rows of the table, in the order of the studies."""
    for summary in summaries:
        shared = _shared(summary)
        if not summary.structures:
            yield shared
        for name, structure in summary.structures.items():
            yield {**shared, **_motion(name, structure)}


def _shared(summary: StudySummary) -> dict[str, Cell]:
    """The cells that all rows of a study have."""
    outcome = summary.outcome
    given: dict[str, Cell] = {
        "study": outcome.identity,
        "verdict": outcome.verdict,
        "exit_status": outcome.exit_status,
        "reasons": "; ".join(each.rstrip(".") for each in summary.reasons),
        "structure": "",
        "doubts": "",
        "warnings": summary.warnings,
        "seconds": outcome.seconds,
        "cpu_seconds": outcome.cpu_seconds,
        "peak_memory_mib": outcome.peak_memory_mib,
        "expected_memory_mib": outcome.expected_memory_mib,
        "attempts": outcome.attempts,
        "worker": outcome.worker,
        "result": outcome.place if outcome.has_result else "",
    }
    return {name: given.get(name) for name in COLUMNS}


def _motion(name: str, structure: StructureResult) -> dict[str, Cell]:
    """The cells of one structure."""
    left, back, up = (float(each) for each in structure.translation_mm)
    return {
        "structure": name,
        "rotation_deg": float(structure.rotation_deg),
        "left_mm": left,
        "back_mm": back,
        "up_mm": up,
        "distance_mm": float(np.linalg.norm(structure.translation_mm)),
        **{each: _interval(structure, each) for each in _INTERVALS},
        "doubts": "; ".join(structure.doubts),
    }


def _interval(structure: StructureResult, name: str) -> float:
    """Half width of a 95 % interval, the larger of two; NaN where it is not stated."""
    value = (structure.uncertainty or {}).get(name)
    if value is None:
        return math.nan
    try:
        return float(np.max(np.asarray(value, dtype=float)))
    except (TypeError, ValueError):
        return math.nan
