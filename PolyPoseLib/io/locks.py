"""Locks on a place in the file system, which one process holds while it works towards what it will write there.

The lock is the system's own on a hidden file beside the place: it ends with the process, however that ends, and the
file that a killed process leaves is taken over by the next one.
"""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from PolyPoseLib.errors import InputError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_LONGEST_NAME = 150
"""Bytes of a name that is kept as it is in the names beside it; file systems allow 255 in all."""

_WINDOWS_BYTE = 1 << 20
"""The byte that is locked on Windows, where a locked byte cannot be read: far behind the text."""

_PAUSE_SECONDS = 0.02

_NO_LOCKS = {
    errno.ENOLCK,
    errno.ENOSYS,
    errno.EINVAL,
    getattr(errno, "ENOTSUP", errno.ENOSYS),
    getattr(errno, "EOPNOTSUPP", errno.ENOSYS),
}
"""Errors of file systems that know no locks."""


def hidden_stem(target: Path) -> str:
    """How the hidden names beside a path begin, without the dot: its name, abbreviated where it is very long."""
    name = target.name
    if len(os.fsencode(name)) <= _LONGEST_NAME:
        return name
    digest = hashlib.sha256(os.fsencode(name)).hexdigest()[:16]
    return f"{name[:20]}-{digest}"


def lock_path(target: Path) -> Path:
    """The hidden file whose lock stands for a path."""
    return target.with_name(f".{hidden_stem(target)}.polypose-lock")


@contextmanager
def locked(target: Path, what: str, wait_seconds: float = 0.0) -> Iterator[bool]:
    """Hold the lock of a path for a block.

    Parameters
    ----------
    target : Path
        What will be written; its folder exists.
    what : str
        The path as the user gave it, for the sentence.
    wait_seconds : float
        How long to wait for another process that holds it.

    Yields
    ------
    bool
        False on a file system that knows no locks: then nothing is held.

    Raises
    ------
    InputError
        Another run holds the lock.
    OSError
        The system refuses to make the hidden file.

    """
    path = lock_path(target)
    until = time.monotonic() + wait_seconds
    while True:
        try:
            descriptor = _take(path)
            break
        except _Held as held:
            if time.monotonic() >= until:
                raise InputError(
                    f"{what}: another run of PolyPose{held} is writing here: wait until it has ended, or choose "
                    "another place."
                ) from None
        time.sleep(_PAUSE_SECONDS)
    try:
        yield descriptor is not None
    finally:
        if descriptor is not None:
            _release(descriptor, path)


class _Held(Exception):
    """Another process holds the lock; the text says which, as far as it is known."""


def _take(path: Path) -> int | None:
    """The descriptor of a lock file that is ours now; None where there are no locks. Raises _Held."""
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOFOLLOW", 0)
    while True:
        descriptor = os.open(path, flags, 0o666)
        try:
            if not _lock(descriptor):
                with suppress(OSError):
                    path.unlink()
                os.close(descriptor)
                return None
            if _is_at(descriptor, path):
                os.ftruncate(descriptor, 0)
                os.write(descriptor, f"{os.getpid()} {platform.node()}\n".encode("utf-8", "replace"))
                return descriptor
        except _Held as held:
            owner = _owner(descriptor)
            os.close(descriptor)
            raise _Held(owner) from held
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # whoever held it has removed the file meanwhile


def _lock(descriptor: int) -> bool:
    """Lock an open file; False where there are no locks. Raises _Held when another has it."""
    try:
        if sys.platform == "win32":
            os.lseek(descriptor, _WINDOWS_BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            os.lseek(descriptor, 0, os.SEEK_SET)
        else:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            return False
        if error.errno in (errno.EACCES, errno.EAGAIN, errno.EDEADLK):
            raise _Held from error
        raise
    return True


def _release(descriptor: int, path: Path) -> None:
    """Remove the lock file and give the lock back; Windows removes no file that is open."""
    if sys.platform != "win32":
        with suppress(OSError):
            path.unlink()
    os.close(descriptor)
    if sys.platform == "win32":
        with suppress(OSError):
            path.unlink()


def _is_at(descriptor: int, path: Path) -> bool:
    """Whether the open file still is the one of that name."""
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path, follow_symlinks=False))
    except FileNotFoundError:
        return False


def _owner(descriptor: int) -> str:
    """Who holds a lock, as its file says, for the sentence: " (process 7)"."""
    try:
        os.lseek(descriptor, 0, os.SEEK_SET)
        number, _, host = os.read(descriptor, 300).decode("utf-8", "replace").strip().partition(" ")
    except OSError:
        return ""
    if not number.isdigit():
        return ""
    where = "" if host == platform.node() else f" on {host[:100]}"
    return f" (process {number}{where})"
