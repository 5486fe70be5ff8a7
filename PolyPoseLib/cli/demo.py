"""Subcommand demo: from nothing to a scored result."""

from __future__ import annotations

import argparse
import dataclasses
import logging
import shlex
import time
from pathlib import Path

from PolyPoseLib.cli._arguments import add_options, add_progress, merged_options, new_parser
from PolyPoseLib.cli._console import peak_memory_mib
from PolyPoseLib.cli._scores import truth_tables
from PolyPoseLib.cli.simulate import add_simulation, check_simulation, write_simulation
from PolyPoseLib.errors import InputError, UntrustedResultError

_LOG = logging.getLogger(__name__)

DEFAULT_OUTPUT = "polypose-demo"


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    from PolyPoseLib.io.samples import SAMPLES

    parser = new_parser(
        subparsers,
        "demo",
        "fetch a CT, move its bones, take X-rays, register, and compare with the truth",
        "--output demo",
    )
    parser.add_argument(
        "--output",
        type=Path,
        metavar="DIR",
        help=f"new or empty folder (default: {DEFAULT_OUTPUT}, numbered)",
    )
    parser.add_argument(
        "--sample", choices=tuple(SAMPLES), default="pelvis", help="which CT (default: pelvis)"
    )
    parser.add_argument("--json", action="store_true", help="print the scores as JSON")
    add_simulation(parser)
    add_options(parser)
    add_progress(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the demo; raises UntrustedResultError at the end when the result must not be trusted."""
    from PolyPoseLib.cli.evaluate import scores_json
    from PolyPoseLib.cli.register import register_with_progress
    from PolyPoseLib.data.study import Study
    from PolyPoseLib.evaluation.score import score_result
    from PolyPoseLib.io.report_files import REPORT
    from PolyPoseLib.io.samples import fetch_sample
    from PolyPoseLib.io.truths import load_truth

    check_simulation(arguments)
    began = time.monotonic()
    output = _new_folder(arguments.output)
    _LOG.info("fetching the sample CT (%s)", arguments.sample)
    sample = fetch_sample(arguments.sample)
    _LOG.info("moving its bones and taking %d X-rays", arguments.views)
    case = output / "case"
    write_simulation(
        sample / "ct.nii.gz", sample / "labels.nii.gz", sample / "structures.json", case, arguments
    )
    study = Study.load(case / "study.json")
    study = dataclasses.replace(study, options=merged_options(study.options, arguments))
    _LOG.info("registering")
    started = time.monotonic()
    result = register_with_progress(study, arguments.progress)
    seconds = time.monotonic() - started
    result.save(output / "result")
    scores = score_result(result, load_truth(case / "truth"))
    (output / "scores.json").write_text(scores_json(scores) + "\n", encoding="utf-8")
    if arguments.json:
        print(scores_json(scores))
    elif arguments.progress != "json":
        memory = peak_memory_mib()
        print(truth_tables(scores))
        print(
            f"registration: {seconds:.0f} s on {result.device}; whole demo: {time.monotonic() - began:.0f} s",
            end="",
        )
        print(f"; peak memory {memory:.0f} MiB" if memory else "")
        picture = output / "result" / REPORT
        if picture.is_file():
            print(f"picture: {picture}")
        print(f"next: {next_command(output)}")
    if result.distrust:
        raise UntrustedResultError(f"The demo's result must not be trusted: {result.distrust_clauses}.")
    return 0


def next_command(output: Path) -> str:
    """What shows the demo's result, for a shell."""
    words = ("view", output / "result", "--study", output / "case" / "study.json")
    return "python -m PolyPoseLib " + shlex.join(map(str, words))


def _new_folder(wanted: Path | None) -> Path:
    """Make the folder for the demo; the default gets a number when it is taken."""
    folder = wanted or Path(DEFAULT_OUTPUT)
    number = 1
    while wanted is None and folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        number += 1
        folder = Path(f"{DEFAULT_OUTPUT}-{number}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise InputError(f"{folder}: the folder is not empty: choose a new one.")
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror}): choose another --output.") from error
    return folder
