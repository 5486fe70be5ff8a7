"""Files that are read safely."""

from __future__ import annotations

import stat
from pathlib import Path

from PolyPoseLib.errors import InputError

_SPECIAL = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
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
