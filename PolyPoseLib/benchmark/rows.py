"""The rows of a benchmark: their places and their fields, as tables and figures take them."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from PolyPoseLib import __version__
from PolyPoseLib.benchmark.hidden_names import HiddenNames
from PolyPoseLib.benchmark.measures import Measures
from PolyPoseLib.benchmark.systems import file_part
from PolyPoseLib.data.benchmark.job import NOT_SEEN, CaseSource, RunJob
from PolyPoseLib.errors import cut, one_line
from PolyPoseLib.io.benchmark.benchmark_folder import FIELDS, LOGS, PICTURES, ROWS
from PolyPoseLib.io.benchmark.row_files import Row

_LONGEST_REASON = 1000


def pair_name(job: RunJob) -> str:
    """Of the files of a job: case and system."""
    return f"{file_part(job.case.name)}--{file_part(job.system)}"


def row_path(job: RunJob) -> Path:
    """Where the row of a job is written."""
    return Path(job.folder, ROWS, f"{pair_name(job)}.json")


def new_row_path(job: RunJob) -> Path:
    """Where its process writes it; whether it takes the place of an earlier one is decided afterwards."""
    return Path(job.folder, ROWS, f"{pair_name(job)}.new")


def log_path(job: RunJob) -> Path:
    """Where what the process of a job prints is written."""
    return Path(job.folder, LOGS, f"{pair_name(job)}.log")


def field_path(job: RunJob) -> Path:
    """Where the field that a system found is written."""
    return Path(job.folder, FIELDS, f"{pair_name(job)}.h5")


def pictures_path(job: RunJob) -> Path:
    """The folder of the pictures of what a system did."""
    return Path(job.folder, PICTURES, pair_name(job))


def unread_name(source: CaseSource) -> str:
    """In place of the name of a case that could not be read."""
    return f"{source.subject}-{source.views}-unread"


def row_of(job: RunJob, status: str, reason: str, measures: Measures) -> Row:
    """A row without scores."""
    return {
        "case": job.case.name,
        "dataset": job.case.source.dataset,
        "subject": job.case.subject,
        "views": job.case.views,
        "system": job.system,
        "status": status,
        "reason": publishable(reason, job),
        **{name: _known(value) for name, value in dataclasses.asdict(measures).items()},
        "notes": [],
        "scores": {},
        "trained_on": NOT_SEEN,
        "digest": job.digest,
        "case_digest": job.case.digest,
        "system_digest": job.system_digest,
        "weights_digest": job.weights_digest,
        "settings": dataclasses.asdict(job.settings),
        "polypose": __version__,
    }


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def publishable(text: str, job: RunJob) -> str:
    """A sentence on one line, without a patient's name and the long paths that are the same everywhere."""
    text = HiddenNames(job.case.source)(text)
    text = text.replace(f"{job.folder}/", "").replace(f"{job.folder}\\", "")
    return cut(one_line(text), _LONGEST_REASON)
