"""The folder of a cohort: made, known again, and held by one run at a time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.outcome_files import OUTCOMES
from PolyPoseLib.io.locks import locked
from PolyPoseLib.io.marked_folders import FolderMark, require_parent, resolved_places

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

_MARK = FolderMark("cohort", MARK, VERSION)


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
    target, resolved_source = resolved_places(folder, source)
    if target.parent == resolved_source / "derivatives" and source.is_dir():
        target.parent.mkdir(exist_ok=True)
    require_parent(folder, target)
    if target == resolved_source:
        raise InputError(f"{folder}: this is the folder of the studies: choose another --output.")
    if source.is_dir() and resolved_source.is_relative_to(target):
        raise InputError(f"{folder}: the studies in {source} are inside of it: choose another --output.")
    _MARK.require_place(folder, target)
    with locked(target, str(folder)):
        target.mkdir(exist_ok=True)
        _MARK.write(target)
        for each in (OUTCOMES, LOGS, f"{LOGS}/{WORKER_LOGS}"):
            (target / each).mkdir(exist_ok=True)
        yield target
