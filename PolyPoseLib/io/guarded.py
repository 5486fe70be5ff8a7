"""Read an image in a child process, with limits of memory and time, and take it over from there.

For files that the toolkit may not survive and that cannot be checked first, such as lists of other files.  A child that
dies or takes too long costs one sentence.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    import SimpleITK as sitk


@dataclass(frozen=True)
class Limits:
    """What a child may use, where the system can limit it.

    Attributes
    ----------
    cpu_seconds
        Computing time; after it the system ends the child.
    wall_seconds
        Time by the clock, for a child that waits instead of computing.
    memory_bytes
        Address space, and so the largest image.

    """

    cpu_seconds: int
    wall_seconds: int
    memory_bytes: int = 4 << 30


LIST_LIMITS = Limits(cpu_seconds=120, wall_seconds=600, memory_bytes=16 << 30)
"""Of images that are kept in several files."""

_BEGINNING = """
import sys
try:
    import resource
    cpu_seconds, memory = map(int, sys.argv[1:3])
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 1))
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
except (ImportError, ValueError, OSError):
    pass
del sys.argv[1:3]
def refuse(error):
    sys.stdout.write((str(error).strip().splitlines() or [type(error).__name__])[-1].strip()[:300])
    sys.exit(2)
"""
"""What every child begins with: its limits, and the way in which it refuses a file."""

_CHILD = """
kind, source, target = sys.argv[1:]
import SimpleITK as sitk
try:
    sitk.WriteImage(sitk.ReadImage(source, imageIO=kind), target, False)
except Exception as error:
    refuse(error)
"""
"""The child's program: it needs the toolkit alone, and starts within a fraction of a second."""


def read_in_child(path: Path, kind: str, limits: Limits) -> sitk.Image:
    """The image of a file that a child process has read.

    Parameters
    ----------
    path
        The file.
    kind
        Name of the toolkit's reader.
    limits
        What the child may use.

    Returns
    -------
    sitk.Image
        Read from a whole file that the child wrote.

    Raises
    ------
    InputError
        The file is damaged, or the child died or took too long; the text is the reason alone.

    """
    import SimpleITK as sitk

    with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
        target = Path(folder) / "read.mha"
        done = run_child(_CHILD, [kind, path.resolve(), target], limits, folder)
        if done is None:
            raise InputError(
                f"it is damaged: reading it has not ended after {limits.cpu_seconds} seconds of computing"
            )
        if done.returncode == 2:
            reason = " ".join(done.stdout.decode("utf-8", "replace").split())[:300]
            raise InputError(reason or "it is damaged")
        if done.returncode != 0 or not target.is_file():
            raise InputError("it is damaged: the library that reads it does not survive it")
        return sitk.ReadImage(str(target), imageIO="MetaImageIO")


def run_child(
    program: str, arguments: Sequence[object], limits: Limits, folder: str
) -> subprocess.CompletedProcess[bytes] | None:
    """Run a reading program in a process of its own.

    Parameters
    ----------
    program
        Python source, in which sys is imported and refuse(error) ends the child with 2 and the error's last line.
    arguments
        Of the program, as text; its paths are absolute.
    limits
        What it may use.
    folder
        Where it runs.

    Returns
    -------
    subprocess.CompletedProcess or None
        With what it printed; None when it ran out of time.

    """
    given = (limits.cpu_seconds, limits.memory_bytes, *arguments)
    try:
        done = subprocess.run(
            [interpreter(), "-c", _BEGINNING + program, *map(str, given)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=limits.wall_seconds,
            cwd=folder,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
    return None if ran_out_of_time(done.returncode) else done


def interpreter() -> str:
    """Python, also in an application that embeds it: Slicer puts PythonSlicer on its PATH."""
    name = Path(sys.executable or "").name.lower()
    return sys.executable if name.startswith("python") else shutil.which("PythonSlicer") or sys.executable


def ran_out_of_time(status: int) -> bool:
    """Whether the system ended a child because of its computing time."""
    if os.name != "posix":
        return False
    import signal

    return status in (-signal.SIGXCPU, -signal.SIGKILL)
