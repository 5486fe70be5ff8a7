"""Folders that a person chooses for something new."""

from __future__ import annotations

import itertools
from pathlib import Path


def empty_folder(folder: Path, name: str) -> Path:
    """The folder when it is empty, otherwise one within that does not exist: name, name_1, and so on."""
    if not folder.exists() or not any(folder.iterdir()):
        return folder
    names = itertools.chain([name], (f"{name}_{n}" for n in itertools.count(1)))
    return next(folder / each for each in names if not (folder / each).exists())
