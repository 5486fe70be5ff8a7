"""What may be opened as an input: files and folders, and nothing that never ends."""

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

    Args:
        path: an input, file or folder.
        where: opening of the sentence, the path when None.

    Raises:
        InputError: the path leads to something that is neither a file nor a folder.

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
