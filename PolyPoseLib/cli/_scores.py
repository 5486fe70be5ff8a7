"""Scores as tables on the console."""

from __future__ import annotations

from typing import Any

from PolyPoseLib.cli._console import table


def truth_tables(scores: dict[str, Any]) -> str:
    """Tables of evaluation.score.score_result: per structure, per camera, and the summary in words."""
    rows = [
        (
            name,
            each["rest_tre_mean_mm"],
            each["tre_mean_mm"],
            each["tre_max_mm"],
            each["pose_tre_mean_mm"],
            each["pose_rotation_deg"],
            each["dice"],
            each["hd95_mm"],
        )
        for name, each in scores["structures"].items()
    ]
    header = (
        "structure",
        "TRE before mm",
        "transform's TRE mm",
        "transform's TRE max mm",
        "own motion's TRE mm",
        "rotation error deg",
        "Dice",
        "HD95 mm",
    )
    cameras = [
        (n, each["projection_mean_mm"], each["rotation_deg"], each["source_mm"])
        for n, each in enumerate(scores["cameras"])
    ]
    summary = scores["summary"]
    lines = [
        table(header, rows),
        "(transform's: of transform.h5 at the bone's voxels, blurred at joint surfaces; own motion's: of its "
        "fixed_to_moving)",
        "",
        table(("camera", "anchor's projection error mm", "rotation error deg", "source error mm"), cameras),
        "",
        f"mean over moving structures: transform's TRE {summary['mean_tre_mm']:.2f} mm "
        f"(before {summary['mean_rest_tre_mm']:.2f} mm), worst {summary['worst_tre_mm']:.2f} mm, "
        f"Dice {summary['mean_dice']:.3f}",
        warp_line(summary),
    ]
    return "\n".join(lines)


def warp_line(summary: dict[str, float]) -> str:
    """How smooth the transform is."""
    return f"transform: {summary['folds_percent']:.3f} % folds, SD of log|J| {summary['sd_log_jacobian']:.3f}"


def overlap_table(scores: dict[str, Any]) -> str:
    """Table of evaluation.overlap.score_segmentation."""
    rows = [
        (name, each["dice"], each["hd95_mm"], each["centroid_mm"]) for name, each in scores["labels"].items()
    ]
    header = ("label", "Dice", "HD95 mm", "centroid error mm")
    summary = scores["summary"]
    cut_off = [name for name, each in scores["labels"].items() if each["cut_off"]]
    notes = []
    if cut_off:
        notes.append(f"cut off by an end of a scan, and scored up to it: {', '.join(cut_off)}")
    if scores["not_in_ct"]:
        notes.append(f"not in the CT's label map, and not scored: {', '.join(scores['not_in_ct'])}")
    return "\n".join(
        [table(header, rows), *notes, "", f"mean Dice {summary['mean_dice']:.3f}", warp_line(summary)]
    )
