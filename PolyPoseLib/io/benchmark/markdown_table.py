"""A benchmark's table in Markdown: the systems, the tests, and the structures one by one."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from PolyPoseLib.errors import one_line
from PolyPoseLib.evaluation.benchmark.columns import Column, Row, number_at
from PolyPoseLib.evaluation.benchmark.statistics import OURS, Cell, Line, Table
from PolyPoseLib.io.benchmark import words

_SPECIAL = re.compile(r"([\\`*_{}\[\]<>#|~$&])")

_NUMBER = re.compile(r"$|\**-?[0-9]|\\< [0-9]")

_STRUCTURE_MEASURES = (("Dice", "", 3, "dice"), ("HD95", "mm", 2, "hd95_mm"), ("TRE", "mm", 2, "tre_mean_mm"))

_STRUCTURE_NOTE = (
    f"{words.DAGGER} Beside a system: it did not finish every case; beside a mean: over fewer cases than another "
    "system has of this structure."
)


def escaped(text: str) -> str:
    """A text that Markdown shows as it is, on one line."""
    return _SPECIAL.sub(r"\\\1", one_line(text))


def markdown(table: Table, rows: Sequence[Row]) -> str:
    """The whole page of a table; rows: those of the table."""
    parts = [f"# {escaped(words.heading(table))}", _grid(_systems(table))]
    parts.append("\n".join(f"- {escaped(note)}" for note in words.notes(table, rows)))
    parts[-1] += "\n- Best in bold, second best in italics."
    if table.comparisons:
        parts += [f"## {OURS} against its best rival", _grid(_tests(table)), _test_note(table)]
    for measure, unit, decimals, key in _STRUCTURE_MEASURES:
        grid = _grid(_structures(Column("", measure, unit, decimals, None, False, (key,)), table, rows))
        if grid:
            parts += [f"## {measure} by structure{f' ({unit})' if unit else ''}", grid]
            if words.DAGGER in grid:
                parts.append(_STRUCTURE_NOTE)
    return "\n\n".join(parts) + "\n"


def _grid(lines: Iterator[list[str]]) -> str:
    """Lines of cells as a table, the first one its head; empty when there are none."""
    head, *body = list(lines) or [[]]
    if not body:
        return ""
    numeric = [all(_NUMBER.match(cell) for cell in cells) for cells in zip(*body, strict=True)]
    rule = ["---:" if each else "---" for each in numeric]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, rule, *body))


def _systems(table: Table) -> Iterator[list[str]]:
    told = any(line.reasons for line in table.lines)
    yield ["system", "cases", *(escaped(column.title) for column in table.columns), *(["remarks"] * told)]
    for line in table.lines:
        cells = [_cell(column, line, table) for column in table.columns]
        remark = [escaped(words.remarks(line))] * told
        yield [escaped(words.name(line)), f"{line.done}/{line.cases}", *cells, *remark]


def _cell(column: Column, line: Line, table: Table) -> str:
    text = words.mean_sd(column, line.cells.get(column.key))
    if line.system in table.best.get(column.key, ()):
        return f"**{text}**"
    return f"*{text}*" if line.system in table.second.get(column.key, ()) else text


def _tests(table: Table) -> Iterator[list[str]]:
    yield ["column", "best rival", "pairs", f"{OURS} is", "p", "p (Holm)"]
    for each in table.comparisons:
        yield [
            escaped(each.column.title),
            escaped(each.rival),
            str(each.pairs),
            words.verdict(each),
            escaped(words.p_value(each.p)),
            escaped(words.p_value(each.p_holm)),
        ]


def _test_note(table: Table) -> str:
    tested = sum(each.p is not None for each in table.comparisons)
    return (
        "Wilcoxon's signed-rank test over subjects, two-sided, against the system that is farthest ahead, or least "
        "behind, in the mean over the cases that both finished; Holm's correction over "
        f"{words.counted(tested, 'test')} of this table."
    )


def _structures(column: Column, table: Table, rows: Sequence[Row]) -> Iterator[list[str]]:
    """Structures by systems in one measure; nothing where no structure has it."""
    done = [row for row in rows if row["status"] == "done"]
    names = dict.fromkeys(name for row in done for name in (row["scores"].get("structures") or {}))
    systems = [line for line in table.lines if line.done]
    lines = []
    for name in names:
        cells = _structure_cells(("scores", "structures", name, *column.path), systems, done)
        known = {case for cell in cells for case in cell.cases}
        if known:
            texts = [words.mean_sd(column, cell if cell.cases else None) for cell in cells]
            marks = [words.DAGGER * (0 < len(cell.cases) < len(known)) for cell in cells]
            lines.append([escaped(name), *(text + mark for text, mark in zip(texts, marks, strict=True))])
    if lines:
        yield ["structure", *(f"{escaped(words.name(line))} {line.done}/{line.cases}" for line in systems)]
        yield from lines


def _structure_cells(path: Sequence[str], systems: Sequence[Line], done: Sequence[Row]) -> list[Cell]:
    """The numbers of every system at a place of its rows."""
    found: dict[str, dict[tuple[str, str], float]] = {line.system: {} for line in systems}
    for row in done:
        value = number_at(row, path)
        if value is not None:
            found[row["system"]][str(row["subject"]), str(row["case"])] = value
    return [Cell(numbers) for numbers in found.values()]
