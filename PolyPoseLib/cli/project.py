"""Subcommand project: draw a plan of the CT onto the X-rays of a result."""

from __future__ import annotations

import argparse
from pathlib import Path

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.errors import UntrustedResultError


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "project",
        "draw points, screws, meshes and contours of the CT onto the X-rays, where the registration puts them",
        "case/result plan.mrk.json --output case/plan-on-xrays",
    )
    parser.add_argument("result", type=Path, help="folder that register wrote")
    parser.add_argument(
        "plan",
        type=Path,
        nargs="+",
        help="points (.csv with label,x,y,z in LPS mm; .mrk.json; .fcsv), screws (.json), a mesh (.stl, .ply, .obj, "
        ".vtk, .vtp), a label map (.nii.gz, .nrrd), or a DICOM SEG or RT Structure Set; several are drawn together",
    )
    parser.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="new or empty folder")
    parser.add_argument(
        "--study",
        type=Path,
        metavar="JSON",
        help="the study of the result: adds a DICOM Secondary Capture for every X-ray that is DICOM",
    )
    parser.add_argument(
        "--allow-outside", action="store_true", help="read X-rays outside the study's folder if it names them"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Draw and say what could not be drawn; raises UntrustedResultError at the end where the result is not trusted."""
    from PolyPoseLib.io.projected.folder import shown_xrays, write_projections
    from PolyPoseLib.io.projected.plan import read_plan
    from PolyPoseLib.io.results import load_result
    from PolyPoseLib.io.whole_folders import claimed_folder

    with claimed_folder(arguments.output, overwrite=None) as claim:
        result = load_result(arguments.result)
        xrays = shown_xrays(result, arguments.result, arguments.study, arguments.allow_outside)
        parts = [
            part for n, path in enumerate(arguments.plan, start=1) for part in read_plan(result, path, n)
        ]
        with claim.whole() as temporary:
            sentences = write_projections(result, parts, xrays, temporary)
    for sentence in sentences:
        print(sentence)
    files = ", ".join(sorted(each.name for each in arguments.output.iterdir()))
    print(f"Written to {arguments.output}: {files}")
    if result.distrust:
        raise UntrustedResultError(
            f"The pictures were written to {arguments.output} but the result must not be trusted: "
            f"{result.distrust_clauses}."
        )
    return 0
