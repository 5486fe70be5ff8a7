"""The panel's button that segments the CT's bones with an installed extension, and proposes their structures."""

from __future__ import annotations

import contextlib
import logging
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError, one_line

from ..process.extensions import installed_segmenter, offer_segmenter
from ..process.segmentation_task import SegmentationTask, Segmenter
from ..scene.names import free_name
from ..study.parameters import PolyPoseParameterNode

_LONGEST_LINE = 100
"""Characters of a line of the extension's log that the panel shows."""


@dataclass
class _Active:
    """A segmentation that is being made; task: None while packages are installed."""

    parameters: PolyPoseParameterNode
    ct: Any
    segmenter: Segmenter
    task: SegmentationTask | None = None


class SegmentPart:
    """Starts, shows and ends one segmentation.

    propose: groups the segments that the panel shows into structures.
    """

    def __init__(self, ui: Any, propose: Callable[[], None]) -> None:
        """Connect the button of the loaded form."""
        self._ui, self._propose = ui, propose
        self._parameters: PolyPoseParameterNode | None = None
        self._active: _Active | None = None
        self._unproposed = ""
        ui.segmentButton.connect("clicked()", self.press)
        self._say("")
        self._show_button()

    @property
    def running(self) -> bool:
        """Whether a CT is being segmented."""
        return self._active is not None

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, or the same that changed; a new segmentation's structures are proposed once."""
        self._parameters = parameters
        chosen = parameters.segmentation if parameters is not None else None
        if chosen is not None and chosen.GetID() == self._unproposed:
            self._unproposed = ""
            self._propose()
        self._show_button()

    def press(self) -> None:
        """The button: segment, or cancel."""
        active = self._active
        if active is None:
            self.start()
        elif active.task is not None:
            active.segmenter.cancel()
            self._show_button()

    def start(self) -> None:
        """Segment the chosen CT; returns at once or, with an extension that waits itself, when it has ended."""
        parameters = self._parameters
        if self._active is not None or parameters is None or parameters.ct is None:
            return
        try:
            segmenter = installed_segmenter()
        except Exception as error:
            logging.warning("An extension that segments bones cannot be loaded", exc_info=error)
            self._say(
                _("The extension cannot be loaded ({reason}): update it.").format(reason=_reason(error))
            )
            return
        if segmenter is None:
            self._say(offer_segmenter())
            return
        self._active = active = _Active(parameters, parameters.ct, segmenter)
        slicer.app.connect("lastWindowClosed()", self.close)  # while an extension waits, nothing else says so
        self._show_button()
        self._say(_("{name} is installing what it needs...").format(name=segmenter.name))
        slicer.app.processEvents()
        try:
            with _wait_cursor():
                segmenter.prepare(lambda line: self._tell(active, line))
        except Exception as error:
            self._ended(active, error)
            return
        if self._active is active:
            self._run(active)

    def close(self) -> None:
        """End a running segmentation at once, and leave nothing of it."""
        active = self._active
        if active is not None:
            self._forget()
            if active.task is not None:
                active.segmenter.cancel()
                _remove(active.task.segmentation)
            self._say("")
            self._show_button()
        self._unproposed = ""

    def _run(self, active: _Active) -> None:
        if slicer.mrmlScene.GetNodeByID(active.ct.GetID()) is not active.ct:
            self._ended(active, PolyPoseError(_("The CT was deleted meanwhile: choose another.")))
            return
        name = free_name(_("{ct} bones").format(ct=active.ct.GetName()))
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode", name)
        node.CreateDefaultDisplayNodes()
        active.task = SegmentationTask(active.ct, node, lambda line: self._tell(active, line))
        self._tell(active, _("starting"))
        self._show_button()
        active.segmenter.run(active.task, lambda error: self._ended(active, error))

    def _ended(self, active: _Active, error: Exception | None) -> None:
        """It has ended, whether it is still wanted or not."""
        node = active.task.segmentation if active.task is not None else None
        if self._active is not active:
            _remove(node)
            return
        self._forget()
        if error is None and node is not None and not node.GetSegmentation().GetNumberOfSegments():
            error = PolyPoseError(
                _("{name} found nothing in '{ct}': is it a CT in Hounsfield units?").format(
                    name=active.segmenter.name, ct=active.ct.GetName()
                )
            )
        if error is not None:
            _remove(node)
            if not isinstance(error, PolyPoseError):
                logging.warning("%s failed", active.segmenter.name, exc_info=error)
            self._say(_sentence(active.segmenter.name, error))
        elif node is not None:
            self._store(active, node)
        self._show_button()

    def _store(self, active: _Active, node: Any) -> None:
        """Place the segmentation as the CT is shown, and choose it where the same CT is still chosen."""
        node.SetAndObserveTransformNodeID(active.ct.GetTransformNodeID())
        words = {"node": node.GetName(), "name": active.segmenter.name}
        if active.parameters.ct is not active.ct:
            self._say(_("'{node}' is ready; another CT is chosen by now.").format(**words))
            return
        self._say(_("Segmented with {name}: check the bones and their structures.").format(**words))
        self._unproposed = node.GetID()
        active.parameters.segmentation = node  # the panel, once it follows, has its structures proposed

    def _forget(self) -> None:
        self._active = None
        slicer.app.disconnect("lastWindowClosed()", self.close)

    def _tell(self, active: _Active, line: str) -> None:
        """Show one line of the extension's log."""
        line = one_line(str(line)).strip()
        if self._active is active and line:
            if len(line) > _LONGEST_LINE:
                line = line[: _LONGEST_LINE - 3] + "..."
            self._say(_("{name}: {line}").format(name=active.segmenter.name, line=line))

    def _show_button(self) -> None:
        button, active = self._ui.segmentButton, self._active
        if active is None:
            chosen = self._parameters is not None and self._parameters.ct is not None
            button.text, button.enabled = _("Segment bones"), chosen
            button.setToolTip(
                _(
                    "Segment the CT with the extension TotalSegmentator or MONAIAuto3DSeg, and propose the "
                    "structures."
                )
                if chosen
                else _("Choose the CT first.")
            )
            return
        cancelling = active.task is not None and active.task.cancelled
        button.text = _("Cancelling...") if cancelling else _("Cancel")
        button.enabled = active.task is not None and not cancelling
        button.setToolTip(_("Stop the segmentation; nothing is changed."))

    def _say(self, text: str) -> None:
        self._ui.segmentState.text = text
        self._ui.segmentState.setVisible(bool(text))


def _remove(node: Any) -> None:
    if node is not None and slicer.mrmlScene.GetNodeByID(node.GetID()) is node:
        slicer.mrmlScene.RemoveNode(node)


def _reason(error: Exception) -> str:
    return one_line(str(error)).strip().rstrip(".") or type(error).__name__


def _sentence(name: str, error: Exception) -> str:
    """What to tell the user about a failure of an extension, never a traceback."""
    if isinstance(error, PolyPoseError):
        return str(error)
    if isinstance(error, subprocess.CalledProcessError):
        return _("{name} ended with the code {code}: see the application's log.").format(
            name=name, code=error.returncode
        )
    return _("{name} could not segment the CT ({reason}): see the application's log.").format(
        name=name, reason=_reason(error)
    )


@contextlib.contextmanager
def _wait_cursor() -> Iterator[None]:
    slicer.app.setOverrideCursor(qt.Qt.WaitCursor)
    try:
        yield
    finally:
        slicer.app.restoreOverrideCursor()
