"""The studies of a cohort, from a list, from a folder of studies, or from a BIDS-like data set."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from PolyPoseLib.data.cohort.entries import CohortEntry, require_count, require_different, require_identity
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.bids_layout import is_data_set, read_data_set
from PolyPoseLib.io.cohort.list_file import read_list
from PolyPoseLib.io.files import refuse_special_file

STUDY_FILE = "study.json"

RESULTS = "studies"
"""Folder of the results within the cohort's."""


def read_entries(source: Path, allow_outside: bool) -> tuple[CohortEntry, ...]:
    """The studies that a list or folder names, in its order.

    Parameters
    ----------
    source : Path
        LIST.csv with the columns id and study, a folder whose subfolders hold a study.json each, or a data set.
    allow_outside : bool
        Whether studies may lie outside of the list's folder.

    Raises
    ------
    InputError
        Nothing is there, a name could not be a file's or is given twice, or a study lies where it must not.

    """
    source = Path(source)
    refuse_special_file(source)
    if source.is_dir():
        if is_data_set(source):
            return read_data_set(source)
        return _read_folder(source)
    rows = read_list(source)
    found = []
    for line, identity, name in rows:
        where = f"line {line}"
        require_identity(identity, f"{source}: {where}")
        study = _study_of_list(source, where, name, allow_outside)
        found.append((where, CohortEntry(identity, study, PurePosixPath(RESULTS, identity))))
    require_count(len(found), str(source))
    require_different(found, str(source))
    return tuple(entry for _, entry in found)


def _study_of_list(source: Path, where: str, name: str, allow_outside: bool) -> Path:
    """The absolute path of a study that a list names; whether it exists is found out when it is registered."""
    if not name or "\0" in name:
        raise InputError(f'{source}: {where} has no "study": give the path of its study.json.')
    folder = source.resolve().parent
    try:
        study = (folder / name).resolve()
        if study.is_dir():
            study = study / STUDY_FILE
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f'{source}: {where}: the "study" cannot be followed ({reason}): correct it.'
        ) from error
    if not allow_outside and not study.is_relative_to(folder):
        raise InputError(
            f'{source}: {where}: the "study" is outside of the list\'s folder: move the list beside the studies, or '
            "allow it with --allow-outside."
        )
    return study


def _read_folder(folder: Path) -> tuple[CohortEntry, ...]:
    """The study of every subfolder that holds one, in the order of their names."""
    found = []
    for each in sorted(folder.resolve().iterdir()):
        study = each / STUDY_FILE
        if not each.name.startswith(".") and study.is_file():
            require_identity(each.name, f'{folder}: the folder "{each.name}"')
            found.append((f'"{each.name}"', CohortEntry(each.name, study, PurePosixPath(RESULTS, each.name))))
    if not found:
        raise InputError(
            f"{folder}: no folder in it holds a {STUDY_FILE}: give the folder of the studies' folders, a data set with "
            "dataset_description.json, or a LIST.csv."
        )
    require_count(len(found), str(folder))
    require_different(found, str(folder))
    return tuple(entry for _, entry in found)
