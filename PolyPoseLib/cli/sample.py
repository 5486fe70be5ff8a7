"""Subcommand sample: public data to try the program on."""

from __future__ import annotations

import argparse
import logging
import os
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
    """Copy a cached sample's files, and nothing else that lies beside them, into a folder.

    Raises InputError when that would replace any.
    """
    from PolyPoseLib.io.samples import FILES

    try:
        target.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            if os.path.lexists(target / name):
                raise InputError(f"{target / name}: the file exists already: choose a new folder.")
        for name in FILES:
            shutil.copyfile(source / name, target / name)
    except OSError as error:
        raise InputError(
            f"{target}: the sample cannot be written there ({error.strerror}): choose another --output."
        ) from error
