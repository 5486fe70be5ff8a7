"""Scripts that let a shell complete subcommands, options and files, made by shtab from the parser itself."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

SHELLS = ("bash", "zsh", "tcsh")

COMMAND = "polypose"
"""The command that is completed: shells complete a program, not ``python -m``."""

MISSING = "polypose: shell completion is made by shtab, which is not installed: pip install shtab\n"


def add_print_completion(parser: argparse.ArgumentParser) -> None:
    """Add the option that prints a script and ends the program."""
    parser.add_argument(
        "--print-completion",
        choices=SHELLS,
        action=_PrintCompletion,
        help="print a script by which the shell completes this command, and exit",
    )


class _PrintCompletion(argparse.Action):
    """Prints the script for the shell that was named."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        try:
            import shtab
        except ImportError:
            parser.exit(2, MISSING)
        parser.prog = COMMAND
        for action in _all_actions(parser):
            if action.type is Path:
                kind = shtab.DIRECTORY if action.metavar == "DIR" else shtab.FILE
                action.complete = kind  # type: ignore[attr-defined]
        print(shtab.complete(parser, shell=str(values)))
        parser.exit(0)


def _all_actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The arguments of a parser and of its subcommands."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for each in action.choices.values():
                yield from _all_actions(each)
        yield action
