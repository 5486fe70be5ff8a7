"""Scores of a track as tables on the console."""

from __future__ import annotations

from typing import Any

from PolyPoseLib.cli._console import table


def track_tables(scores: dict[str, Any]) -> str:
    """Tables of evaluation.tracks.score_track: errors, lost frames, intervals, beams, relative motion, summary."""
    parts = [_errors(scores), _frames(scores), _intervals(scores), _beams(scores)]
    if scores["relative"]:
        parts.append(_relative(scores))
    return "\n\n".join([*parts, _summary(scores)])


def _errors(scores: dict[str, Any]) -> str:
    rows = [
        (
            name,
            each["tre_mm"]["rms"],
            each["tre_mm"]["median"],
            each["tre_mm"]["worst"],
            each["centroid_mm"]["rms"],
            each["rotation_deg"]["rms"],
            each["rotation_deg"]["worst"],
            each["relied_on"]["tre_mm"]["rms"],
        )
        for name, each in scores["structures"].items()
    ]
    header = (
        "structure",
        "TRE RMS mm",
        "median mm",
        "worst mm",
        "centroid RMS mm",
        "rotation RMS deg",
        "worst deg",
        "TRE RMS of unflagged mm",
    )
    return table(header, rows)


def _frames(scores: dict[str, Any]) -> str:
    rows = [
        (
            name,
            each["frames"],
            each["none"],
            len(each["lost_and_said"]),
            len(each["lost_in_silence"]),
            len(each["false_alarms"]),
        )
        for name, each in scores["structures"].items()
    ]
    header = ("structure", "frames", "without pose", "lost and said", "lost in silence", "false alarms")
    return table(header, rows)


def _intervals(scores: dict[str, Any]) -> str:
    rows = []
    for name, each in scores["structures"].items():
        coverage = each["coverage"]
        shares = [coverage[part] for part in ("pose", "rotation", "translation")]
        rows.append((name, *(_percent(share) for share in [*shares, *coverage["axes"].values()])))
    header = ("inside 95 % of", "pose", "rotation", "translation")
    axes = next(iter(scores["structures"].values()))["coverage"]["axes"]
    return table((*header, *axes), rows)


def _beams(scores: dict[str, Any]) -> str:
    rows = [
        (name, view, beam["along_mm"], beam["across_mm"], _percent(beam["along_coverage"]))
        for name, each in scores["structures"].items()
        for view, beam in each["beams"].items()
    ]
    header = ("structure", "view", "along its beam RMS mm", "across it RMS mm", "inside 95 % along it")
    return table(header, rows)


def _relative(scores: dict[str, Any]) -> str:
    rows = [
        (
            name,
            each["centroid_mm"]["rms"],
            each["centroid_mm"]["worst"],
            each["rotation_deg"]["rms"],
            each["rotation_deg"]["worst"],
        )
        for name, each in scores["relative"].items()
    ]
    header = ("against the reference", "centroid RMS mm", "worst mm", "rotation RMS deg", "worst deg")
    return table(header, rows)


def _summary(scores: dict[str, Any]) -> str:
    summary = scores["summary"]
    smoothed = " (smoothed)" if summary["smoothed"] else ""
    return (
        f"all structures in {summary['frames']} frames{smoothed}: TRE RMS {summary['rms_mm']:.2f} mm, worst "
        f"{summary['worst_mm']:.2f} mm; rotation RMS {summary['rotation_rms_deg']:.2f} deg, worst "
        f"{summary['worst_deg']:.2f} deg\n"
        f"lost and said {summary['lost_and_said']}, lost in silence {summary['lost_in_silence']}, false alarms "
        f"{summary['false_alarms']}; inside 95 % regions {_percent(summary['coverage'])}; "
        f"{summary['cpu_seconds_per_frame']:.2f} CPU s a frame"
    )


def _percent(share: float) -> str:
    """A share as a percentage, a dash where there is none."""
    return f"{100 * share:.0f} %" if share == share else "-"
