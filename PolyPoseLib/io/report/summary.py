"""Everything that a report shows of one result, gathered once for the picture and the page."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.data.result import Result
from PolyPoseLib.io.report.levels import LevelCurve, level_curves
from PolyPoseLib.io.report.views import ReportView, report_views
from PolyPoseLib.io.report.words import BoneLine, Headline, bone_lines, facts, headline, notes


@dataclass(frozen=True)
class Summary:
    """headline, facts: first lines; notes: reasons and warnings, each with its tone; bones, views, curves: the rest."""

    headline: Headline
    facts: str
    notes: list[tuple[str, str]]
    bones: list[BoneLine]
    views: list[ReportView]
    curves: list[LevelCurve]


def summary_of(result: Result) -> Summary:
    """What a report shows of a result."""
    return Summary(
        headline(result),
        facts(result),
        notes(result),
        bone_lines(result),
        report_views(result),
        level_curves(result.history),
    )
