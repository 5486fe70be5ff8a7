"""What an error means on the command line: one sentence and an exit status."""

from __future__ import annotations

import errno

from PolyPoseLib.errors import (
    FAULT_STATUS,
    LESS_MEMORY,
    CancelledError,
    InputError,
    PolyPoseError,
    cut,
    is_out_of_memory,
)

INTERRUPTED = CancelledError.exit_status

_PACKAGES = ("SimpleITK", "numpy", "pydicom", "scipy", "torch")


def ending_of(error: BaseException) -> tuple[str, int]:
    """The sentence, "" for none, and the exit status for an error that ends a command.

    Exit statuses: those of ``PolyPoseError``; 2 also for what the system refuses and for a lack of memory; 130 for an
    interrupt; 70 for everything that should not have happened.
    """
    if isinstance(error, KeyboardInterrupt):
        return f"interrupted; {str(error) or 'no result was written'}", INTERRUPTED
    if isinstance(error, BrokenPipeError):  # the reader of stdout went away: nobody is there to tell
        return "", INTERRUPTED
    if isinstance(error, PolyPoseError):
        return str(error), error.exit_status
    if is_out_of_memory(error):
        return f"memory ran out: {LESS_MEMORY}", InputError.exit_status
    if isinstance(error, OSError):
        sentence = _refused_by_the_system(error)
        if sentence is not None:
            return sentence, InputError.exit_status
    if isinstance(error, ModuleNotFoundError) and error.name in _PACKAGES:
        fix = f"pip install {error.name}"
        return f"a Python package is missing (No module named '{error.name}'): {fix}", FAULT_STATUS
    return (
        f"this is a fault of PolyPose ({type(error).__name__}: {cut(str(error), 500)}): please report it, with what "
        "--debug shows",
        FAULT_STATUS,
    )


def _refused_by_the_system(error: OSError) -> str | None:
    """One sentence for a file that the system does not let anyone read or write; None for all other errors.

    It stands here, once, because the system may refuse nearly every access to a path, even whether it exists.
    """
    where = "" if error.filename is None else f"{error.filename}: "
    if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", None)):
        return f"{where}the disk is full: free some space, or choose another place to write to"
    if error.filename is None:
        return None
    reason = error.strerror or type(error).__name__
    return f"{where}the system refuses this file or folder ({reason}): check its name and permissions"
