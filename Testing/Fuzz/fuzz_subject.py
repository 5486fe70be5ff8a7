"""What one changed file is to a target."""

from __future__ import annotations

import io
import zipfile
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


def in_archive(path: Path, ending: str) -> tuple[bytes, Callable[[bytes], bytes]]:
    """The content of one file of a zip archive, and what makes the archive with another content of it."""
    with zipfile.ZipFile(path) as archive:
        inside = {name: archive.read(name) for name in archive.namelist()}
    changed_name = next(name for name in inside if name.endswith(ending))

    def packed(changed: bytes) -> bytes:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            for name, content in inside.items():
                archive.writestr(name, changed if name == changed_name else content)
        return stream.getvalue()

    return inside[changed_name], packed
