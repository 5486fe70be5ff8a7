"""The command line: polypose SUBCOMMAND, or python -m PolyPoseLib SUBCOMMAND."""

from __future__ import annotations

import argparse
import errno
import io
import os
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from pathlib import PurePath

from PolyPoseLib import __version__
from PolyPoseLib.errors import InputError, PolyPoseError

INTERRUPTED = 130
FAILED = 1


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
        Exit status: 0 done, 1 an unexpected fault, 2 wrong input, 3 a result not to be trusted, 130 interrupted.

    """
    arguments = build_parser().parse_args(argv)
    from PolyPoseLib.cli._console import start_logging

    start_logging(arguments.quiet)
    _print_any_text()
    _interrupt_on_termination()
    try:
        return arguments.run(arguments)
    except KeyboardInterrupt as interrupt:
        written = str(interrupt) or "no result was written"
        return _fail(f"interrupted; {written}", INTERRUPTED, arguments.debug)
    except PolyPoseError as error:
        return _fail(str(error), error.exit_status, arguments.debug)
    except MemoryError:
        return _fail(
            "memory ran out: use --preset fast, a coarser CT, or a larger machine", FAILED, arguments.debug
        )
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return INTERRUPTED
    except OSError as error:
        message = _refused_by_the_system(error)
        if message is None:
            return _fail(_fault(error), FAILED, arguments.debug)
        return _fail(message, InputError.exit_status, arguments.debug)
    except Exception as error:
        return _fail(_fault(error), FAILED, arguments.debug)


def _fault(error: Exception) -> str:
    """What to say of an error that nobody expected."""
    return (
        f"an unexpected fault ({type(error).__name__}: {error}); please report it with the output of --debug"
    )


def _refused_by_the_system(error: OSError) -> str | None:
    """One sentence for a file that the system does not let anyone read or write; None for all other errors.

    It stands here, once, because the system may refuse nearly every access to a path, even whether it exists.
    """
    if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", None)):
        return "no space is left on the disk: free some, or choose another place to write to"
    if error.filename is None:
        return None
    reason = error.strerror or type(error).__name__
    return (
        f"{error.filename}: the system refuses this file or folder ({reason}): check its name and permissions"
    )


def _fail(message: str, status: int, debug: bool) -> int:
    """Say what went wrong on stderr in one sentence; with debug, show where."""
    if debug:
        traceback.print_exc()
    print(f"polypose: {' '.join(message.split())}", file=sys.stderr, flush=True)
    return status


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
