"""Segments bones with the extension MONAIAuto3DSeg, whose logic runs a child process in the background."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import qt
from slicer.i18n import tr as _

from PolyPoseLib.data.label_names import structure_of
from PolyPoseLib.errors import PolyPoseError

from .segmentation_task import SegmentationTask

_POLL_MS = 200


class MonaiAuto3DSeg:
    """The extension's own logic, told through the events that it calls back with."""

    name = "MONAIAuto3DSeg"

    def __init__(self) -> None:
        """Import the extension's module."""
        self._logic: Any = importlib.import_module("MONAIAuto3DSeg").MONAIAuto3DSegLogic()
        self._model = ""
        self._run: _Run | None = None

    def prepare(self, tell: Callable[[str], None]) -> None:
        """Let the extension install its Python packages, after it has asked, and download the model."""
        logic = self._logic
        logic.logCallback = tell
        if not logic.DEPENDENCY_HANDLER.dependenciesInstalled:
            logic.setupPythonRequirements()
        self._model = model_with_most_bones(logic.models)
        logic.modelPath(self._model)

    def run(self, task: SegmentationTask, ended: Callable[[Exception | None], None]) -> None:
        """Start to segment and return."""
        self._logic.logCallback = task.tell
        self._logic.useStandardSegmentNames = True
        self._run = run = _Run(self._logic, task, ended)
        try:
            run.info = self._logic.process(
                [task.ct],
                task.segmentation,
                self._model,
                waitForCompletion=False,
                eventCallback=run.event,
            )
        except Exception as error:
            run.end(error)

    def cancel(self) -> None:
        """Kill the child process."""
        if self._run is not None:
            self._run.task.cancelled = True
            self._run.poll()


class _Run:
    """One run; info: what the extension's `process` returned, which has to be kept, for its end kills the process."""

    def __init__(self, logic: Any, task: SegmentationTask, ended: Callable[[Exception | None], None]) -> None:
        self._logic, self.task, self._ended = logic, task, ended
        self.info: Any = None
        self._over = False
        self._imported = False
        self._timer = qt.QTimer()
        self._timer.interval = _POLL_MS
        self._timer.connect("timeout()", self.poll)
        self._timer.start()

    def poll(self) -> None:
        """Stop it when it is no longer wanted; end it when an exception in its import has kept it from saying so."""
        if self._over:
            return
        try:
            self.task.check()
        except PolyPoseError as error:
            self._stop(error)
            return
        if self._imported:
            self.end(
                PolyPoseError(_("MONAIAuto3DSeg's result could not be read: see the application's log."))
            )

    def event(self, code: Any, info: Any) -> None:
        """What the extension calls back with: an EventCode, and its list of tasks."""
        if self._over:
            return
        if self.info is None:
            self.info = info
        if code.name == "TASK_PROCESSING_STARTED":
            self.task.tell(_("computing"))
        elif code.name == "TASK_PROCESSING_ENDED":
            self.poll()  # the extension does not import the result of a task that is stopped here
        elif code.name == "TASK_IMPORTING_RESULTS_STARTED":
            self.task.tell(_("reading the result"))
        elif code.name == "TASK_IMPORTING_RESULTS_ENDED":
            self._imported = True
        elif code.name == "TASKLIST_PROCESSING_ENDED":
            self.end(_error_of(info))

    def end(self, error: Exception | None) -> None:
        """It has ended; only the first call counts."""
        self._timer.stop()
        if not self._over:
            self._over = True
            self._ended(error)

    def _stop(self, error: Exception) -> None:
        self._over = True  # what the extension calls back with from now on is its own end
        self._timer.stop()
        if self.info is not None:
            self._logic.cancelProcessing(self.info)
        self._ended(error)


def model_with_most_bones(models: Iterable[Mapping[str, Any]]) -> str:
    """ID of the model for one CT that tells most bones apart; the first of several, which are quick versions of it."""
    usable = [
        model
        for model in models
        if not model["deprecated"] and model["imagingModality"] == "CT" and len(model["inputs"]) == 1
    ]
    counts = [
        len({structure_of(name, "bones") for name in model.get("segmentNames") or ()} - {None})
        for model in usable
    ]
    if not any(counts):
        raise PolyPoseError(_("MONAIAuto3DSeg offers no model of bones: update the extension."))
    return str(usable[counts.index(max(counts))]["id"])


def _error_of(info: Any) -> Exception | None:
    codes = [task.backgroundProcess.procReturnCode for task in info.segmentationTasks]
    failed = [code for code in codes if code != 0]
    if not failed:
        return None
    return PolyPoseError(
        _("MONAIAuto3DSeg ended with the code {code}: see the application's log.").format(
            code=getattr(failed[0], "name", failed[0])
        )
    )
