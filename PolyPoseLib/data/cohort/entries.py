"""One study of a cohort, and the names that studies may have."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from PolyPoseLib.errors import InputError, shown

LONGEST_IDENTITY = 100
"""Characters of a study's name, so that files called after it have room for an ending."""

MAX_STUDIES = 1_000_000
"""A larger cohort is refused."""

_IDENTITY = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9._-]*[A-Za-z0-9_-])?")

_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Names that Windows gives to devices."""


@dataclass(frozen=True)
class CohortEntry:
    """One study of a cohort.

    Parameters
    ----------
    identity : str
        Its name, which names its files and nothing else; see ``require_identity``.
    study : Path
        Absolute path of its study.json.
    place : PurePosixPath
        Of its result's folder within the cohort's.

    """

    identity: str
    study: Path
    place: PurePosixPath


def require_identity(text: str, where: str) -> str:
    """A study's name; raises InputError where it could not name a file on every system, or leads elsewhere.

    where: opening of the sentence, such as ``list.csv: line 3``.
    """
    if len(text) > LONGEST_IDENTITY:
        raise InputError(f'{where}: an "id" of {len(text)} characters: give at most {LONGEST_IDENTITY}.')
    if not _IDENTITY.fullmatch(text) or _RESERVED.fullmatch(text):
        raise InputError(
            f'{where}: the "id" {shown(text)} names no file on every system: give letters, digits, ".", "_" and "-", '
            "a letter or digit first and no dot at the end."
        )
    return text


def require_different(entries: Iterable[tuple[str, CohortEntry]], opening: str) -> None:
    """Refuse names that are given twice, capitals not counting, as some file systems have it; raises InputError.

    entries: where each was found, for the sentence, and what.
    """
    seen: dict[str, str] = {}
    for where, entry in entries:
        other = seen.setdefault(entry.identity.casefold(), where)
        if other != where:
            raise InputError(
                f'{opening}: {where} has the "id" "{entry.identity}" of {other} (capitals do not count): give each '
                "study its own."
            )


def require_count(count: int, opening: str) -> None:
    """Refuse an empty cohort and one that is too large; raises InputError."""
    if not count:
        raise InputError(f"{opening}: there is no study: name at least one.")
    if count > MAX_STUDIES:
        raise InputError(f"{opening}: more than {MAX_STUDIES} studies: divide them into several cohorts.")
