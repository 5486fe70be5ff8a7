"""Subcommand view: show a result on a local web page."""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.errors import InputError


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "view",
        "show a result on a web page that only this computer serves and only you can open",
        "case/result --study case/study.json",
    )
    parser.add_argument("result", type=Path, help="folder that register wrote")
    parser.add_argument(
        "--study",
        type=Path,
        metavar="STUDY.json",
        help="the study that was registered: adds its CT and X-rays",
    )
    parser.add_argument(
        "--points", type=Path, metavar="FILE", help="points of the CT to carry to the patient as X-rayed"
    )
    parser.add_argument(
        "--port", type=int, default=0, metavar="N", help="port of the loopback (default: a free one)"
    )
    parser.add_argument("--no-browser", action="store_true", help="only print the address")
    parser.add_argument(
        "--allow-outside", action="store_true", help="let the study name files outside of its own folder"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until Ctrl+C, which is how it ends."""
    from PolyPoseLib.viewer.loading import load_content
    from PolyPoseLib.viewer.serve import require_packages, serve

    if not 0 <= arguments.port <= 65535:
        raise InputError(f"--port is {arguments.port}: give a number from 0 to 65535.")
    require_packages()
    content = load_content(arguments.result, arguments.study, arguments.points, arguments.allow_outside)
    with suppress(KeyboardInterrupt):
        serve(content, arguments.port, not arguments.no_browser)
    return 0
