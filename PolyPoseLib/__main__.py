"""The command line: polypose SUBCOMMAND, or python -m PolyPoseLib SUBCOMMAND."""

from __future__ import annotations

import argparse
import io
import os
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from pathlib import PurePath

from PolyPoseLib import __version__


def build_parser() -> argparse.ArgumentParser:
    """The parser of all subcommands."""
    from PolyPoseLib.cli import commands
    from PolyPoseLib.cli._completion import add_print_completion

    parser = argparse.ArgumentParser(
        prog=_invoked_as(),
        description="Align one CT to two or more X-rays of the same patient in another posture, "
        "bone by bone. Research software, not for clinical decisions.",
        epilog="example:\n  %(prog)s demo --output demo",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"PolyPose {__version__}")
    add_print_completion(parser)
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="SUBCOMMAND")
    for command in commands():
        command.add_parser(subparsers)
    return parser


def _invoked_as() -> str:
    """The command as it was typed: the installed script, or the module."""
    return "polypose" if PurePath(sys.argv[0]).stem.lower() == "polypose" else "python -m PolyPoseLib"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one subcommand.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process when None.

    Returns
    -------
    int
        Exit status: 0 done, 2 wrong input, 3 a result not to be trusted, 70 a fault of the program, 130 interrupted.

    """
    _replace_closed_streams()
    debug = any(len(each) > 4 and "--debug".startswith(each) for each in (sys.argv if argv is None else argv))
    try:
        status = _run(argv)
        sys.stdout.flush()
        return status
    except (Exception, KeyboardInterrupt) as error:
        from PolyPoseLib.cli._endings import ending_of

        if debug:
            traceback.print_exc()
        sentence, status = ending_of(error)
        if sentence:
            print(f"polypose: {' '.join(sentence.split())}", file=sys.stderr, flush=True)
        _give_up_stdout()
        return status


def _run(argv: Sequence[str] | None) -> int:
    """Run one subcommand; whatever goes wrong is raised."""
    # Between the many short loops idle threads of OpenMP would spin, and take the cores from what runs beside them.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    arguments = build_parser().parse_args(argv)
    from PolyPoseLib.cli._console import libraries_quiet, start_logging

    start_logging(arguments.quiet, arguments.debug)
    _print_any_text()
    _interrupt_on_termination()
    if getattr(arguments, "computes", False):
        _require_memory_to_start()
    with libraries_quiet(arguments.debug):
        return arguments.run(arguments)


def _require_memory_to_start() -> None:
    """Refuse to start where the libraries alone do not fit: some end the process when they find no memory."""
    from PolyPoseLib.data.memory_need import MemoryNeed
    from PolyPoseLib.io.machine_memory import require_memory

    require_memory(MemoryNeed.of_program(), "A registration of any study")


def _give_up_stdout() -> None:
    """Let stdout lead nowhere when it takes nothing any more (a reader that went away, a full disk).

    The interpreter writes what is left at its end, and would end with a status of its own.
    """
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _replace_closed_streams() -> None:
    """Give the process a stdout and a stderr that lead nowhere, where it was started without."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 (open until the end)


def _print_any_text() -> None:
    """Let stdout write names that its encoding lacks as escapes: a table must not fail after hours of computation."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def _interrupt_on_termination() -> None:
    """Let a request to end stop the run as Ctrl+C does; a second one ends the process at once."""
    if threading.current_thread() is not threading.main_thread():
        return

    def stop(number: int, _frame: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise KeyboardInterrupt

    for name in ("SIGINT", "SIGTERM", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), stop)


if __name__ == "__main__":
    sys.exit(main())
