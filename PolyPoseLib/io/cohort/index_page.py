"""index.html: all studies of a cohort, the worst first, each with links to its report, its picture and its log."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from PolyPoseLib.data.cohort.outcome import VERDICTS
from PolyPoseLib.io.cohort.cohort_folder import LOGS
from PolyPoseLib.io.cohort.rows import StudySummary
from PolyPoseLib.io.report.page_parts import element, escaped
from PolyPoseLib.io.report.page_style import STYLE
from PolyPoseLib.io.report.words import CAUTION, count
from PolyPoseLib.io.report_files import PAGE, REPORT
from PolyPoseLib.io.whole_files import replaced_whole

INDEX = "index.html"

_TONES = {"failed": "bad", "wrong input": "bad", "untrusted": "bad", "not run": "caution", "done": "good"}

_HEADER = ("study", "verdict", "uncertain", "95 % mm", "seconds", "MiB", "attempts", "see", "reasons")

_MORE_STYLE = "td:nth-child(2){font-weight:600}td a{margin-right:.5em}td{vertical-align:top}"

_LEGEND = (
    "The worst first: by verdict, then by the number of uncertain structures, then by the largest 95 % interval of a "
    "position. A study that is done may still hold uncertain structures: look at its report."
)


def write_index(folder: Path, summaries: Sequence[StudySummary]) -> None:
    """Write the page; raises OSError where the system refuses."""
    with replaced_whole(folder / INDEX) as path:
        path.write_text(page_of(folder, summaries), encoding="utf-8", errors="backslashreplace")


def page_of(folder: Path, summaries: Sequence[StudySummary]) -> str:
    """The whole page, whose links start from the cohort's folder."""
    head = "".join(f'<th scope="col">{escaped(each)}</th>' for each in _HEADER)
    body = "\n".join(_row(folder, each) for each in sorted(summaries, key=lambda each: each.rank))
    # Names and reasons come from files: besides being escaped, nothing of the page could run or be fetched.
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>PolyPose cohort</title>\n<style>{STYLE}{_MORE_STYLE}</style>\n</head>\n<body>",
            f"<header><h1>PolyPose cohort</h1>{_headline(summaries)}</header>",
            f'<main>{element("p", _LEGEND, "muted")}<div class="wide"><table><thead><tr>{head}</tr></thead>',
            f"<tbody>{body}</tbody></table></div></main>",
            f"<footer>{element('p', CAUTION)}</footer>\n</body>\n</html>\n",
        ]
    )


def _headline(summaries: Sequence[StudySummary]) -> str:
    """How many studies have which verdict."""
    verdicts = [each.outcome.verdict for each in summaries]
    counts = [f"{verdicts.count(each)} {each}" for each in VERDICTS if each in verdicts]
    worst = min(verdicts, key=VERDICTS.index, default="done")
    text = f"{count(len(summaries), 'study', 'studies')}: {', '.join(counts)}."
    return element("p", text, f"verdict {_TONES[worst]}")


def _row(folder: Path, summary: StudySummary) -> str:
    outcome = summary.outcome
    cells = (
        outcome.verdict,
        str(len(summary.doubtful)) if summary.structures else "",
        _number(summary.largest_interval_mm, 1),
        _number(outcome.seconds or math.nan, 0),
        _number(outcome.peak_memory_mib, 0),
        str(outcome.attempts or ""),
    )
    reasons = "; ".join(each.rstrip(".") for each in summary.reasons)
    return (
        f'<tr><th scope="row">{escaped(outcome.identity)}</th>'
        f"{element('td', cells[0], _TONES[outcome.verdict])}"
        f"{''.join(element('td', each) for each in cells[1:])}"
        f"<td>{_links(folder, summary)}</td>{element('td', reasons)}</tr>"
    )


def _links(folder: Path, summary: StudySummary) -> str:
    """Links to the files of a study that are there."""
    outcome = summary.outcome
    files = {"log": f"{LOGS}/{outcome.identity}.log"}
    if outcome.has_result:
        files = {"report": f"{outcome.place}/{PAGE}", "picture": f"{outcome.place}/{REPORT}", **files}
    return "".join(
        f'<a href="{escaped(quote(path))}">{name}</a>'
        for name, path in files.items()
        if (folder / path).is_file()
    )


def _number(value: float, digits: int) -> str:
    return "" if math.isnan(value) else f"{value:.{digits}f}"
