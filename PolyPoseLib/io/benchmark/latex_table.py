"""A benchmark's table in LaTeX, as journals print it: booktabs, best in bold, second best underlined."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import groupby

from PolyPoseLib.errors import one_line
from PolyPoseLib.evaluation.benchmark.columns import Column, Row
from PolyPoseLib.evaluation.benchmark.statistics import OURS, Comparison, Line, Table
from PolyPoseLib.io.benchmark import words

_ESCAPES = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"{\char34}",
    "`": r"\textasciigrave{}",
    "[": "{[}",  # after a line's end LaTeX would read an optional argument, as it would a star
    "]": "{]}",
    "*": "{*}",
    "\u2020": r"\textsuperscript{\dag}",
    "\u2021": r"\textsuperscript{\ddag}",
    **{each: f"\\{each}" for each in "{}$&#%_"},
}
_SPECIAL = re.compile("[" + re.escape("".join(_ESCAPES)) + "]")
_ARROWS = {"higher": r" $\uparrow$", "lower": r" $\downarrow$", None: ""}
_LEAST_P = 0.05


def escaped(text: str) -> str:
    """A text that LaTeX prints as it is, on one line; half of a surrogate pair becomes "?"."""
    plain = one_line(text).encode("utf-8", "replace").decode("utf-8")
    # No ligatures: "--output" has two hyphens, and "''" two apostrophes.
    return re.sub(r"(?<=[-'])(?=[-'])", "{}", _SPECIAL.sub(lambda found: _ESCAPES[found[0]], plain))


def latex(table: Table, rows: Sequence[Row], label: str) -> str:
    """A table environment, for \\input; rows: those of the table; label: letters, digits, dots and hyphens."""
    tests = {each.column.key: each for each in table.comparisons if each.p_holm is not None}
    body = [
        "% Needs \\usepackage{booktabs}, \\usepackage{graphicx} and \\usepackage{textcomp}.",
        r"\begin{table}[t]",
        r"\centering",
        f"\\caption{{{_caption(table, rows)}}}",
        f"\\label{{tab:{re.sub(r'[^A-Za-z0-9.-]+', '-', label)}}}",
        r"\resizebox{\textwidth}{!}{%",
        f"\\begin{{tabular}}{{lc{'r' * len(table.columns)}}}",
        r"\toprule",
        *_heads(table.columns),
        r"\midrule",
        *(_line(line, table, tests) for line in table.lines),
        r"\bottomrule",
        r"\end{tabular}}",
        r"\end{table}",
    ]
    return "\n".join(body) + "\n"


def _caption(table: Table, rows: Sequence[Row]) -> str:
    sentences = [
        escaped(words.heading(table)[:1].upper() + words.heading(table)[1:]) + ".",
        *(escaped(note) for note in words.notes(table, rows)),
        r"\textbf{Best}, \underline{second best}.",
    ]
    if any(each.p_holm is not None for each in table.comparisons):
        sentences.append(
            f"\\textsuperscript{{*}}{escaped(OURS)} differs from its best rival (Wilcoxon's signed-rank test over "
            f"subjects, two-sided, Holm's correction, $p<{_LEAST_P}$)."
        )
    elif table.comparisons:
        sentences.append("No test: too few subjects.")
    unfinished = [line for line in table.lines if line.reasons and line.done]
    sentences += [escaped(f"{line.system} {words.remarks(line)}.") for line in unfinished]
    return " ".join(sentences)


def _heads(columns: Sequence[Column]) -> Iterator[str]:
    """Spans over their columns, rules below the spans, and the columns' own headings."""
    spans = [(span, len(list(members))) for span, members in groupby(columns, key=lambda column: column.span)]
    if spans:
        yield (
            " & ".join(["", "", *(f"\\multicolumn{{{n}}}{{c}}{{{escaped(span)}}}" for span, n in spans)])
            + r" \\"
        )
        first, rules = 3, []
        for _, count in spans:
            rules.append(f"\\cmidrule(lr){{{first}-{first + count - 1}}}")
            first += count
        yield " ".join(rules)
    heads = [escaped(column.heading) + _ARROWS[column.better] for column in columns]
    yield " & ".join(["system", "cases", *heads]) + r" \\"


def _line(line: Line, table: Table, tests: dict[tuple[str, str, str], Comparison]) -> str:
    first = [escaped(words.name(line)), f"{line.done}/{line.cases}"]
    if not line.cells and table.columns:
        reason = f"\\multicolumn{{{len(table.columns)}}}{{l}}{{{escaped(words.remarks(line))}}}"
        return " & ".join([*first, reason]) + r" \\"
    return " & ".join([*first, *(_cell(column, line, table, tests) for column in table.columns)]) + r" \\"


def _cell(column: Column, line: Line, table: Table, tests: dict[tuple[str, str, str], Comparison]) -> str:
    text = words.mean_sd(column, line.cells.get(column.key)) or "--"
    if line.system in table.best.get(column.key, ()):
        text = f"\\textbf{{{text}}}"
    elif line.system in table.second.get(column.key, ()):
        text = f"\\underline{{{text}}}"
    test = tests.get(column.key) if line.system == OURS else None
    p = None if test is None else test.p_holm
    return text + r"\textsuperscript{*}" if p is not None and p < _LEAST_P else text
