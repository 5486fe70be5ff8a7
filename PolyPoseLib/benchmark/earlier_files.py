"""What earlier runs of a system on a case have left: row, field and pictures, which belong together."""

from __future__ import annotations

import shutil
from pathlib import Path

from PolyPoseLib.benchmark.rows import field_path, new_row_path, pictures_path, row_path, unread_name
from PolyPoseLib.benchmark.systems import file_part
from PolyPoseLib.data.benchmark.job import DONE, SKIPPED, CaseSource, RunJob
from PolyPoseLib.io.benchmark.benchmark_folder import ROWS
from PolyPoseLib.io.benchmark.row_files import Row, read_row, write_row


def finished_row(job: RunJob) -> Row | None:
    """The row of an earlier call, when it has scores, nothing of the run has changed, and what is asked is kept."""
    row = read_row(row_path(job))
    if row is None or row["digest"] != job.digest or row["status"] != DONE:
        return None
    missing = (job.keep_field and not field_path(job).is_file()) or (
        job.draw and not pictures_path(job).is_dir()
    )
    return None if missing else row


def forget(job: RunJob) -> None:
    """Remove what earlier runs have left, before anything of another one is put there; raises OSError."""
    for path in (row_path(job), field_path(job)):
        path.unlink(missing_ok=True)
    place = pictures_path(job)
    if place.is_symlink():
        place.unlink()
    elif place.is_dir():
        shutil.rmtree(place)


def put_row(job: RunJob, row: Row) -> None:
    """Put the row of a run that has ended into its place; raises OSError.

    Scores of an earlier run stay where this one could not run: with weights that do not fit, or without a package.
    """
    new_row_path(job).unlink(missing_ok=True)
    if row["status"] == SKIPPED:
        earlier = read_row(row_path(job))
        if earlier is not None and earlier["status"] == DONE:
            return
    if row["status"] != DONE:
        forget(job)
    write_row(row_path(job), row)


def forget_unread(source: CaseSource, folder: Path) -> None:
    """Remove the rows of earlier calls that could not read a source; raises OSError where the system refuses."""
    for path in (folder / ROWS).glob(f"{file_part(unread_name(source))}--*.json"):
        path.unlink(missing_ok=True)
