"""Output folders that a file in them marks as of one program: runs go on in them, and others stay untouched."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PolyPoseLib import __version__
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import json_text, parse_object
from PolyPoseLib.io.whole_files import replaced_whole

PROGRAM = "PolyPose"


@dataclass(frozen=True)
class FolderMark:
    """What tells a kind of folder from others.

    Attributes
    ----------
    kind : str
        For sentences: "cohort".
    file : str
        Name of the file that marks it.
    version : int
        Of its layout.

    """

    kind: str
    file: str
    version: int

    def require_place(self, folder: Path, target: Path) -> dict[str, Any] | None:
        """Refuse what cannot be such a folder; raises InputError.

        Parameters
        ----------
        folder : Path
            As the user gave it, for sentences.
        target : Path
            The same, resolved; its parent exists.

        Returns
        -------
        dict or None
            What the mark of an earlier run says; None where the folder is absent or empty.

        """
        if not target.exists():
            return None
        if not target.is_dir():
            raise InputError(f"{folder}: this is a file: choose a folder for --output.")
        if (target / self.file).is_file():
            fields = parse_object(
                read_text(target / self.file, f"a {self.kind}'s folder"), str(folder / self.file)
            )
            if fields.get("program") != PROGRAM or fields.get("version") != self.version:
                raise InputError(
                    f"{folder}: it is no {self.kind}'s folder of this version: choose a new or empty folder."
                )
            return fields
        # What a run that was killed before its mark was written leaves, and what macOS puts everywhere.
        left_over = re.compile(rf"\.DS_Store|\.([0-9a-f]{{8}}-)?{re.escape(self.file)}(\.polypose-lock)?")
        stranger = next((each for each in sorted(os.listdir(target)) if not left_over.fullmatch(each)), None)
        if stranger is not None:
            raise InputError(
                f'{folder}: the folder holds files that are no {self.kind}\'s ("{stranger}"): choose a new or empty '
                "folder."
            )
        return None

    def write(self, target: Path, **fields: str) -> None:
        """Mark a folder; fields: what else the mark says."""
        with replaced_whole(target / self.file) as path:
            own = {"version": self.version, "program": PROGRAM, "polypose": __version__}
            path.write_text(json_text(own | fields), encoding="utf-8")


def resolved_places(folder: Path, source: Path) -> tuple[Path, Path]:
    """An output folder and its source without links; raises InputError where these lead in a circle."""
    try:
        return folder.resolve(), source.resolve()
    except RuntimeError as error:  # of Python before 3.13
        raise InputError(f"{folder}: this link leads in a circle: choose another --output.") from error


def require_parent(folder: Path, target: Path) -> None:
    """Raise InputError when the folder in which an output folder would be made does not exist."""
    if not target.parent.is_dir():
        raise InputError(f"{folder}: the folder {target.parent} does not exist: make it first.")
