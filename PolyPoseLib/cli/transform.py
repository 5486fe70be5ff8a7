"""Subcommand transform: carry landmarks, plans, meshes, images and doses to the patient as X-rayed, or back."""

from __future__ import annotations

import argparse
from pathlib import Path

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.errors import InputError, UntrustedResultError


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "transform",
        "carry landmarks, screws, meshes, images, doses and contours from the CT to the patient as X-rayed, or back",
        "case/result plan.mrk.json --output plan_as_xrayed.mrk.json",
    )
    parser.add_argument("result", type=Path, help="folder that register wrote")
    parser.add_argument(
        "input",
        type=Path,
        help="landmarks (.csv with label,x,y,z in LPS mm; .mrk.json; .fcsv), screws (.json), a mesh (.stl, .ply, .obj, "
        ".vtk, .vtp), an image or label map (.nii.gz, .nrrd, .mha), or DICOM RT Dose or RT Structure Set",
    )
    parser.add_argument(
        "--output", type=Path, required=True, metavar="FILE", help="of the same kind; .csv for any points"
    )
    parser.add_argument(
        "--to",
        choices=("xray", "ct"),
        default="xray",
        help="xray: from the CT to the patient as X-rayed; ct: the other way (default: xray)",
    )
    parser.add_argument(
        "--labels",
        action=argparse.BooleanOptionalAction,
        help="an image is a label map, whose values are not mixed, or is none (default: told by its values)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace the file of --output")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Carry the file, say what moved it; raises UntrustedResultError afterwards where the result is not trusted."""
    from PolyPoseLib.cli._destinations import check_writable
    from PolyPoseLib.io.carried.files import carry_file, require_endings
    from PolyPoseLib.io.results import load_result
    from PolyPoseLib.io.whole_files import claimed_file

    source, target = arguments.input, arguments.output
    if not source.is_file():
        raise InputError(f"{source}: there is no such file; check the name and the folder.")
    check_writable(target, "--output")
    if target.exists() and target.samefile(source):
        raise InputError(f"{target}: this is the input itself: choose another --output.")
    if target.exists() and not arguments.overwrite:
        raise InputError(f"{target}: the file exists already: choose another --output, or add --overwrite.")
    if target.resolve().is_relative_to(arguments.result.resolve()):
        raise InputError(
            f"{target}: this lies in the folder of the result, which holds the registration's own files alone: choose "
            "another --output."
        )
    require_endings(source, target)
    with claimed_file(target, arguments.overwrite) as claim:
        result = load_result(arguments.result)
        with claim.whole() as temporary:
            said = carry_file(result, source, temporary, arguments.to, arguments.labels)
    print(f"{said}\nwritten to {target}")
    if result.distrust:
        raise UntrustedResultError(
            f"{target} was written but the result must not be trusted: {result.distrust_clauses}."
        )
    return 0
