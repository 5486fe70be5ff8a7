"""The folder that the files of an X-ray's entry lie in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError


def study_folder(image: Path, fields: Mapping[str, Any]) -> Path:
    """Folder that relative paths of an entry start from.

    Parameters
    ----------
    image
        The image's path.
    fields
        The entry. Where the path ends as its field "image" says, the folder is what stands before; otherwise it is
        the image's own.

    """
    named = Path(str(fields.get("image") or image.name))
    parts = named.parts
    if not named.is_absolute() and ".." not in parts and image.parts[-len(parts) :] == parts:
        return image.parents[len(parts) - 1]
    return image.parent


def file_of_field(folder: Path, value: str | Path, field: str, notes: Notes) -> Path:
    """Path that a field gives.

    Parameters
    ----------
    folder
        Where a relative path starts.
    value
        A text must stay inside the folder; a Path was checked by the caller.
    field
        The field's name, for the sentence.
    notes
        Names the X-ray.

    Raises
    ------
    InputError
        The text leads outside the folder.

    """
    target = folder / value
    if isinstance(value, str) and not target.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f'{notes.where}: the "{field}" lies outside the study\'s folder; move it into the folder.'
        )
    return target
