"""The panel's settings and its foot: one button, what is missing, progress, and the curve while it runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import ctk
import numpy as np
import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.data.result import total_seconds
from PolyPoseLib.errors import CancelledError, PolyPoseError, UntrustedResultError

from ..process.dependencies import ensure_dependencies
from ..process.registration import Registration, State
from ..scene import layouts
from ..scene.names import free_name
from ..study.parameters import (
    PolyPoseParameterNode,
    carried_nodes,
    store_outputs,
    structures_of,
    xray_sources,
)
from ..study.result_origin import remember_segments
from ..study.results import fill_similarity_table, set_plot
from ..study.snapshot import Snapshot
from .live_preview import LivePreview
from .stage_words import SAVING, stage_text

POLL_MS = 50


@dataclass
class _Active:
    """A registration that is running.

    before: the result that was there. preview: what follows its transform meanwhile. kept_in: the folder that keeps
    the result, or empty. drawn: how many points of the curve are shown.
    """

    run: Registration
    parameters: PolyPoseParameterNode
    before: Snapshot
    preview: LivePreview | None
    kept_in: str
    drawn: int = 0


class RegisterPart:
    """Starts, shows and ends one registration.

    done: called when a result is in the scene, trusted or not, with its nodes and what was there before.
    changed: called when one has started and when it has ended.
    """

    def __init__(
        self,
        ui: Any,
        logic: Any,
        requirements: str,
        done: Callable[[Any, Snapshot], None],
        changed: Callable[[], None],
    ) -> None:
        """requirements: path of the list of Python packages that the child needs."""
        self._ui, self._logic, self._requirements = ui, logic, requirements
        self._done, self._changed = done, changed
        self._parameters: PolyPoseParameterNode | None = None
        self._active: _Active | None = None
        self._made: list[Any] = []
        self._showing = False
        self._missing = ""
        self._timer = qt.QTimer()
        self._timer.interval = POLL_MS
        self._timer.connect("timeout()", self._poll)
        ui.outputFolder.filters = ctk.ctkPathLineEdit.Dirs
        ui.outputFolder.currentPath = ""  # not the last one of its history: that holds an earlier result
        ui.progressBar.setVisible(False)
        ui.messageLabel.setVisible(False)
        ui.registerButton.connect("clicked()", self.press)
        for name, signal in (
            ("refineCameras", "toggled(bool)"),
            ("uncertainty", "toggled(bool)"),
            ("threads", "valueChanged(int)"),
            ("seed", "valueChanged(int)"),
        ):
            getattr(ui, name).connect(signal, self._options_edited)

    @property
    def running(self) -> bool:
        """Whether a registration is running."""
        return self._active is not None

    def show(self, parameters: PolyPoseParameterNode | None, missing: str = "") -> None:
        """Another parameter node, or the same that changed; missing: what is still needed, one sentence."""
        self._parameters, self._missing = parameters, missing
        if parameters is not None:
            options = json.loads(parameters.options or "{}")
            self._showing = True
            self._ui.refineCameras.checked = bool(options.get("refine_cameras", True))
            self._ui.uncertainty.checked = bool(options.get("uncertainty", True))
            self._ui.threads.value = int(options.get("threads") or 0)
            self._ui.seed.value = int(options.get("seed", 0))
            self._showing = False
        self._show_button()

    def press(self) -> None:
        """The button: register, or cancel."""
        if self._active is None:
            self.start()
        else:
            self._active.run.cancel()
            self._show_button()

    def start(self, adjustments: Mapping[str, np.ndarray] | None = None) -> None:
        """Start a registration with the inputs of the parameter node.

        adjustments: how bones of the result were moved by hand in the X-rays' posture, (4, 4) LPS mm: it is refined
        from there, and nothing is looked for elsewhere; None starts anew.
        """
        self._say("")
        parameters = self._parameters
        if parameters is None or self.running:
            return
        before = Snapshot.of(parameters)
        try:
            ensure_dependencies(self._requirements)
            self._make_curve(parameters)
            kept_in = self._ui.outputFolder.currentPath.strip()
            if adjustments is None:
                run = self._logic.startParameters(parameters, outputFolder=kept_in or None)
            else:
                run = self._logic.startRefinement(adjustments, parameters, outputFolder=kept_in or None)
        except (PolyPoseError, OSError) as error:
            self._remove_curve()
            self._say(str(error))
            return
        moving = (parameters.ct, parameters.segmentation, *carried_nodes(parameters))
        preview = LivePreview(*moving) if parameters.livePreview else None
        self._active = _Active(run, parameters, before, preview, kept_in)
        self._ui.progressBar.setVisible(True)
        self._ui.progressBar.setRange(0, 0)
        layouts.show_plot(parameters.outputPlot)
        self._timer.start()
        self._show_button()
        self._changed()

    def close(self) -> None:
        """End a running registration at once, and leave nothing of it."""
        self._timer.stop()
        if self._active is not None:
            active = self._active
            active.run.close()
            self._finish()
            active.before.restore_curve(active.parameters)

    def _poll(self) -> None:
        """Every 50 ms: take what came, show it, and end when it has ended."""
        active = self._active
        if active is None:
            return
        run, parameters = active.run, active.parameters
        state = run.poll()
        self._show_progress(active)
        if active.preview is not None and run.nodes.transform is not None and not state.ended:
            active.preview.show(run.nodes.transform)
        if not state.ended:
            self._show_button()
            return
        self._timer.stop()
        untrusted = isinstance(run.error, UntrustedResultError)
        if state is State.DONE or untrusted:
            self._made.clear()
            self._finish()
            store_outputs(parameters, run.nodes)
            if active.kept_in and parameters.segmentation is not None:
                remember_segments(active.kept_in, parameters.segmentation)
            self._say(self._end_text(run))
            self._done(run.nodes, active.before)
        else:
            self._finish()
            active.before.restore_curve(parameters)
            cancelled = isinstance(run.error, CancelledError)
            self._say(_("Cancelled; nothing was changed.") if cancelled else str(run.error))

    def _finish(self) -> None:
        """Forget the run."""
        active, self._active = self._active, None
        if active is not None and active.preview is not None:
            active.preview.restore()
        self._remove_curve()
        self._ui.progressBar.setVisible(False)
        self._show_button()
        self._changed()

    def _show_progress(self, active: _Active) -> None:
        ui, run, progress = self._ui, active.run, active.run.progress
        if run.state is State.WRITING:
            ui.stageLabel.text = _("Preparing the data...")
        elif run.state is State.LOADING:
            ui.progressBar.setRange(0, 0)
            ui.stageLabel.text = _("Reading the result...")
        elif progress is None:
            ui.stageLabel.text = _("Starting...")
        else:
            saving = progress.stage == SAVING
            ui.progressBar.setRange(0, 0 if saving else max(progress.of, 1))
            if not saving:
                ui.progressBar.setValue(min(progress.iteration, max(progress.of, 1)))
            ui.stageLabel.text = stage_text(progress)
        table = active.parameters.outputSimilarity
        if table is not None and len(run.similarities) != active.drawn and not run.state.ended:
            active.drawn = len(run.similarities)
            fill_similarity_table(table, run.similarities)

    def _end_text(self, run: Registration) -> str:
        seconds = total_seconds(run.nodes.seconds)
        text = _("Done in {seconds:.0f} s on {device}.").format(
            seconds=seconds, device=run.nodes.device or _("this computer")
        )
        return "\n".join([str(run.error)] if run.error is not None else [text])

    def _make_curve(self, parameters: PolyPoseParameterNode) -> None:
        """Make the nodes of the curve at the start, so that it can be watched."""
        scene = slicer.mrmlScene
        names = {
            "outputSimilarity": ("vtkMRMLTableNode", _("PolyPose similarity")),
            "outputSeries": ("vtkMRMLPlotSeriesNode", _("PolyPose similarity curve")),
            "outputPlot": ("vtkMRMLPlotChartNode", _("PolyPose similarity plot")),
        }
        was = parameters.StartModify()
        for field, (kind, name) in names.items():
            if getattr(parameters, field) is None:
                node = scene.AddNewNodeByClass(kind, free_name(name))
                self._made.append(node)
                setattr(parameters, field, node)
        parameters.EndModify(was)
        fill_similarity_table(parameters.outputSimilarity, [])
        set_plot(parameters.outputPlot, parameters.outputSeries, parameters.outputSimilarity)

    def _remove_curve(self) -> None:
        for node in self._made:
            if node.GetScene() is not None:
                slicer.mrmlScene.RemoveNode(node)
        self._made.clear()

    def _show_button(self) -> None:
        """The button registers or cancels; the line above it says what is missing, or what is going on."""
        button = self._ui.registerButton
        if self._active is not None:
            cancelling = self._active.run.cancelling
            button.text = _("Cancelling...") if cancelling else _("Cancel")
            button.enabled = not cancelling
            button.setToolTip(_("Stop the registration; nothing is changed."))
            return
        parameters, missing, state = self._parameters, "", ""
        if parameters is not None:
            missing = self._logic.missingInput(parameters) or self._missing
            state = missing or _("Ready: {bones} structures, {xrays} X-rays.").format(
                bones=len(structures_of(parameters)), xrays=len(xray_sources(parameters))
            )
        button.enabled = parameters is not None and not missing
        button.text = _("Register")
        button.setToolTip(missing or _("Align the CT to the X-rays."))
        self._ui.stageLabel.text = state

    def _options_edited(self, *_ignored: Any) -> None:
        """Store the advanced options; defaults are left out."""
        if self._showing or self._parameters is None:
            return
        ui = self._ui
        options = json.loads(self._parameters.options or "{}")
        for key, value, usual in (
            ("refine_cameras", bool(ui.refineCameras.checked), True),
            ("uncertainty", bool(ui.uncertainty.checked), True),
            ("threads", int(ui.threads.value), 0),
            ("seed", int(ui.seed.value), 0),
        ):
            options.pop(key, None)
            if value != usual:
                options[key] = value
        self._parameters.options = json.dumps(options)

    def _say(self, text: str) -> None:
        self._ui.messageLabel.text = text
        self._ui.messageLabel.setVisible(bool(text))
