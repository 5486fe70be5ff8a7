"""Subcommand structures: propose which labels move together."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.errors import InputError


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    from PolyPoseLib.data.label_names import DETAILS, TABLES

    parser = new_parser(
        subparsers,
        "structures",
        "propose structures and an anchor from a segmentation's labels",
        "labels.nii.gz --label-table totalsegmentator_v2",
    )
    parser.add_argument(
        "segmentation",
        type=Path,
        help="label map, .seg.nrrd with names, folder of masks, or DICOM SEG or RTSTRUCT",
    )
    parser.add_argument(
        "--label-table", choices=TABLES, help="label table whose numbers a plain label map holds"
    )
    parser.add_argument(
        "--detail",
        choices=DETAILS,
        default="regions",
        help="regions: fuse vertebrae and ribs; bones: keep them apart (default: regions)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the proposal as JSON, ready to be pasted into a study."""
    from PolyPoseLib.data.label_names import propose_anchor, propose_structures
    from PolyPoseLib.io.segmentations import read_segmentation

    segmentation = read_segmentation(arguments.segmentation)
    if segmentation.segments:
        labels = [segment.name for segment in segmentation.segments]
    else:
        labels = segmentation.labels_present(0).tolist()
        if labels and not arguments.label_table:
            raise InputError(
                f"{arguments.segmentation}: a label map has no names: say with --label-table whose numbers "
                "it holds."
            )
    groups = propose_structures(labels, arguments.label_table, arguments.detail)
    if not groups:
        raise InputError(f"{arguments.segmentation}: no label is a known bone: write the structures by hand.")
    fields = {"structures": groups, "anchor": propose_anchor(list(groups))}
    if arguments.label_table:
        fields = {"label_table": arguments.label_table, **fields}
    json.dump(fields, sys.stdout, indent=1)
    print()
    return 0
