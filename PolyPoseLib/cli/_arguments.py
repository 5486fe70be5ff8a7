"""Arguments and the help's layout that several subcommands share."""

from __future__ import annotations

import argparse
from typing import Any

from PolyPoseLib.data.options import CHOICES, Options


def new_parser(
    subparsers: argparse._SubParsersAction, name: str, summary: str, example: str, **settings: Any
) -> argparse.ArgumentParser:
    """A subcommand's parser whose help ends with an example: its arguments, which follow its name."""
    parser = subparsers.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"example:\n  %(prog)s {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        **settings,
    )
    parser.add_argument("--debug", action="store_true", help="show the full traceback of an error")
    parser.add_argument("--quiet", action="store_true", help="log nothing but errors")
    return parser


def add_options(parser: argparse.ArgumentParser, threads: str = "all") -> None:
    """The options of a registration that are common enough for a flag of their own; they win over the
    study's.  threads: how many there are where the flag is not given, for the help.
    """
    parser.add_argument(
        "--preset", choices=CHOICES["preset"], help="accuracy against time (default: default)"
    )
    parser.add_argument("--device", choices=CHOICES["device"], help="where to compute (default: auto)")
    parser.add_argument("--threads", type=int, metavar="N", help=f"CPU threads (default: {threads})")
    parser.set_defaults(computes=True)  # what every computation needs is checked before it is imported
    parser.add_argument("--seed", type=int, metavar="N", help="seed of every random choice (default: 0)")


def add_progress(parser: argparse.ArgumentParser) -> None:
    """How to show progress."""
    parser.add_argument(
        "--progress",
        choices=("json", "bar", "none"),
        default="bar",
        help="bar: for people, on stderr; json: one object a line on stdout; none (default: bar)",
    )


def given_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options that were given on the command line."""
    names = ("preset", "device", "threads", "seed", "preview")
    given = {name: getattr(arguments, name, None) for name in names}
    return {name: value for name, value in given.items() if value is not None}


def merged_options(study_options: Any, arguments: argparse.Namespace) -> dict[str, Any]:
    """A study's options with those of the command line in their place; raises InputError for wrong values."""
    return Options.from_dict(study_options).updated(**given_options(arguments)).to_dict()
