"""Saving what took long to compute: where the place takes it not, another one is found before anything is lost."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.data.result import Result
from PolyPoseLib.errors import InputError, listed
from PolyPoseLib.io.results import save_result, save_summary

if TYPE_CHECKING:
    from PolyPoseLib.io.whole_folders import FolderClaim


def save_or_rescue(result: Result, claim: FolderClaim) -> Path:
    """Save a result; where that fails, in a folder that the user names, or else without its large files.

    Returns
    -------
    Path
        The folder with the result.

    Raises
    ------
    InputError
        The result was not saved whole; the sentence says why, and where its numbers are.

    """
    try:
        return save_result(result, claim)
    except KeyboardInterrupt as interrupt:
        if claim.written:
            raise KeyboardInterrupt(f"the result was written to {claim.folder}") from interrupt
        raise
    except InputError as error:
        try:
            place = _save_where_the_user_says(result, error)
        except KeyboardInterrupt:
            place = None
        if place is not None:
            return place
        raise InputError(
            f"{str(error).rstrip('.')}. {_save_without_large_files(result, claim.folder)}"
        ) from error


def _save_where_the_user_says(result: Result, error: InputError) -> Path | None:
    """The folder that a person named and that took the result; None when nobody is there, or gives up."""
    while sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty():
        print(f"polypose: {error}", file=sys.stderr)
        print("Another folder for the result (empty to give up): ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline().strip()
        if not answer:
            return None
        try:
            return save_result(result, Path(answer).expanduser())
        except InputError as another:
            error = another
    return None


def _save_without_large_files(result: Result, folder: Path) -> str:
    """Save the motions, cameras and the report near the place, or among the system's temporary files.

    Returns
    -------
    str
        What became of them, as a sentence.

    """
    near = folder.absolute()
    places = (near.parent, Path(tempfile.gettempdir()), Path.cwd(), Path.home())
    for picture in (True, False):
        for place in (_free_name(parent, f"{near.name}-summary") for parent in places):
            try:
                save_summary(result, place, picture)
            except (InputError, OSError):
                continue
            names = listed(sorted(each.name for each in place.iterdir()))
            return f"Without the volumes, the result was saved in {place} ({names})."
    return "Not even the motions could be saved."


def _free_name(parent: Path, name: str) -> Path:
    """A path in a folder that nothing has: the name, or the name with a number."""
    path, number = parent / name, 1
    while path.exists():
        number += 1
        path = parent / f"{name}-{number}"
    return path
