"""Renames in one step that the os module lacks: two names exchange what they stand for, a new name replaces none."""

from __future__ import annotations

import ctypes
import errno
import os
import sys
from pathlib import Path

_AT_FDCWD = -100
_LINUX_EXCHANGE = 2
_MACOS_EXCHANGE = 2

_UNSUPPORTED = {
    errno.ENOSYS,
    errno.EINVAL,
    errno.EXDEV,
    getattr(errno, "ENOTSUP", errno.EINVAL),
    getattr(errno, "EOPNOTSUPP", errno.EINVAL),
}
"""Errors by which a system, or a file system, says that it cannot do this at all."""


def exchange(first: Path, second: Path) -> bool:
    """Let two paths of one file system change places in one step: at no time is either of them absent.

    Parameters
    ----------
    first, second : Path
        Files or folders, both of which exist.

    Returns
    -------
    bool
        False when the system or the file system cannot do this; nothing has changed then.

    Raises
    ------
    OSError
        The system refuses.

    """
    number = _exchange_on_this_system(os.fsencode(first), os.fsencode(second))
    if number == 0:
        return True
    if number in _UNSUPPORTED:
        return False
    raise OSError(number, os.strerror(number), str(second))


def _exchange_on_this_system(first: bytes, second: bytes) -> int:
    """Number of the system's error, 0 for none."""
    try:
        library = ctypes.CDLL(None, use_errno=True)
        if sys.platform == "linux":
            failed = library.renameat2(_AT_FDCWD, first, _AT_FDCWD, second, ctypes.c_uint(_LINUX_EXCHANGE))
        elif sys.platform == "darwin":
            failed = library.renamex_np(first, second, ctypes.c_uint(_MACOS_EXCHANGE))
        else:
            return errno.ENOSYS
    except (AttributeError, OSError, TypeError):  # a C library without the call, or Windows, which has none
        return errno.ENOSYS
    return ctypes.get_errno() if failed else 0


def rename_folder_to_new(folder: Path, new: Path) -> None:
    """Rename a folder to a name that nothing has, or only an empty folder.

    Raises
    ------
    FileExistsError
        The name is taken; nothing has changed.
    OSError
        The system refuses.

    """
    if sys.platform == "win32" and new.is_dir() and not any(new.iterdir()):
        new.rmdir()
    try:
        folder.rename(new)
    except OSError as error:
        if error.errno in (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(new)) from error
        raise


def rename_file_to_new(file: Path, new: Path) -> None:
    """Rename a file to a name that nothing has.

    Raises
    ------
    FileExistsError
        The name is taken; nothing has changed.
    OSError
        The system refuses.

    """
    if sys.platform == "win32":
        file.rename(new)
        return
    try:
        os.link(file, new, follow_symlinks=False)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        if os.path.lexists(new):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(new)) from None
        file.rename(new)
    else:
        file.unlink()
