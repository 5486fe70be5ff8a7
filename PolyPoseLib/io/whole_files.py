"""Single files that are written whole or not at all, as :mod:`PolyPoseLib.io.whole_folders` writes folders."""

from __future__ import annotations

import os
import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.locks import hidden_stem, locked
from PolyPoseLib.io.renames import rename_file_to_new
from PolyPoseLib.io.signals import deferred_signals

_WAIT_SECONDS = 20.0
"""A single file is written in a moment: whoever finds another process at it waits."""


class FileClaim:
    """A file that this process alone may write until it gives the claim back.

    Parameters
    ----------
    path : Path
        Its folder exists.
    overwrite : bool
        Whether a file of that name is replaced.

    """

    def __init__(self, path: Path, overwrite: bool) -> None:
        self.path = path
        self.overwrite = overwrite

    @contextmanager
    def whole(self) -> Iterator[Path]:
        """Give a path beside the file to write to; at the end it takes the file's place, or is removed after an error.

        The name keeps its ending, by which writers choose a format.  Raises InputError where the file may not be
        replaced and is there at the end.
        """
        temporary = self.path.with_name(f".{uuid.uuid4().hex[:8]}-{self._hidden_name()}")
        try:
            yield temporary
            with deferred_signals():
                self._put(temporary)
        finally:
            temporary.unlink(missing_ok=True)

    def _put(self, temporary: Path) -> None:
        """Put the finished file into its place."""
        if self.overwrite:
            os.replace(temporary, self.path)
            return
        try:
            rename_file_to_new(temporary, self.path)
        except FileExistsError as error:
            raise InputError(
                f"{self.path}: a file appeared here meanwhile, and it is not replaced: choose another name, or add "
                "--overwrite."
            ) from error

    def remove_stale(self) -> None:
        """Remove what killed processes have left beside the file."""
        pattern = re.compile(rf"\.[0-9a-f]{{8}}-{re.escape(self._hidden_name())}")
        for name in os.listdir(self.path.parent):
            if pattern.fullmatch(name):
                with suppress(OSError):
                    self.path.with_name(name).unlink()

    def _hidden_name(self) -> str:
        """The file's name; where it is very long, an abbreviation with its endings."""
        stem = hidden_stem(self.path)
        return stem if stem == self.path.name else stem + "".join(self.path.suffixes[-2:])[-20:]


@contextmanager
def claimed_file(path: Path, overwrite: bool = True, wait_seconds: float = 0.0) -> Iterator[FileClaim]:
    """Claim a file before the work whose result it will hold.

    Parameters
    ----------
    path : Path
        Its folder exists.
    overwrite : bool
        Whether a file of that name is replaced.
    wait_seconds : float
        How long to wait for another run that writes it.

    Yields
    ------
    FileClaim
        Its ``whole`` writes the file.

    Raises
    ------
    InputError
        Another run writes it.
    OSError
        The system refuses.

    """
    claim = FileClaim(path, overwrite)
    with locked(path, str(path), wait_seconds) as held:
        if held:
            claim.remove_stale()
        yield claim


@contextmanager
def replaced_whole(path: Path | FileClaim) -> Iterator[Path]:
    """Claim and write a file: a path beside it that takes its place at the end, or is removed after an error."""
    if isinstance(path, FileClaim):
        with path.whole() as temporary:
            yield temporary
        return
    with claimed_file(path, wait_seconds=_WAIT_SECONDS) as claim, claim.whole() as temporary:
        yield temporary
