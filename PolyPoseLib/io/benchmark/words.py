"""What a benchmark's tables say besides numbers, the same in Markdown and LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence

from PolyPoseLib.data.benchmark.job import CT, TRUTH, UNKNOWN
from PolyPoseLib.errors import cut, one_line
from PolyPoseLib.evaluation.benchmark.columns import Column, Row
from PolyPoseLib.evaluation.benchmark.statistics import (
    LEAST_PAIRS,
    OURS,
    REFERENCE,
    VARIANTS,
    Cell,
    Comparison,
    Line,
    Table,
)

LONGEST_REASON = 300

DAGGER = "\u2020"
"""What does not cover every case."""

DOUBLE_DAGGER = "\u2021"
"""What was trained on subjects of the table."""

MEANINGS = {
    "Dice": "overlap with the truth, from 0 to 1",
    "HD95": "95th percentile of the distance between the surfaces or outlines",
    "TRE": "mean distance from where a structure's voxels are put to where they belong",
    "SD log|J|": "how unevenly volume changes, the standard deviation of the logarithm of the Jacobian determinant",
    "time": "of the system alone, without reading and scoring",
}
"""What a measure is, for those who meet it first in the table."""

_VIEWS = re.compile(r"(own-)?([0-9]{1,6})(?:x([0-9.]+)|-frames)", re.ASCII)


def heading(table: Table) -> str:
    """What a table is of: "headneck, 2 X-rays over 30 degrees, 5 subjects", "2 own X-rays within 60 degrees"."""
    found = _VIEWS.fullmatch(table.views)
    views = one_line(table.views)
    if found is not None:
        own, number, arc = found.groups()
        views = counted(int(number), "own X-ray" if own else "X-ray")
        if arc and number != "1":
            views += f" {'within' if own else 'over'} {arc} degrees"
    return f"{one_line(table.dataset)}, {views}, {counted(table.subjects, 'subject')}"


def counted(number: int, noun: str) -> str:
    """A number with its noun: "1 subject", "2 subjects"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def mean_sd(column: Column, cell: Cell | None) -> str:
    """Mean and SD, "0.912(0.013)"; the mean alone for one subject, empty for none."""
    if cell is None:
        return ""
    mean = f"{cell.mean:.{column.decimals}f}"
    return mean if cell.sd is None else f"{mean}({cell.sd:.{column.decimals}f})"


def name(line: Line) -> str:
    """A system's name, with daggers where it did not finish every case or was trained on subjects of the table."""
    mark = "" if line.is_whole or not line.done else DAGGER
    return one_line(line.system) + mark + DOUBLE_DAGGER * line.is_seen


def training(line: Line, subjects: int) -> str:
    """On how many of so many subjects it was trained: "trained on 2 of 5 subjects"; empty where on none."""
    known = line.trained_on.get(CT, 0) + line.trained_on.get(TRUTH, 0)
    parts = [f"trained on {known} of {counted(subjects, 'subject')}"] if known else []
    if truths := line.trained_on.get(TRUTH, 0):
        parts.append(f"with the true posture of {truths}")
    if line.trained_on.get(UNKNOWN, 0):
        parts.append("its weights do not say on which CTs they were trained")
    return ", ".join(parts)


def remarks(line: Line) -> str:
    """Why a system did not finish cases: "failed on 2 of 5: out of memory"; empty where it finished all."""
    parts = [
        f"{status} on {count} of {line.cases}: {cut(one_line(reason), LONGEST_REASON).rstrip('.')}"
        for (status, reason), count in line.reasons.items()
    ]
    return "; ".join(parts)


