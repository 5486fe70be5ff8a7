"""The panel's initial cameras: the source of each, the search for it, and whether what was found is used."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.errors import CancelledError, PolyPoseError
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS

from ..process.camera_run import CameraRun
from ..process.dependencies import ensure_dependencies
from ..process.study_run import State
from ..scene.cameras import CAMERA_ATTRIBUTE, set_camera
from ..scene.names import free_name
from ..study.camera_source import CameraSource
from ..study.parameters import (
    PolyPoseParameterNode,
    camera_model_of,
    store_camera_model,
    store_xray_sources,
    xray_sources,
)
from ..study.xray_reading import XrayReader
from ..study.xray_source import XraySource
from .camera_text import found_lines, html_of, source_lines
from .path_edit import follow_path, show_path
from .xrays import XraysPart

POLL_MS = 50
_CAMERA_SOURCES = tuple(CameraSource)


@dataclass(frozen=True)
class _Search:
    """A search that is running: of which X-rays, as they were, of which parameter node."""

    run: CameraRun
    parameters: PolyPoseParameterNode
    sources: list[XraySource]


class CameraPart:
    """Chooses camera sources, runs one search at a time, and shows how reliable its result is."""

    def __init__(
        self,
        ui: Any,
        logic: Any,
        requirements: str,
        xrays: XraysPart,
        look_at: Callable[[np.ndarray], None],
        settle: Callable[[], None],
    ) -> None:
        """requirements: path of the list of Python packages that the child needs. look_at: shows an extrinsic.

        settle: stores what the user has just picked.
        """
        self._ui, self._logic, self._requirements = ui, logic, requirements
        self._xrays, self._look_at, self._settle = xrays, look_at, settle
        self._parameters: PolyPoseParameterNode | None = None
        self._search: _Search | None = None
        self._showing = False
        self._timer = qt.QTimer()
        self._timer.interval = POLL_MS
        self._timer.connect("timeout()", self._poll)
        for camera_source in _CAMERA_SOURCES:
            ui.cameraSource.addItem(camera_source.label())
        ui.standardView.addItem(_("all directions"))
        for name in STANDARD_VIEWS:
            ui.standardView.addItem(name)
        ui.calibrationFile.nameFilters = [
            _("Calibration files") + " (*.csv *.json *.txt)",
            _("All files") + " (*)",
        ]
        ui.cameraProgress.setVisible(False)
        ui.cameraSource.connect("currentIndexChanged(int)", self._edited)
        ui.standardView.connect("currentIndexChanged(int)", self._edited)
        follow_path(ui.calibrationFile, self._edited)
        follow_path(ui.cameraModel, self._model_edited)
        ui.rigName.connect("editingFinished()", self._edited)
        ui.findCamera.connect("clicked()", self.press)
        ui.findCameras.connect("clicked()", self.find_all)
        ui.showFoundCamera.connect("clicked()", self.look)
        ui.acceptFoundCamera.connect("clicked()", self.accept)
        ui.discardFoundCamera.connect("clicked()", self.discard)

    @property
    def running(self) -> bool:
        """Whether a search is running."""
        return self._search is not None

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, another X-ray, or one of them changed."""
        self._parameters = parameters
        source = self._source()
        ui = self._ui
        self._showing = True
        fields = source.fields if source is not None else {}
        camera_source = source.camera_source if source is not None else CameraSource.AUTO
        ui.cameraSource.currentIndex = _CAMERA_SOURCES.index(camera_source)
        ui.standardView.currentIndex = max(0, ui.standardView.findText(fields.get("standard_view") or ""))
        show_path(ui.calibrationFile, str(fields.get("calibration") or ""))
        show_path(ui.cameraModel, self._model())
        ui.rigName.text = str(fields.get("rig") or "")
        self._showing = False
        for name in ("cameraSource", "standardView", "calibrationFile", "cameraModel", "rigName"):
            getattr(ui, name).enabled = source is not None
        for name in ("standardView", "standardViewLabel"):
            getattr(ui, name).setVisible(
                camera_source in (CameraSource.SEARCH, CameraSource.LEARNED, CameraSource.AUTO)
            )
        for name in ("cameraModel", "cameraModelLabel"):
            getattr(ui, name).setVisible(camera_source is CameraSource.LEARNED)
        calibrates = camera_source in (CameraSource.AUTO, CameraSource.CALIBRATION)
        for name, field in (("calibrationFile", "calibration"), ("rigName", "rig")):
            for each in (name, f"{name}Label"):
                getattr(ui, each).setVisible(calibrates or bool(fields.get(field)))
        ui.landmarksBox.setVisible(camera_source is CameraSource.LANDMARKS)
        self._show_found(source)
        self._show_buttons()

    def press(self) -> None:
        """The button: find the camera of the selected X-ray, or cancel."""
        if self._search is not None:
            self._search.run.cancel()
            self._show_buttons()
        elif self._xrays.number >= 0:
            self.find([self._xrays.number])

    def find_all(self) -> None:
        """Look for the camera of every X-ray that has none."""
        self.find([row for row, source in enumerate(self._xrays.sources) if self._lacks_camera(source)])

    def find(self, rows: list[int]) -> None:
        """Look for the cameras of some X-rays, each from its own source."""
        self._say("")
        parameters = self._parameters
        if parameters is None:
            return
        if not rows:
            self._say(_("Every X-ray already has an initial camera."))
            return
        self._settle()
        rows = with_rigs(self._xrays.sources, rows)
        try:
            ensure_dependencies(self._requirements)
            run = self._logic.startCameras(rows, parameters)
        except (PolyPoseError, OSError) as error:
            self._say(str(error), uncertain=True)
            return
        self._search = _Search(run, parameters, [self._xrays.sources[row] for row in rows])
        self._ui.cameraProgress.setVisible(True)
        self._ui.cameraProgress.setRange(0, 0)
        self._timer.start()
        self._show_buttons()

    def look(self) -> None:
        """Show what was found for the selected X-ray."""
        source = self._source()
        if source is not None and source.found is not None:
            self._look_at(source.found.extrinsic)

    def accept(self) -> None:
        """Accept the uncertain camera of the selected X-ray."""
        source = self._source()
        if source is not None and source.found is not None:
            self._xrays.change({self._xrays.number: taken(source, source.found, self._xrays.reader)})

    def discard(self) -> None:
        """Discard the camera that was found for the selected X-ray."""
        source = self._source()
        if source is not None and source.found is not None:
            self._xrays.change({self._xrays.number: _forgotten(source)})

    def close(self) -> None:
        """End a running search at once, and leave nothing of it."""
        self._timer.stop()
        if self._search is not None:
            self._search.run.close()
            self._finish()

    def _source(self) -> XraySource | None:
        return self._xrays.source if self._parameters is not None else None

    def _lacks_camera(self, source: XraySource) -> bool:
        """Whether the registration would have to find this X-ray's camera itself."""
        report = self._xrays.reader.report(source)
        if report.xray is None or report.xray.camera == "known":
            return False
        given = source.camera_source is CameraSource.CALIBRATION or source.fields.get("extrinsic") is not None
        if source.starts_from_transform or source.landmark_camera is not None:
            return False
        return not (given and report.xray.extrinsic is not None)

    def _edited(self, *_ignored: Any) -> None:
        """Store the camera source and its settings; a camera found from another source is discarded."""
        source = self._source()
        if self._showing or source is None:
            return
        ui = self._ui
        fields = dict(source.fields)
        view = ui.standardView.currentText if ui.standardView.currentIndex > 0 else None
        path = ui.calibrationFile.currentPath.strip() or None
        rig = ui.rigName.text.strip() or None
        for key, value in (("standard_view", view), ("calibration", path), ("rig", rig)):
            fields.pop(key, None)
            if value is not None:
                fields[key] = value
        if path is None:
            fields.pop("calibration_frame", None)
        camera_source = _CAMERA_SOURCES[ui.cameraSource.currentIndex]
        if fields != source.fields or camera_source is not source.camera_source:
            self._xrays.change(
                {self._xrays.number: replace(_forgotten(source), fields=fields, camera_source=camera_source)}
            )

    def _model_edited(self, *_ignored: Any) -> None:
        """Store the camera model's path, which serves all X-rays."""
        if not self._showing and self._parameters is not None:
            store_camera_model(self._parameters, self._ui.cameraModel.currentPath.strip())

    def _poll(self) -> None:
        """Every 50 ms: take what came, show it, and end when it has ended."""
        search = self._search
        if search is None:
            return
        run = search.run
        state = run.poll()
        self._show_progress(run)
        if not state.ended:
            self._show_buttons()
            return
        self._timer.stop()
        self._finish()
        if state is State.DONE:
            self._store(search, run.found)
        else:
            cancelled = isinstance(run.error, CancelledError)
            self._say(
                _("Cancelled; nothing was changed.") if cancelled else str(run.error), uncertain=not cancelled
            )

    def _store(self, search: _Search, found: dict[int, FoundCamera]) -> None:
        """Use the cameras that are certain and keep the others as proposals; X-rays changed meanwhile stay."""
        sources, asked = xray_sources(search.parameters), search.sources
        certain = uncertain = 0
        for number, camera in found.items():
            if number >= len(asked) or asked[number] not in sources:
                continue
            row = sources.index(asked[number])
            if self._xrays.reader.report(sources[row]).xray is None:
                continue
            if camera.sure:
                certain += 1
                sources[row] = taken(sources[row], camera, self._xrays.reader)
            else:
                uncertain += 1
                sources[row] = replace(sources[row], found=replace(camera, taken=False))
        store_xray_sources(search.parameters, sources)
        text = _("{count} found.").format(count=certain)
        if certain + uncertain < len(found):
            text += " " + _("X-rays that you changed meanwhile were left as they are.")
        if uncertain:
            text += " " + _("{count} uncertain and not in use: select the X-ray and review it.").format(
                count=uncertain
            )
        self._say(text, uncertain=uncertain > 0)

    def _finish(self) -> None:
        self._search = None
        self._ui.cameraProgress.setVisible(False)
        self._say("")
        self._show_buttons()

    def _show_progress(self, run: CameraRun) -> None:
        ui, progress = self._ui, run.progress
        if run.state is State.WRITING:
            self._say(_("Preparing the data..."))
        elif progress is None:
            self._say(_("Starting..."))
        else:
            ui.cameraProgress.setRange(0, max(progress.of, 1))
            ui.cameraProgress.setValue(min(progress.iteration, max(progress.of, 1)))
            text = _("{stage}: {iteration} of {of}").format(
                stage=progress.stage, iteration=progress.iteration, of=progress.of
            )
            self._say(text)

    def _show_found(self, source: XraySource | None) -> None:
        ui = self._ui
        found = source.found if source is not None else None
        report = self._xrays.report()
        if found is not None:
            ui.foundCameraText.text = html_of(found_lines(found), uncertain=not found.sure)
        elif source is not None and report is not None:
            ui.foundCameraText.text = html_of(source_lines(source, report, self._model()), uncertain=False)
        else:
            ui.foundCameraText.text = _("Select an X-ray in the table.")
        waits = found is not None and not found.taken
        ui.showFoundCamera.enabled = found is not None
        ui.acceptFoundCamera.enabled = waits
        ui.discardFoundCamera.enabled = found is not None
        for name in ("showFoundCamera", "acceptFoundCamera", "discardFoundCamera"):
            getattr(ui, name).setVisible(found is not None)
        ui.acceptFoundCamera.setVisible(waits)

    def _show_buttons(self) -> None:
        """The button's text says what it does; its tool tip what is missing."""
        ui, source = self._ui, self._source()
        run = self._search.run if self._search is not None else None
        ui.findCameras.enabled = run is None and source is not None and not self._missing()
        if run is not None:
            ui.findCamera.text = _("Cancelling...") if run.cancelling else _("Cancel")
            ui.findCamera.enabled = not run.cancelling
            ui.findCamera.setToolTip(_("Stop the search; nothing is changed."))
            return
        missing = self._missing()
        if source is not None and source.camera_source in (CameraSource.CARM, CameraSource.CALIBRATION):
            missing = missing or _("This camera source needs no search.")
        if source is not None and source.camera_source is CameraSource.LEARNED and not self._model():
            missing = missing or _("Choose the model file.")
        ui.findCamera.text = _("Find camera")
        ui.findCamera.enabled = source is not None and not missing
        ui.findCamera.setToolTip(missing or _("Find the camera of the selected X-ray."))

    def _model(self) -> str:
        """Path of the camera model, empty when there is none."""
        return camera_model_of(self._parameters) if self._parameters is not None else ""

    def _missing(self) -> str:
        return self._logic.missingInput(self._parameters) if self._parameters is not None else ""

    def _say(self, text: str, uncertain: bool = False) -> None:
        self._ui.cameraStage.text = html_of(text.splitlines(), uncertain)


def with_rigs(sources: Sequence[XraySource], rows: Sequence[int]) -> list[int]:
    """Rows with those of the same rigs, whose cameras are found together."""
    rigs = {sources[row].fields.get("rig") for row in rows} - {None}
    return [n for n, source in enumerate(sources) if n in rows or source.fields.get("rig") in rigs]


def taken(source: XraySource, found: FoundCamera, reader: XrayReader) -> XraySource:
    """The X-ray with a found camera as its initial one: a transform node, the module's own when it has one."""
    source = replace(source, fields={**source.fields, "mirrored": found.mirrored})
    xray = reader.report(source).xray
    if xray is None:
        return source
    node = source.camera_transform
    if node is None or not node.GetAttribute(CAMERA_ATTRIBUTE):
        name = free_name(_("Camera of {name}").format(name=source.name))
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", name)
    set_camera(node, found.camera_of(xray), found.similarity)
    return replace(source, camera_transform=node, found=replace(found, taken=True))


def _forgotten(source: XraySource) -> XraySource:
    """The X-ray without what was found for it."""
    taken_from_it = source.found is not None and source.found.taken
    return replace(source, found=None, camera_transform=None if taken_from_it else source.camera_transform)
