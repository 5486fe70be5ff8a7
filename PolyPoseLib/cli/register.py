"""Subcommand register: a study in, a result folder out."""

from __future__ import annotations

import argparse
import dataclasses
import logging
from pathlib import Path

from PolyPoseLib.cli._arguments import add_options, add_progress, merged_options, new_parser
from PolyPoseLib.cli._console import progress_display, table
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import UntrustedResultError

_LOG = logging.getLogger(__name__)


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "register",
        "register the CT of a study to its X-rays",
        "case/study.json --output case/result",
    )
    parser.add_argument("study", type=Path, help="the study's JSON file")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR", help="folder for the result")
    parser.add_argument("--overwrite", action="store_true", help="replace an earlier result in DIR")
    parser.add_argument(
        "--allow-outside", action="store_true", help="read files outside the study's folder if it names them"
    )
    parser.add_argument(
        "--preview", metavar="FILE", help="write a coarse displacement field here while running"
    )
    add_options(parser)
    add_progress(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Register and save; raises UntrustedResultError after saving when the result must not be trusted."""
    from PolyPoseLib.cli._saving import save_or_rescue
    from PolyPoseLib.io.disk_space import require_space
    from PolyPoseLib.io.report_files import PAGE, REPORT
    from PolyPoseLib.io.results import expected_bytes
    from PolyPoseLib.io.whole_folders import claimed_folder

    with claimed_folder(arguments.output, arguments.overwrite) as claim:
        study = Study.load(arguments.study, allow_outside=arguments.allow_outside)
        study = dataclasses.replace(study, options=merged_options(study.options, arguments))
        require_space(arguments.output, expected_bytes(study))
        result = register_with_progress(study, arguments.progress)
        output = save_or_rescue(result, claim)
    if arguments.progress != "json":
        print(motion_table(result))
        print("".join(f"\n{line}" for line in doubt_lines(result)), end="")
        print(f"\nResult: {output}")
        for what, file in (("Page", output / PAGE), ("Picture", output / REPORT)):
            if file.is_file():
                print(f"{what}: {file}")
    if result.distrust:
        raise UntrustedResultError(
            f"The result was saved in {output} but must not be trusted: {result.distrust_clauses}."
        )
    return 0


def register_with_progress(study: Study, kind: str) -> Result:
    """Register a study with its progress shown."""
    from PolyPoseLib.pipeline import register

    display = progress_display(kind)
    try:
        result = register(study, progress=display)
    finally:
        display.close()
    known = {*study.warnings, *(f"{xray.name}: {text}" for xray in study.xrays for text in xray.warnings)}
    for warning in result.warnings:
        if warning not in known:
            _LOG.warning(warning)
    return result


def doubt_lines(result: Result) -> list[str]:
    """Why not to rely on a bone's pose, a line for each that is doubtful."""
    return [f"{name}: {'; '.join(each.doubts)}" for name, each in result.structures.items() if each.doubts]


def motion_table(result: Result) -> str:
    """The bones' motions from the CT's posture to the X-rays' as a table."""
    rows = [
        (name, each.rotation_deg, *(float(value) for value in each.translation_mm))
        for name, each in result.structures.items()
    ]
    return table(("structure", "rotation deg", "left mm", "back mm", "up mm"), rows)