def notes(table: Table, rows: Sequence[Row]) -> list[str]:
    """Sentences below a table; rows: those of the table."""
    sentences = [
        "Mean(SD) over subjects; best and second best are marked, means that print alike share a mark."
        if table.subjects > 1
        else "One subject: means without standard deviations."
    ]
    measures = {column.measure for column in table.columns}
    meanings = [f"{measure}: {meaning}" for measure, meaning in MEANINGS.items() if measure in measures]
    if meanings:
        sentences.append(
            f"{'; '.join(meanings)}. Groups: means over their structures, the anchor among them."
        )
    if any(line.system == REFERENCE for line in table.lines):
        sentences.append(f'"{REFERENCE}" does nothing and has no rank.')
    sentences += [
        f'"{line.system}" is {OURS} under other conditions and has no rank.'
        for line in table.lines
        if line.system in VARIANTS
    ]
    if table.unread:
        sentences.append(
            f"{table.unread} of {counted(table.subjects, 'subject')} could not be read: no system has scores there, "
            "and no rank depends on it."
        )
    sentences += [
        f"{DOUBLE_DAGGER} Scored on patients that it knows, which says nothing of others: {one_line(line.system)} was "
        f"{training(line, table.subjects)}."
        for line in table.lines
        if line.is_seen
    ]
    sentences += [
        f"{one_line(line.system)} may have been trained on these subjects: {training(line, table.subjects)}."
        for line in table.lines
        if line.trained_on.get(UNKNOWN, 0) and not line.is_seen
    ]
    if any(not line.is_whole and line.done for line in table.lines):
        sentences.append(
            f"{DAGGER} Not finished on every case: the means are over the cases that it finished. Ranks and tests "
            "compare two systems over the cases that both finished."
        )
    few = [
        line.system for line in table.lines if any(line.system in each for each in table.unranked.values())
    ]
    if few:
        sentences.append(
            f"No rank where it has fewer than half of the cases: {', '.join(map(one_line, few))}."
        )
    sentences += _held_out_notes([scores["held_out"] for scores in _scores(rows) if scores.get("held_out")])
    cut_off = sorted({each for scores in _scores(rows) for each in _marked(scores, "cut_off")})
    if cut_off:
        sentences.append(
            "Reaching an end of the CT's or of the truth's grid, where both may show different parts: "
            f"{', '.join(map(one_line, cut_off))}."
        )
    trimmed = sorted({each for scores in _scores(rows) for each in _marked(scores, "trimmed")})
    if trimmed:
        sentences.append(
            "Cut off by an end of a CT, and scored there only at a distance from that end: "
            f"{', '.join(map(one_line, trimmed))}."
        )
    lost = {
        line.system: count
        for line in table.lines
        if (count := sum(len(_marked(row["scores"], "lost")) for row in rows if _is_of(row, line)))
    }
    if lost:
        told = ", ".join(f"{one_line(system)} {count}" for system, count in lost.items())
        sentences.append(
            f"Structures that a system pushed out of the truth's grid or of a held-out X-ray count with Dice 0 and the "
            f"diagonal as HD95: {told}."
        )
    if any(column.measure == "folds" for column in table.columns):
        sentences.append(
            "Folds: voxels of the CT whose Jacobian determinant is 0 or less, every field interpolated to those voxels."
        )
    return sentences


def _held_out_notes(held_out: Sequence[dict]) -> list[str]:
    """What the scores on held-out X-rays are of, and which structures none of them has."""
    if not held_out:
        return []
    least = sorted({f"{scores['minimum_mm2']:g}" for scores in held_out})
    sentences = [
        "Held-out X-rays: silhouettes of the warped labels against the true ones, means over views; structures of "
        f"less than {' or '.join(least)} mm² at the detector in the truth are left out. HD95 in mm: at the detector."
    ]
    scored = {name for scores in held_out for name in scores.get("structures") or {}}
    left_out = {name for scores in held_out for name in scores.get("left_out") or ()} - scored
    if left_out:
        sentences.append(
            f"Too small in every held-out X-ray, and never scored there: {', '.join(map(one_line, sorted(left_out)))}."
        )
    return sentences


def _is_of(row: Row, line: Line) -> bool:
    return row["system"] == line.system and row["status"] == "done"


def _scores(rows: Sequence[Row]) -> list[dict]:
    return [row["scores"] for row in rows if row["status"] == "done" and row.get("scores")]


def _marked(scores: dict, mark: str) -> list[str]:
    """Structures that have a mark."""
    parts = scores, scores.get("held_out") or {}
    marked = [
        name for part in parts for name, each in (part.get("structures") or {}).items() if each.get(mark)
    ]
    return list(dict.fromkeys(marked))


def p_value(p: float | None) -> str:
    """A p as it is printed, "0.031" or "< 0.001"; empty for none."""
    if p is None:
        return ""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def verdict(comparison: Comparison) -> str:
    """Which of the two has the better mean, or why nothing can be said."""
    if comparison.differing == 0:
        return "no difference"
    if comparison.p is None:
        return f"too few pairs that differ ({comparison.differing}; {LEAST_PAIRS} are needed)"
    return "better" if comparison.better else "worse"
