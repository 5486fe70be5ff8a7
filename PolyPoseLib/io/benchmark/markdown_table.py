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
        "Wilcoxon's signed-rank test over subjects, two-sided, against the system that has the best mean among the "
        f"others; Holm's correction over {words.counted(tested, 'test')} of this table."
    )


def _structures(column: Column, table: Table, rows: Sequence[Row]) -> Iterator[list[str]]:
    """Structures by systems in one measure; nothing where no structure has it."""
    done = [row for row in rows if row["status"] == "done"]
    names = dict.fromkeys(name for row in done for name in (row["scores"].get("structures") or {}))
    systems = [line.system for line in table.lines if line.done]
    lines = []
    for name in names:
        path = ("scores", "structures", name, *column.path)
        cells = []
        for system in systems:
            values = {
                (str(row["subject"]), str(row["case"])): value
                for row in done
                if row["system"] == system and (value := number_at(row, path)) is not None
            }
            cells.append(words.mean_sd(column, Cell(values) if values else None))
        if any(cells):
            lines.append([escaped(name), *cells])
    if lines:
        yield ["structure", *(escaped(system) for system in systems)]
        yield from lines
