"""Systems over subjects: means, which is best, and whether it differs from its best rival by more than chance."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from PolyPoseLib.data.benchmark.job import CT, NOT_SEEN, TRAINED_ON, TRUTH, UNREAD
from PolyPoseLib.evaluation.benchmark.columns import Column, Row, columns_of
from PolyPoseLib.evaluation.benchmark.table_rows import table_rows

OURS = "polypose"
"""The system that is tested against its best rival."""

VARIANTS = ("polypose-found",)
"""Systems of the tables that are OURS under other conditions: no rivals of it, and without a rank among the others."""

REFERENCE = "rest"
"""Doing nothing, which is no method: it stands in the tables without a rank."""

LEAST_PAIRS = 6
"""Below, no two-sided signed-rank test reaches 0.05: 2 / 2^5 is 0.0625."""

_MOST_ENUMERATED = 13
"""Pairs up to which all signs are enumerated where differences tie."""

Key = tuple[str, str, str]


@dataclass(frozen=True)
class Cell:
    """One system in one column.

    Attributes
    ----------
    cases
        {(subject, case): number}.

    """

    cases: Mapping[tuple[str, str], float]

    @property
    def values(self) -> dict[str, float]:
        """{subject: number}; the mean over a subject's cases where it has several."""
        by_subject: dict[str, list[float]] = {}
        for (subject, _), value in self.cases.items():
            by_subject.setdefault(subject, []).append(value)
        return {subject: float(np.mean(each)) for subject, each in by_subject.items()}

    def shared(self, other: Cell) -> Cell:
        """Of the cases alone that another has, too."""
        return Cell({case: value for case, value in self.cases.items() if case in other.cases})

    @property
    def mean(self) -> float:
        """Over subjects."""
        return float(np.mean(list(self.values.values())))

    @property
    def sd(self) -> float | None:
        """Standard deviation over subjects (n - 1); None for one."""
        return float(np.std(list(self.values.values()), ddof=1)) if len(self.values) > 1 else None


@dataclass(frozen=True)
class Line:
    """One system in a table.

    Attributes
    ----------
    system
        Its name.
    done, cases
        How many cases it finished, of how many.
    cells
        {column: its numbers}; columns without any are absent.
    reasons
        {(status, reason): number of cases} of those that it did not finish.
    unread
        How many of the cases could not be read, so that no system could finish them.
    trained_on
        {one of TRAINED_ON: number of subjects}: how far its weights know the subjects from their training.

    """

    system: str
    done: int
    cases: int
    cells: Mapping[Key, Cell]
    reasons: Mapping[tuple[str, str], int]
    unread: int = 0
    trained_on: Mapping[str, int] = field(default_factory=dict)

    @property
    def is_seen(self) -> bool:
        """Whether it is scored on subjects that its weights were trained on."""
        return self.trained_on.get(CT, 0) + self.trained_on.get(TRUTH, 0) > 0

    @property
    def is_whole(self) -> bool:
        """Whether it finished every case that could be read."""
        return self.done == self.cases - self.unread


@dataclass(frozen=True)
class Comparison:
    """A system against its best rival in one column.

    Attributes
    ----------
    column
        In which.
    rival
        The system that is farthest ahead of it, or least behind, in the mean over the cases that both have; none of
        those in :attr:`Table.unranked`.
    pairs, differing
        Subjects that both have, each by the cases that both have, and those of them in which they differ.
    better
        Whether the system's mean over these subjects is the better one.
    p, p_holm
        Two-sided, of Wilcoxon's signed-rank test, and adjusted over the table's columns; None when there are too few
        pairs.

    """

    column: Column
    rival: str
    pairs: int
    differing: int
    better: bool
    p: float | None
    p_holm: float | None = None


@dataclass(frozen=True)
class Table:
    """One data set and set of views.

    Attributes
    ----------
    dataset, views
        Which.
    subjects, unread
        Number of them, and of those of which a case could not be read.
    columns, lines
        Of the table, lines in the order in which the systems appear.
    best, second
        {column: systems that have a rank}. Best is what no other beats, second best what none but the best beat: two
        systems are compared by their means over the cases that both have, as they are printed, so that nobody gains by
        a case that it failed on, nor a rival loses by one. Ties share a rank.
    unranked
        {column: systems that have too few of the cases for a rank}: fewer than half of those that any has.
    comparisons
        Of one system against its best rivals.

    """

    dataset: str
    views: str
    subjects: int
    columns: Sequence[Column]
    lines: Sequence[Line]
    best: Mapping[Key, frozenset[str]] = field(default_factory=dict)
    second: Mapping[Key, frozenset[str]] = field(default_factory=dict)
    unranked: Mapping[Key, frozenset[str]] = field(default_factory=dict)
    comparisons: Sequence[Comparison] = ()
    unread: int = 0


