"""The folder of a cohort: made, known again, and held by one run at a time."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PolyPoseLib import __version__
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.outcome_files import OUTCOMES
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import json_text, parse_object
from PolyPoseLib.io.locks import locked
from PolyPoseLib.io.whole_files import replaced_whole

MARK = "cohort.json"
"""The file by which a folder is known to be a cohort's."""

LOGS = "logs"

WORKER_LOGS = "workers"
"""Folder among the logs for what the machines say: there no log of a study, whatever its name, is in the way."""

CLUSTER_LOG = "cluster.log"
"""What the scheduler says, in that folder."""

WORKERS_LOG = "workers.log"
"""What scheduler and workers have kept of that until the end, in that folder."""

VERSION = 1

_LEFT_OVER = re.compile(rf"\.DS_Store|\.([0-9a-f]{{8}}-)?{re.escape(MARK)}(\.polypose-lock)?")
"""What a run that was killed before its mark was written leaves, and what macOS puts everywhere."""


@contextmanager
def opened_cohort(folder: Path, source: Path) -> Iterator[Path]:
    """Hold the folder of a cohort for a run: made where it is absent or empty, gone on with where it is a cohort's.

    Parameters
    ----------
    folder : Path
        Of the cohort.
    source : Path
        The list or folder of studies, which it must neither be nor hold.

    Yields
    ------
    Path
        The folder, resolved.

    Raises
    ------
    InputError
        It holds something else, cannot be made, is or holds the folder of the studies, or another run holds it.

    """
    target = _resolved(folder)
    if target.parent == source.resolve() / "derivatives" and source.is_dir():
        target.parent.mkdir(exist_ok=True)
    _require_place(folder, target, source)
    with locked(target, str(folder)):
        target.mkdir(exist_ok=True)
        with replaced_whole(target / MARK) as path:
            fields = {"version": VERSION, "program": "PolyPose", "polypose": __version__}
            path.write_text(json_text(fields), encoding="utf-8")
        for each in (OUTCOMES, LOGS, f"{LOGS}/{WORKER_LOGS}"):
            (target / each).mkdir(exist_ok=True)
        yield target


def _resolved(folder: Path) -> Path:
    """The path without links; raises InputError where they lead in a circle."""
    try:
        return folder.resolve()
    except RuntimeError as error:  # of Python before 3.13
        raise InputError(f"{folder}: this link leads in a circle: choose another --output.") from error


def _require_place(folder: Path, target: Path, source: Path) -> None:
    """Refuse what cannot be a cohort's folder; raises InputError."""
    if not target.parent.is_dir():
        raise InputError(f"{folder}: the folder {target.parent} does not exist: make it first.")
    if target == source.resolve():
        raise InputError(f"{folder}: this is the folder of the studies: choose another --output.")
    if source.is_dir() and source.resolve().is_relative_to(target):
        raise InputError(f"{folder}: the studies in {source} are inside of it: choose another --output.")
    if not target.exists():
        return
    if not target.is_dir():
        raise InputError(f"{folder}: this is a file: choose a folder for --output.")
    if (target / MARK).is_file():
        fields = parse_object(read_text(target / MARK, "a cohort's folder"), str(folder / MARK))
        if fields.get("program") != "PolyPose" or fields.get("version") != VERSION:
            raise InputError(
                f"{folder}: it is no cohort's folder of this version: choose a new or empty folder."
            )
        return
    stranger = next((each for each in sorted(os.listdir(target)) if not _LEFT_OVER.fullmatch(each)), None)
    if stranger is not None:
        raise InputError(
            f'{folder}: the folder holds files that are no cohort\'s ("{stranger}"): choose a new or empty folder.'
        )
