"""A search for initial cameras: the core's subcommand `cameras` as a child process on a study of the scene."""

from __future__ import annotations

import json
from pathlib import Path

from slicer.i18n import tr as _

from PolyPoseLib.data.found_camera import FoundCamera, cameras_in_report
from PolyPoseLib.errors import InputError, UntrustedResultError

from ..study.writer import StudyData
from .environment import python_executable
from .job import Job
from .study_run import RunError, State, StudyRun, error_of


class CameraRun(StudyRun):
    """A running search: call `poll` from time to time, on the main thread, until `state.ended`.

    Attributes
    ----------
    found : dict of int to FoundCamera
        By the place in the study's X-rays, uncertain cameras included; empty before it is DONE.

    """

    def __init__(self, study: StudyData, method: str = "auto", command: list[str] | None = None) -> None:
        """Start it for all X-rays of a study that gives no extrinsic for them.

        Parameters
        ----------
        study : StudyData
            The inputs, copied from the scene.
        method : str
            One of PolyPoseLib.registration.cameras.initial.METHODS.
        command : list of str, optional
            Another program than PolyPoseLib, for tests.

        """
        self.found: dict[int, FoundCamera] = {}
        self._method = method
        super().__init__(study, command or [python_executable(), "-m", "PolyPoseLib"], _("search"))

    @property
    def _report(self) -> Path:
        return self._folder / "found.json"

    def _arguments(self, study_file: Path) -> list[str]:
        written = study_file.with_name("STUDY-with-cameras.json")
        return [
            "cameras", str(study_file), "--output", str(written), "--report", str(self._report),
            "--method", self._method, "--progress", "json", "--allow-outside",
        ]  # fmt: skip

    def _child_ended(self, job: Job) -> None:
        if job.exit_status not in (0, UntrustedResultError.exit_status) or not self._report.is_file():
            raise error_of(job.exit_status, job.log, self._what)
        self.found = found_in(self._report)
        self._end(State.DONE, None)


def found_in(report: Path) -> dict[int, FoundCamera]:
    """The cameras of a report by the number of their X-ray; raises RunError when it is damaged."""
    try:
        return cameras_in_report(json.loads(report.read_text(encoding="utf-8")))
    except (OSError, ValueError, InputError) as error:
        raise RunError(_("The result of the search cannot be read: search again.")) from error
