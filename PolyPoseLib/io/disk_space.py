"""Whether a disk takes what shall be written, before it is written and after it has failed."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from pathlib import Path

from PolyPoseLib.errors import InputError

FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
"""Errors of a system whose disk, or whose quota, is full."""

_PROBE_BYTES = 1 << 18


def require_space(place: Path, need: float) -> None:
    """Refuse to begin what the disk has no room for.

    Parameters
    ----------
    place : Path
        What will be written; its folder exists.
    need : float
        Bytes that it will take.

    Raises
    ------
    InputError
        Less is free; the sentence says how much and where.

    """
    folder = place.absolute().parent
    try:
        usage = shutil.disk_usage(folder)
    except OSError:
        return
    if usage.total and usage.free < need:
        raise InputError(
            f"{place}: the disk is full: this needs about {_size(need)}, and {_size(usage.free)} are free in {folder}: "
            "free some space, or choose another --output."
        )


def write_failure(path: Path, error: Exception) -> str:
    """One sentence that says why a file could not be written, as far as the system tells."""
    number = getattr(error, "errno", None)
    if not path.parent.is_dir():
        return f"{path}: the folder {path.parent} does not exist: make it first."
    if number in FULL or takes_nothing(path.parent):
        return f"{path}: the disk is full: free some space, or choose another folder."
    if number in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"{path}: writing is not permitted here: check the permissions, or choose another folder."
    reason = f" ({os.strerror(number)})" if number else ""
    return f"{path}: the file could not be written whole{reason}: check the disk, or choose another folder."


def takes_nothing(folder: Path) -> bool:
    """Whether a disk that refused a file is full: libraries do not say why they failed."""
    try:
        with tempfile.TemporaryFile(dir=folder, buffering=0) as probe:
            probe.write(b"x" * _PROBE_BYTES)
            os.fsync(probe.fileno())
            return os.fstat(probe.fileno()).st_size < _PROBE_BYTES
    except OSError as error:
        return error.errno in FULL


def _size(count: float) -> str:
    """A number of bytes for people."""
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{max(count, 0) / 1e6:.1f} MB"
