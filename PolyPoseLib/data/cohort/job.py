"""What is sent to a worker: one study, what it takes, and where its files go."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.data.cohort.settings import StudySettings


@dataclass(frozen=True)
class StudyJob:
    """One study for a worker, which sees the same files.

    Parameters
    ----------
    identity : str
        The study's name.
    study : str
        Path of its study.json.
    folder : str
        Of the cohort.
    place : str
        Of the result's folder within the cohort's.
    memory_mib : int
        That it is expected to take.
    settings : StudySettings
        How it is registered.

    """

    identity: str
    study: str
    folder: str
    place: str
    memory_mib: int
    settings: StudySettings
