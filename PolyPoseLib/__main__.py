"""The command line: python -m PolyPoseLib SUBCOMMAND."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import traceback
from collections.abc import Sequence

from PolyPoseLib import __version__
from PolyPoseLib.errors import PolyPoseError

INTERRUPTED = 130
FAILED = 1


def build_parser() -> argparse.ArgumentParser:
    """The parser of all subcommands."""
    from PolyPoseLib.commands import commands

    parser = argparse.ArgumentParser(
        prog="python -m PolyPoseLib",
        description="Align one CT to two or more X-rays of the same patient in another posture, "
        "bone by bone. Research software, not for clinical decisions.",
        epilog="example:\n  python -m PolyPoseLib demo --output demo",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"PolyPose {__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="SUBCOMMAND")
    for command in commands():
        command.add_parser(subparsers)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one subcommand; returns 0, 2 (wrong input), 3 (not to be trusted), 130 (interrupted) or 1 (a
    fault).
    """
    arguments = build_parser().parse_args(argv)
    from PolyPoseLib.commands._console import start_logging

    start_logging(arguments.quiet)
    _interrupt_on_termination()
    try:
        return arguments.run(arguments)
    except KeyboardInterrupt:
        return _fail("interrupted; no result was written", INTERRUPTED, arguments.debug)
    except PolyPoseError as error:
        return _fail(str(error), error.exit_status, arguments.debug)
    except MemoryError:
        return _fail(
            "memory ran out: use --preset fast, a coarser CT, or a larger machine", FAILED, arguments.debug
        )
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return INTERRUPTED
    except Exception as error:
        fault = f"an unexpected fault ({type(error).__name__}: {error})"
        return _fail(f"{fault}; please report it with the output of --debug", FAILED, arguments.debug)


def _fail(message: str, status: int, debug: bool) -> int:
    """Say what went wrong on stderr in one sentence; with debug, show where."""
    if debug:
        traceback.print_exc()
    print(f"polypose: {' '.join(message.split())}", file=sys.stderr, flush=True)
    return status


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
