"""What one changed file is to a target."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Subject:
    """One file that is changed.

    path: where the changed bytes go; whole: the bytes that are changed; read: the call that reads what they are in;
    packed: makes the file of the changed bytes, where a checksum or compression would hide the change; part_of: name of
    a folder that a sentence may give instead of the file's, where what is wrong shows in several files together.
    """

    path: Path
    whole: bytes
    read: Callable[[], Any]
    packed: Callable[[bytes], bytes] = bytes
    part_of: str = ""


def whole_file(path: Path, read: Callable[[Path], Any]) -> Subject:
    """A file that exists and is read by itself."""
    return Subject(path, path.read_bytes(), lambda: read(path))
