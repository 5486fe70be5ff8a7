"""Subcommand dicom: a result as DICOM objects, for planning systems."""

from __future__ import annotations

import argparse
from pathlib import Path

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.errors import UntrustedResultError


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    from PolyPoseLib.io.dicom_export.parts import PARTS

    parser = new_parser(
        subparsers,
        "dicom",
        "write a result as DICOM: CT series, segmentation, contours and registrations",
        "case/result --study case/study.json --output case/dicom",
    )
    parser.add_argument("result", type=Path, help="folder that register wrote")
    parser.add_argument(
        "--study",
        type=Path,
        required=True,
        metavar="JSON",
        help="the study's JSON file, which names CT and labels",
    )
    parser.add_argument("--output", type=Path, required=True, metavar="DIR", help="new or empty folder")
    parser.add_argument(
        "--ct",
        type=Path,
        metavar="DIR",
        help="DICOM slices of the same CT, where the study names another file of it",
    )
    parser.add_argument(
        "--ct-series", metavar="UID", help="UID or number of the CT's series where --ct holds several"
    )
    parser.add_argument(
        "--new-patient",
        metavar="ID",
        help="for a CT that is not DICOM: write it and the rest for a placeholder patient of this ID",
    )
    parser.add_argument(
        "--leave-out",
        action="append",
        default=[],
        choices=PARTS,
        help="do not write this part; may be given several times",
    )
    parser.add_argument(
        "--allow-outside", action="store_true", help="read files outside the study's folder if it names them"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the objects; raises UntrustedResultError afterwards when the result must not be trusted."""
    from PolyPoseLib.io.dicom_export.export import export_dicom
    from PolyPoseLib.io.dicom_export.inputs import CtChoice
    from PolyPoseLib.io.results import load_result

    choice = CtChoice(arguments.ct, arguments.ct_series, arguments.new_patient, arguments.allow_outside)
    result = load_result(arguments.result)
    folder = export_dicom(result, arguments.study, arguments.output, choice, arguments.leave_out)
    print(folder)
    if result.distrust:
        raise UntrustedResultError(
            f"The result was written to {folder}, marked as not trusted in every series, because it must not be "
            f"trusted: {result.distrust_clauses}."
        )
    return 0
