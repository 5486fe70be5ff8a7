"""Subcommand evaluate: how good a result or a track is, against a truth or a second segmentation."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.cli._scores import overlap_table, truth_tables
from PolyPoseLib.io.json_records import json_text


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    from PolyPoseLib.data.label_names import TABLES

    parser = new_parser(
        subparsers,
        "evaluate",
        "score a result or a track against a simulation's truth, or a result against a second segmentation",
        "case/result --truth case/truth",
    )
    parser.add_argument("result", type=Path, help="folder that register or track wrote")
    against = parser.add_mutually_exclusive_group(required=True)
    against.add_argument(
        "--truth", type=Path, metavar="DIR", help="truth folder, or sequence, that simulate wrote"
    )
    against.add_argument(
        "--segmentation",
        type=Path,
        metavar="FILE",
        help="labels of the patient as the X-rays saw it, same numbers",
    )
    parser.add_argument("--label-table", choices=TABLES, help="names for the labels of --segmentation")
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the scores."""
    from PolyPoseLib.io.results import load_result
    from PolyPoseLib.io.tracking.track_truths import is_track_truth
    from PolyPoseLib.io.tracking.tracks import is_track

    if arguments.truth and (is_track(arguments.result) or is_track_truth(arguments.truth)):
        from PolyPoseLib.cli._track_scores import track_tables
        from PolyPoseLib.evaluation.tracks import score_track
        from PolyPoseLib.io.tracking.track_truths import load_track_truth
        from PolyPoseLib.io.tracking.tracks import load_track

        scores = score_track(load_track(arguments.result), load_track_truth(arguments.truth))
        text = track_tables
    elif arguments.truth:
        from PolyPoseLib.evaluation.score import score_result
        from PolyPoseLib.io.truths import load_truth

        scores = score_result(load_result(arguments.result), load_truth(arguments.truth))
        text = truth_tables
    else:
        from PolyPoseLib.data.label_names import label_table
        from PolyPoseLib.evaluation.overlap import score_segmentation
        from PolyPoseLib.io.segmentations import read_segmentation

        names = label_table(arguments.label_table) if arguments.label_table else None
        result = load_result(arguments.result)
        segmentation = read_segmentation(arguments.segmentation).renumbered(names or {})
        scores = score_segmentation(result, segmentation, names)
        text = overlap_table
    print(scores_json(scores) if arguments.json else text(scores))
    return 0


def scores_json(scores: dict[str, Any]) -> str:
    """Scores as JSON; what is not finite becomes null."""
    return json_text(scores).rstrip()
