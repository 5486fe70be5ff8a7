"""What native libraries write to the process's stderr by themselves: for the log, not for people.

The image toolkit, its HDF5 and its DICOM readers write warnings and errors there, up to forty lines for one full disk.
Only a process that belongs to PolyPose alone, the command line, may take its stderr away from them for a moment.
"""

from __future__ import annotations

import logging
import os
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO

_LOG = logging.getLogger(__name__)

_STDERR = 2
_MOST_BYTES = 1 << 16

_one_at_a_time = threading.Lock()
_ours = threading.Event()


@contextmanager
def stderr_is_ours() -> Iterator[None]:
    """Allow ``native_output_logged`` to work for a block: nobody else in the process writes to stderr."""
    _ours.set()
    try:
        yield
    finally:
        _ours.clear()


@contextmanager
def native_output_logged() -> Iterator[None]:
    """Log at the level DEBUG, for a block, whatever native code writes to stderr.

    Without ``stderr_is_ours``, or when another thread is in such a block, nothing happens.
    """
    if not _ours.is_set() or not _one_at_a_time.acquire(blocking=False):
        yield
        return
    try:
        with _scratch_file() as kept, _redirected(kept):
            yield
    finally:
        _one_at_a_time.release()


def _scratch_file() -> BinaryIO:
    """A file that vanishes; the null device where none can be made, on a full disk for example."""
    try:
        return tempfile.TemporaryFile()
    except OSError:
        return open(os.devnull, "r+b")


@contextmanager
def _redirected(kept: BinaryIO) -> Iterator[None]:
    """Let the descriptor of stderr lead to a file for a block, and log the file afterwards."""
    try:
        stderr = os.dup(_STDERR)
    except OSError:  # closed
        yield
        return
    try:
        os.dup2(kept.fileno(), _STDERR)
        yield
    finally:
        os.dup2(stderr, _STDERR)
        os.close(stderr)
        with suppress(OSError):
            kept.seek(0)
            for line in kept.read(_MOST_BYTES).decode("utf-8", "replace").splitlines():
                if line.strip():
                    _LOG.debug("native library: %s", line.strip())
