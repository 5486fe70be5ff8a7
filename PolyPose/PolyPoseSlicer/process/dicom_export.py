"""The result as DICOM objects: the core's subcommand `dicom` as a child process on the scene's nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from slicer.i18n import tr as _

from PolyPoseLib.errors import UntrustedResultError

from ..study.ct_files import gather
from ..study.writer import StudyData
from .environment import python_executable
from .job import Job
from .study_run import State, StudyRun, child_sentence, error_of

if TYPE_CHECKING:
    from PolyPoseLib.data.result import Result

PLACEHOLDER = "POLYPOSE"
"""Patient ID of a CT that is not in Slicer's DICOM database."""


class DicomExport(StudyRun):
    """A running export: call `poll` from time to time, on the main thread, until `state.ended`.

    Attributes
    ----------
    output : Path
        The folder, complete when the state is DONE.

    """

    def __init__(
        self,
        study: StudyData,
        result: Callable[[], Result],
        files: Sequence[str],
        output: Path,
        command: list[str] | None = None,
    ) -> None:
        """Start it.

        Parameters
        ----------
        study : StudyData
            The result's CT and bones.
        result : callable
            Makes the result in a thread.
        files : sequence of str
            The CT's DICOM slices; without them the export is for a placeholder patient.
        output : Path
            New or empty folder.
        command : list of str, optional
            Another program than PolyPoseLib, for tests.

        """
        self.output = output
        self._result, self._files = result, list(files)
        super().__init__(study, command or [python_executable(), "-m", "PolyPoseLib"], _("DICOM export"))

    def _write(self) -> Path:
        from PolyPoseLib.io.results import save_result

        study_file = super()._write()
        save_result(self._result(), self._folder / "result", report=False)
        if self._files:
            gather(self._files, self._folder / "ct")
        return study_file

    def _arguments(self, study_file: Path) -> list[str]:
        folder = study_file.parent
        patient = ["--ct", str(folder / "ct")] if self._files else ["--new-patient", PLACEHOLDER]
        return [
            "dicom", str(folder / "result"), "--study", str(study_file), "--output", str(self.output), *patient
        ]  # fmt: skip

    def _child_ended(self, job: Job) -> None:
        untrusted = job.exit_status == UntrustedResultError.exit_status
        if not (job.exit_status == 0 or untrusted) or not (self.output / "README.txt").is_file():
            raise error_of(job.exit_status, job.log, self._what)
        self._end(State.DONE, UntrustedResultError(child_sentence(job.log)) if untrusted else None)
