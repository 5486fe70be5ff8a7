"""A BIDS-like data set as a cohort: sub-XX[/ses-YY]/sub-XX[_ses-YY][_key-value]_study.json.

BIDS has no CT and no X-rays yet. Names follow its rules for subjects, sessions and entities, and what it does not know
is listed in .bidsignore (``docs/cohorts.md``). A study's file is the study.json of this program, whose paths start
from its own folder: ``ct/sub-XX_ct.nii.gz``, ``xray/sub-XX_acq-ap_xray.dcm``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from PolyPoseLib.data.cohort.entries import CohortEntry, require_count, require_different, require_identity
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, nonempty, parse_object

DESCRIPTION = "dataset_description.json"

STUDY_SUFFIX = "_study.json"

SOURCE_IGNORED = (f"*{STUDY_SUFFIX}", "ct", "xray")
"""Lines of the .bidsignore of such a data set, which the validator then finds sound."""

RESULT_SUFFIX = "_polypose"
"""Of the folder of a result, after the study's name."""

_SUBJECT, _SESSION = re.compile(r"sub-[0-9A-Za-z]+"), re.compile(r"ses-[0-9A-Za-z]+")
_ENTITIES = re.compile(r"(?:_[a-z]+-[0-9A-Za-z]+)*")


def is_data_set(folder: Path) -> bool:
    """Whether a folder says that it is a data set."""
    return (folder / DESCRIPTION).is_file()


def read_data_set(folder: Path) -> tuple[CohortEntry, ...]:
    """The studies of all subjects and sessions, in the order of their names.

    Raises
    ------
    InputError
        The description is damaged, there is no study, or a study's name does not repeat its subject and session.

    """
    _require_description(folder / DESCRIPTION)
    found = [(f'"{entry.identity}"', entry) for entry in _studies(folder.resolve())]
    if not found:
        raise InputError(
            f"{folder}: no subject holds a study: name it sub-01/sub-01{STUDY_SUFFIX} or "
            f"sub-01/ses-01/sub-01_ses-01{STUDY_SUFFIX}."
        )
    require_count(len(found), str(folder))
    require_different(found, str(folder))
    return tuple(entry for _, entry in found)


def _require_description(path: Path) -> None:
    """Refuse a description without its required fields; raises InputError."""
    record = Record(
        parse_object(read_text(path, "the data set's description"), str(path)), opening=f"{path}: "
    )
    record.required("Name", nonempty)
    record.required("BIDSVersion", nonempty)


def _studies(folder: Path) -> Iterator[CohortEntry]:
    for subject in _folders(folder, _SUBJECT):
        yield from _studies_in(subject, PurePosixPath(subject.name))
        for session in _folders(subject, _SESSION):
            yield from _studies_in(session, PurePosixPath(subject.name, session.name))


def _folders(folder: Path, pattern: re.Pattern[str]) -> list[Path]:
    """Subfolders of a pattern, by name."""
    return sorted(each for each in folder.iterdir() if pattern.fullmatch(each.name) and each.is_dir())


def _studies_in(folder: Path, place: PurePosixPath) -> Iterator[CohortEntry]:
    """The studies of one subject or session."""
    opening = "_".join(place.parts)
    for each in sorted(folder.glob(f"[!.]*{STUDY_SUFFIX}")):  # macOS leaves "._..." beside files
        identity = each.name.removesuffix(STUDY_SUFFIX)
        if not identity.startswith(opening) or not _ENTITIES.fullmatch(identity[len(opening) :]):
            raise InputError(
                f'{each}: in this folder a study is called "{opening}{STUDY_SUFFIX}", with further parts such as '
                f'"{opening}_acq-standing{STUDY_SUFFIX}" where there are several: rename it.'
            )
        require_identity(identity, str(each))
        yield CohortEntry(identity, each, place / f"{identity}{RESULT_SUFFIX}")