def tables_of(rows: Sequence[Row], ours: str = OURS) -> list[Table]:
    """One table per data set and set of views, in the order in which they appear.

    Parameters
    ----------
    rows : sequence of Row
        Of all cases and systems, those that failed or were skipped included.
    ours : str
        The system that is tested against its best rival in every column.

    Returns
    -------
    list of Table
        A system that has no row for a case of its table counts as not having finished it.

    """
    return [_table(dataset, views, own, ours) for (dataset, views), own in table_rows(rows).items()]


def _table(dataset: str, views: str, rows: Sequence[Row], ours: str) -> Table:
    columns = columns_of(rows)
    cases = {_case(row) for row in rows}
    unread = {_case(row) for row in rows if row.get("case_digest") == UNREAD}
    systems = dict.fromkeys(str(row["system"]) for row in rows)
    lines = [
        _line(system, [row for row in rows if row["system"] == system], columns, len(cases), len(unread))
        for system in systems
    ]
    own = [line for line in lines if line.system not in VARIANTS]
    ranks = {column.key: _ranked(column, own) for column in columns}
    return Table(
        dataset, views, len({row["subject"] for row in rows}), columns, lines,
        {key: best for key, (best, _) in ranks.items()},
        {key: second for key, (_, second) in ranks.items()},
        {column.key: _unranked(column, own) for column in columns},
        _comparisons(columns, lines, ours),
        len({subject for subject, _ in unread}),
    )  # fmt: skip


def _case(row: Row) -> tuple[str, str]:
    return str(row["subject"]), str(row["case"])


def _line(system: str, rows: Sequence[Row], columns: Sequence[Column], cases: int, unread: int) -> Line:
    done = [row for row in rows if row["status"] == "done"]
    cells = {}
    for column in columns:
        numbers = {_case(row): column.value(row) for row in done}
        if known := {case: value for case, value in numbers.items() if value is not None}:
            cells[column.key] = Cell(known)
    reasons = Counter(
        (str(row["status"]), str(row.get("reason") or "no reason was given"))
        for row in rows
        if row["status"] != "done"
    )
    absent = cases - len({_case(row) for row in rows})
    if absent:
        reasons["skipped", "it was not run on these"] = absent
    finished = {_case(row) for row in done}
    return Line(system, len(finished), cases, cells, dict(reasons), unread, _trained_on(done))


def _trained_on(rows: Sequence[Row]) -> dict[str, int]:
    """Subjects by what weights know of them; of a subject with several cases the most counts."""
    most: dict[str, int] = {}
    for row in rows:
        found = TRAINED_ON.index(row.get("trained_on", NOT_SEEN))
        most[str(row["subject"])] = max(most.get(str(row["subject"]), 0), found)
    return dict(Counter(TRAINED_ON[each] for each in most.values()))


def _known(column: Column, lines: Sequence[Line]) -> dict[str, Cell]:
    """{system: its numbers in a column} of those that have any."""
    return {
        line.system: line.cells[column.key]
        for line in lines
        if column.key in line.cells and line.system != REFERENCE
    }


def _unranked(column: Column, lines: Sequence[Line]) -> frozenset[str]:
    """Systems with numbers of fewer than half of the cases of a column: too few to speak for the others."""
    known = _known(column, lines)
    cases = set().union(*(cell.cases for cell in known.values()))
    return frozenset(system for system, cell in known.items() if 2 * len(cell.cases) < len(cases))


def _rankable(column: Column, lines: Sequence[Line]) -> dict[str, Cell]:
    few = _unranked(column, lines)
    return {system: cell for system, cell in _known(column, lines).items() if system not in few}


def _ranked(column: Column, lines: Sequence[Line]) -> tuple[frozenset[str], frozenset[str]]:
    """Systems that rank as best and as second best; none where all are alike."""
    cells = {} if column.better is None else _rankable(column, lines)
    best = _unbeaten(column, cells)
    others = {system: cell for system, cell in cells.items() if system not in best}
    return (best, _unbeaten(column, others)) if others else (frozenset(), frozenset())


