"""The tab Carry along's Export: the result as DICOM objects, and these in Slicer's DICOM database."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import CancelledError, PolyPoseError

from ..process.dependencies import ensure_dependencies
from ..process.dicom_export import PLACEHOLDER, DicomExport
from ..process.study_run import State
from ..study.ct_files import dicom_files
from ..study.parameters import PolyPoseParameterNode
from ..study.scene_result import missing_for_export, scene_study, whole_result
from .new_folder import empty_folder

POLL_MS = 50


class ExportPart:
    """Writes the result as DICOM in a child process."""

    def __init__(self, ui: Any, requirements: str) -> None:
        """requirements: path of the list of Python packages that the child needs."""
        self._button, self._state, self._requirements = ui.exportDicom, ui.exportState, requirements
        self._parameters: PolyPoseParameterNode | None = None
        self._run: DicomExport | None = None
        self._placeholder = False
        self._timer = qt.QTimer()
        self._timer.interval = POLL_MS
        self._timer.connect("timeout()", self._poll)
        self._button.connect("clicked()", self.press)
        self._show_button()

    @property
    def running(self) -> bool:
        """Whether something is being written."""
        return self._run is not None

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, or the same that changed."""
        self._parameters = parameters
        self._show_button()

    def press(self) -> None:
        """The button: ask for a folder and export, or cancel."""
        if self._run is not None:
            self._run.cancel()
            self._show_button()
            return
        window = self._button.window()
        folder = qt.QFileDialog.getExistingDirectory(window, _("Export as DICOM into a folder"))
        if folder:
            self.start(str(folder))

    def start(self, folder: str) -> None:
        """Export into a folder, or a new one within where it is not empty."""
        parameters = self._parameters
        if parameters is None or self._run is not None:
            return
        try:
            ensure_dependencies(self._requirements)
            study = scene_study(parameters)
            files = dicom_files(parameters.ct)
            result = whole_result(parameters, study)
            self._run = DicomExport(study, result, files, empty_folder(Path(folder), "PolyPose-DICOM"))
        except (PolyPoseError, OSError) as error:
            self._state.text = str(error)
            return
        self._state.text = _("Writing DICOM...")
        self._placeholder = not files
        self._timer.start()
        self._show_button()

    def close(self) -> None:
        """End a running export at once, and leave nothing of it."""
        self._timer.stop()
        run, self._run = self._run, None
        if run is not None:
            run.close()
            self._state.text = ""
            self._show_button()

    def _poll(self) -> None:
        run = self._run
        if run is None or not run.poll().ended:
            return
        self._timer.stop()
        self._run = None
        self._show_button()
        if run.state is State.DONE:
            self._done(run)
        elif isinstance(run.error, CancelledError):
            self._state.text = _("Cancelled; nothing was changed.")
        else:
            self._state.text = str(run.error)

    def _done(self, run: DicomExport) -> None:
        lines = [_("Written to {folder}.").format(folder=run.output)]
        if run.error is not None:
            lines = [str(run.error)]
        if self._placeholder:
            lines.append(
                _(
                    "The CT is not in Slicer's DICOM database: everything, the CT too, was written for the placeholder "
                    "patient {name}."
                ).format(name=PLACEHOLDER)
            )
        self._state.text = "\n".join(lines)
        if has_database() and slicer.util.confirmYesNoDisplay(
            _("Add the exported DICOM objects to Slicer's DICOM database?"), windowTitle=_("Export as DICOM")
        ):
            self._state.text = "\n".join([*lines, import_folder(run.output)])

    def _show_button(self) -> None:
        """The button exports or cancels; its tooltip says what is missing."""
        button = self._button
        if self._run is not None:
            button.text = _("Cancel")
            button.enabled = not self._run.cancelling
            button.setToolTip(_("Stop the export; nothing is written."))
            return
        missing = missing_for_export(self._parameters)
        button.text = _("Export as DICOM...")
        button.enabled = not missing
        button.setToolTip(
            missing
            or _(
                "Write the warped CT, the segmentation, every bone's motion and the deformation as DICOM objects, for "
                "planning systems."
            )
        )


def has_database() -> bool:
    """Whether Slicer has a DICOM database that is open."""
    database = getattr(slicer, "dicomDatabase", None)
    return database is not None and bool(database.isOpen)


def import_folder(folder: Path) -> str:
    """Add a folder's objects to Slicer's DICOM database; returns what to say of it."""
    try:
        from DICOMLib import DICOMUtils

        DICOMUtils.importDicom(str(folder), slicer.dicomDatabase, copyFiles=True)
    except Exception as error:
        return _("Slicer's DICOM module could not add them ({reason}): add the folder there.").format(
            reason=str(error) or type(error).__name__
        )
    return _("Added to Slicer's DICOM database.")
