"""What a process is told by its variables, and what it says by its log and its end."""

from __future__ import annotations

import os
import signal
from pathlib import Path

OPENING = "polypose: "
"""Of the sentence by which the command line ends."""

_THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS",
)

_TAIL_BYTES = 1 << 16


def child_environment(threads: int) -> dict[str, str]:
    """The variables of a process of this package: how many threads it has, and where the package is."""
    package = str(Path(__file__).resolve().parents[2])
    paths = [package, *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "MPLBACKEND": "Agg"}
    return environment | dict.fromkeys(_THREAD_VARIABLES, str(threads))


def last_sentence(log: Path, began: int) -> str:
    """The last sentence of the program in a log, from a byte on; empty where there is none."""
    with log.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(began, size - _TAIL_BYTES))
        lines = stream.read().decode("utf-8", "replace").splitlines()
    return next((each.removeprefix(OPENING) for each in reversed(lines) if each.startswith(OPENING)), "")


def signal_name(number: int) -> str:
    """SIGKILL of 9."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