def _unbeaten(column: Column, cells: Mapping[str, Cell]) -> frozenset[str]:
    """Systems to which no other is better; none where each is beaten by another over yet other cases."""
    return frozenset(
        system
        for system, cell in cells.items()
        if not any(_beats(column, other, cell) for name, other in cells.items() if name != system)
    )


def _beats(column: Column, first: Cell, second: Cell) -> bool:
    """Whether the first mean is better over the cases that both have, as it is printed."""
    if not first.cases.keys() & second.cases.keys():
        return False
    one, other = (
        float(f"{cell.mean:.{column.decimals}f}") for cell in (first.shared(second), second.shared(first))
    )
    return one > other if column.better == "higher" else one < other


def _comparisons(columns: Sequence[Column], lines: Sequence[Line], ours: str) -> list[Comparison]:
    own = next((line for line in lines if line.system == ours), None)
    found = [
        each for column in columns if own is not None and (each := _compared(column, own, lines)) is not None
    ]
    adjusted = iter(holm([each.p for each in found if each.p is not None]))
    return [
        each if each.p is None else Comparison(**{**each.__dict__, "p_holm": next(adjusted)})
        for each in found
    ]


def _compared(column: Column, own: Line, lines: Sequence[Line]) -> Comparison | None:
    """A system against the best of the others in a column; None where there is none."""
    own_cell = own.cells.get(column.key)
    if not (column.tested and column.better and own_cell):
        return None
    alike = VARIANTS if own.system == OURS else ()
    cells = _rankable(column, [line for line in lines if line.system not in alike])
    sign = 1 if column.better == "higher" else -1
    ahead = {
        system: -sign * float(differences.mean())
        for system, cell in cells.items()
        if system != own.system and len(differences := _differences(own_cell, cell))
    }
    if not ahead:
        return None
    rival = max(ahead, key=lambda system: ahead[system])
    differences = _differences(own_cell, cells[rival])
    differing = int(np.count_nonzero(_without_rounding(differences)))
    return Comparison(column, rival, len(differences), differing, ahead[rival] < 0, signed_rank(differences))


def _differences(mine: Cell, its: Cell) -> np.ndarray:
    """Of the means of subjects (n,); a subject's mean over other cases than the other's would be no pair."""
    first, second = mine.shared(its).values, its.shared(mine).values
    return np.array([first[subject] - second[subject] for subject in first])


def signed_rank(differences: np.ndarray) -> float | None:
    """Two-sided p of Wilcoxon's signed-rank test of paired differences.

    Parameters
    ----------
    differences : (n,) array
        Pairs without a difference are left out (Wilcoxon's way); differences within rounding tie.

    Returns
    -------
    float or None
        Exact up to 50 pairs without ties and 13 with, else by the normal distribution, corrected for ties. None for
        fewer than 6 pairs that differ, with which no p below 0.05 is possible.

    References
    ----------
    F. Wilcoxon, "Individual comparisons by ranking methods", Biometrics Bulletin 1945.

    """
    from scipy import stats

    kept = _without_rounding(np.asarray(differences, dtype=np.float64))
    kept = kept[kept != 0]
    if len(kept) < LEAST_PAIRS:
        return None
    ties = len(np.unique(np.abs(kept))) < len(kept)
    if ties and len(kept) <= _MOST_ENUMERATED:
        ranks = stats.rankdata(np.abs(kept)) * np.sign(kept)
        found = stats.permutation_test(
            (ranks,), lambda x, axis: np.sum(x, axis=axis), permutation_type="samples", vectorized=True,
            n_resamples=2 ** len(kept), alternative="two-sided",
        )  # fmt: skip
        return float(found.pvalue)
    method = "approx" if ties or len(kept) > 50 else "exact"
    result: Any = stats.wilcoxon(kept, method=method)
    return float(result.pvalue)


def _without_rounding(differences: np.ndarray) -> np.ndarray:
    """Differences to nine digits of the largest."""
    largest = float(np.abs(differences).max(initial=0.0))
    if largest == 0:
        return np.zeros_like(differences)
    return np.round(differences / largest, 9)


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's adjusted p of a family of tests, in their order.

    References
    ----------
    S. Holm, "A simple sequentially rejective multiple test procedure", Scand. J. Statistics 1979.

    """
    order = sorted(range(len(p_values)), key=lambda place: p_values[place])
    adjusted, highest = [math.nan] * len(p_values), 0.0
    for rank, place in enumerate(order):
        highest = max(highest, min(1.0, (len(p_values) - rank) * p_values[place]))
        adjusted[place] = highest
    return adjusted
