"""Subcommand sample: public data to try the program on."""

from __future__ import annotations

import argparse
import logging
import shutil
from pathlib import Path

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.errors import InputError

_LOG = logging.getLogger(__name__)


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    from PolyPoseLib.io.samples import SAMPLES

    parser = new_parser(
        subparsers,
        "sample",
        "fetch a public CT with labels, check it and keep it in a cache",
        "pelvis --output pelvis",
    )
    parser.add_argument("name", choices=tuple(SAMPLES), help="which one")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR", help="new folder for the copy")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Fetch the sample and copy it."""
    from PolyPoseLib.io.samples import fetch_sample, sample_named

    source = fetch_sample(arguments.name)
    copy_sample(source, arguments.output)
    for warning in sample_named(arguments.name).warnings:
        _LOG.warning(warning)
    print(arguments.output)
    return 0


def copy_sample(source: Path, target: Path) -> None:
    """Copy a cached sample's files into a folder; raises InputError when that would replace any."""
    try:
        target.mkdir(parents=True, exist_ok=True)
        for file in sorted(source.iterdir()):
            if (target / file.name).exists():
                raise InputError(f"{target / file.name}: the file exists already: choose a new folder.")
        for file in sorted(source.iterdir()):
            shutil.copyfile(file, target / file.name)
    except OSError as error:
        raise InputError(
            f"{target}: the sample cannot be written there ({error.strerror}): choose another --output."
        ) from error
