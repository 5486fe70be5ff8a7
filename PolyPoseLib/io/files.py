"""Files and folders that are read safely and written whole or not at all."""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PolyPoseLib.errors import InputError

_SPECIAL = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)

_OURS = re.compile(
    r"^(result\.json|transform\.h5|warped_ct\.nii\.gz|warped_labels\.nii\.gz|report\.png)$|^xray_\d+_drr\.nii\.gz$"
)


def refuse_special_file(path: Path, where: str | None = None) -> None:
    """Refuse a pipe, a socket or a device, before it is opened: whoever opens one may wait for ever.

    Links are followed.  A path that leads nowhere is left to whoever opens it, who can say more.

    Parameters
    ----------
    path : Path
        An input, file or folder.
    where : str, optional
        Opening of the sentence, the path when None.

    Raises
    ------
    InputError
        The path leads to something that is neither a file nor a folder.

    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return
    kind = next((kind for is_kind, kind in _SPECIAL if is_kind(mode)), None)
    if kind is not None:
        raise InputError(
            f"{where or path}: this is {kind}, not a file: save what it would deliver as a file and give that."
        )


def read_text(path: Path, what: str, largest: int = 16 << 20) -> str:
    """The text of a file, UTF-8 with or without its mark.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What the caller expects, for the sentences: "the study's JSON file".
    largest : int
        Bytes; larger files are refused unread.

    Raises
    ------
    InputError
        A folder, a pipe or device, too large, absent, unreadable, or no UTF-8 text.

    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; give {what} in it.")
    refuse_special_file(path)
    try:
        size = path.stat().st_size
        if size > largest:
            raise InputError(f"{path}: {size / (1 << 20):.0f} MiB is too large; give {what}.")
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file; give {what}.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: the file is not UTF-8 text; give {what}.") from error
    except OSError as error:
        raise InputError(
            f"{path}: the file cannot be read ({error.strerror}); check its permissions."
        ) from error


def check_destination(folder: str | Path, overwrite: bool) -> None:
    """Refuse a destination that cannot take a result, before hours are spent on it; raises InputError.

    Only a folder that is absent, empty, or an earlier result (with overwrite) will do: nothing else is
    deleted.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: this is a file: choose a folder for --output.")
    parent = folder.resolve().parent
    if not parent.is_dir():
        raise InputError(f"{folder}: the folder {parent} does not exist: make it first.")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(
            f"{folder}: nothing can be written in {parent}: check its permissions or choose another."
        )
    if not folder.is_dir():
        return
    names = sorted(each.name for each in folder.iterdir())
    others = [name for name in names if not _OURS.match(name)]
    if others:
        raise InputError(
            f'{folder}: the folder holds files that are no result ("{others[0]}"): choose a new or empty '
            "folder."
        )
    if names and not overwrite:
        raise InputError(f"{folder}: the folder already holds a result: choose another, or add --overwrite.")
    if folder.is_symlink():
        raise InputError(f"{folder}: this is a link: give the folder that it leads to.")


@contextmanager
def whole_folder(folder: Path, overwrite: bool) -> Iterator[Path]:
    """A temporary sibling that becomes the folder when the block succeeds and vanishes when it does not.

    Raises InputError for what the system refuses (no space, no permission), with the fix.
    """
    check_destination(folder, overwrite)
    target = folder.resolve()
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex[:8]}.partial")
    try:
        temporary.mkdir()
        yield temporary
        _replace(temporary, target)
    except OSError as error:
        raise InputError(_refusal(folder, error)) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _replace(temporary: Path, target: Path) -> None:
    """Put the temporary folder in the target's place; the old one is kept until that has worked."""
    if not target.exists():
        temporary.rename(target)
        return
    old = target.with_name(f".{target.name}.{uuid.uuid4().hex[:8]}.old")
    target.rename(old)
    try:
        temporary.rename(target)
    except OSError:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _refusal(folder: Path, error: OSError) -> str:
    """One sentence for an error of the system."""
    if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", None)):
        reason = "no space is left on the disk: free some, or"
    elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        reason = "writing is not permitted here:"
    else:
        reason = f"the result could not be written ({error.strerror}):"
    return f"{folder}: {reason} choose another --output; nothing was written."


@contextmanager
def replaced_whole(path: Path) -> Iterator[Path]:
    """Give a path beside ``path`` to write to; at the end it takes its place, or is removed when something was raised.

    The name keeps its ending, by which writers choose a format.
    """
    temporary = path.with_name(f".{uuid.uuid4().hex[:8]}-{path.name}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
