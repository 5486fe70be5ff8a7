"""The Motion section: one button that tracks, what is missing, progress, and the frames that were kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import CancelledError, PolyPoseError, UntrustedResultError

from ..process.dependencies import ensure_dependencies
from ..process.track_folder import TRACKS, discard, frames_kept
from ..process.track_run import Continuation, State, TrackRun
from ..process.track_saving import track_text
from ..study.parameters import PolyPoseParameterNode
from ..study.track_nodes import TrackNodes
from ..study.track_plan import TrackPlan, plan_of
from ..study.track_request import TrackRequest
from ..study.track_writer import inputs_digest
from ..study.xray_reading import XrayReader
from .stage_words import track_stage_text
from .track_form import TrackForm
from .track_words import done_text, state_text

POLL_MS = 50


@dataclass(frozen=True)
class _Task:
    """What is, or was, tracked: with which inputs it can be gone on with, and where.

    digest: of the inputs. output: the track's folder, beside which frames are kept.
    """

    request: TrackRequest
    plan: TrackPlan
    digest: str
    output: Path
    continuation: Continuation | None


class TrackPart:
    """Starts, shows and ends one tracking.

    done: called when a track is in the scene, trusted or not, with its nodes.
    changed: called when one has started and when it has ended.
    """

    def __init__(
        self,
        ui: Any,
        logic: Any,
        requirements: str,
        reader: XrayReader,
        done: Callable[[Any], None],
        changed: Callable[[], None],
    ) -> None:
        """requirements: path of the list of Python packages that the child needs. reader: of the X-rays' table."""
        self._ui, self._logic, self._requirements, self._reader = ui, logic, requirements, reader
        self._done, self._changed = done, changed
        self._form = TrackForm(ui)
        self._parameters: PolyPoseParameterNode | None = None
        self._request: TrackRequest | None = None
        self._plan = TrackPlan()
        self._run: TrackRun | None = None
        self._task: _Task | None = None
        self._kept: _Task | None = None
        self._timer = qt.QTimer()
        self._timer.interval = POLL_MS
        self._timer.connect("timeout()", self._poll)
        ui.trackProgress.setVisible(False)
        ui.trackMessage.setVisible(False)
        ui.trackGoOn.setVisible(False)
        ui.trackButton.connect("clicked()", self.press)
        ui.trackGoOn.connect("clicked()", self.go_on)

    @property
    def running(self) -> bool:
        """Whether a tracking is running."""
        return self._run is not None

    @property
    def missing(self) -> str:
        """One sentence that says what is missing before anything can be tracked; empty when nothing is."""
        return "" if self._plan.missing is None else self._plan.missing.sentence

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, or the same that changed."""
        self._parameters = parameters
        self._request = TrackRequest.of(parameters) if parameters is not None else None
        self._plan = plan_of(self._request, self._reader) if self._request is not None else TrackPlan()
        self._form.show(parameters, self._request, self._plan)
        self._form.enable(parameters is not None and not self.running)
        self._ui.trackState.text = state_text(self._plan)
        self._show_buttons()

    def press(self) -> None:
        """The button: track, or cancel."""
        if self._run is None:
            self.start()
        else:
            self._run.cancel()
            self._show_buttons()

    def start(self, continuation: Continuation | None = None) -> None:
        """Track what the parameter node asks for; continuation: go on from a corrected frame of an earlier track."""
        if self._request is None or self.running or not self._may_begin_anew():
            return
        digest = inputs_digest(self._request, self._plan)
        self._start(_Task(self._request, self._plan, digest, TRACKS.new(), continuation), resume=False)

    def go_on(self) -> None:
        """Go on with the frames that an interrupted tracking has left."""
        if self._kept is not None and not self.running:
            self._start(self._kept, resume=True)

    def close(self) -> None:
        """End a running tracking at once, and leave nothing of it."""
        self._timer.stop()
        run, self._run = self._run, None
        if run is not None:
            run.close()
            discard(run.output)
            self._finish()
        self.forget_kept()

    def forget_kept(self) -> None:
        """Remove the frames that an interrupted tracking has left."""
        self._keep_instead(None)

    def _keep_instead(self, task: _Task | None) -> None:
        """Keep what another tracking has left, or nothing; until then earlier frames stay, whatever fails meanwhile."""
        before, self._kept = self._kept, task
        if before is not None and (task is None or task.output != before.output):
            discard(before.output)

    def _may_begin_anew(self) -> bool:
        """Ask where frames would be lost that may be gone on with."""
        if not self._can_go_on() or self._kept is None:
            return True
        return slicer.util.confirmOkCancelDisplay(
            _(
                "{count} frames of an interrupted tracking are kept: Go on continues after them.\n\n"
                "Begin anew all the same? They are removed once the new tracking has frames of its own."
            ).format(count=frames_kept(self._kept.output))
        )

    def say(self, text: str) -> None:
        """Show a message until another one, or none."""
        self._ui.trackMessage.text = text
        self._ui.trackMessage.setVisible(bool(text))

    def _start(self, task: _Task, resume: bool) -> None:
        self.say("")
        try:
            ensure_dependencies(self._requirements)
            self._run = self._logic.startTracking(
                task.request, task.output, resume=resume, continuation=task.continuation, plan=task.plan
            )
        except (PolyPoseError, OSError) as error:
            self.say(str(error))
            return
        self._task = task
        self._ui.trackProgress.setVisible(True)
        self._ui.trackProgress.setRange(0, 0)
        self._timer.start()
        self._show_progress()
        self._changed()

    def _poll(self) -> None:
        """Every 50 ms: take what came, show it, and end when it has ended."""
        run, task = self._run, self._task
        if run is None or task is None:
            return
        state = run.poll()
        if not state.ended:
            self._show_progress()
            self._show_buttons()
            return
        self._timer.stop()
        self._run = None
        if state is State.DONE or isinstance(run.error, UntrustedResultError):
            self._keep_instead(None)
            self._finish()
            self._take(run, task)
        else:
            kept = frames_kept(task.output)
            if kept or task is self._kept:
                self._keep_instead(task if kept else None)
            self._finish()
            self.say(self._interrupted_text(run, kept))

    def _take(self, run: TrackRun, task: _Task) -> None:
        """Put the track into the scene."""
        try:
            kept = _corrections_elsewhere(task.continuation)
            nodes = self._logic.showTrack(run.output, task.request, task.plan)
        except PolyPoseError as error:
            where = _("The finished track is in {folder} until the scene is closed.").format(
                folder=run.output
            )
            self.say(f"{error}\n{where}")
            return
        nodes.keep_corrections(kept)
        self.say(done_text(run))
        self._done(nodes)

    def _finish(self) -> None:
        """Forget the run."""
        self._task = None
        self._ui.trackProgress.setVisible(False)
        self._changed()

    def _interrupted_text(self, run: TrackRun, kept: int) -> str:
        """kept: frames that the run has left."""
        cancelled = isinstance(run.error, CancelledError)
        lines = [] if cancelled else [str(run.error)]
        if kept:
            lines.append(
                _(
                    "{count} frames are kept: press Go on to continue after them, as long as the inputs stay as they "
                    "are."
                ).format(count=kept)
            )
        if cancelled:
            lines.insert(0, _("Cancelled.") if kept else _("Cancelled; nothing was changed."))
        return "\n".join(lines)

    def _show_progress(self) -> None:
        ui, run = self._ui, self._run
        if run is None:
            return
        progress = run.progress
        known = run.state is State.RUNNING and progress is not None and progress.of > 1
        ui.trackProgress.setRange(0, progress.of if known and progress is not None else 0)
        if known and progress is not None:
            ui.trackProgress.setValue(min(progress.iteration, progress.of))
        if run.state is State.WRITING:
            ui.trackStage.text = _("Preparing the data...")
        elif run.state is State.LOADING:
            ui.trackStage.text = _("Reading the track...")
        elif progress is None:
            ui.trackStage.text = _("Starting...")
        else:
            ui.trackStage.text = track_stage_text(progress, run.seconds_left)

    def _show_buttons(self) -> None:
        """The button tracks or cancels, and says what is missing, as does the line above it."""
        ui, button = self._ui, self._ui.trackButton
        ui.trackGoOn.setVisible(False)
        if self._run is not None:
            cancelling = self._run.cancelling
            button.text = _("Cancelling...") if cancelling else _("Cancel")
            button.enabled = not cancelling
            button.setToolTip(_("Stop the tracking; frames that are done are kept."))
            return
        missing = self._plan.missing
        button.enabled = self._request is not None and missing is None
        button.text = _("Track") if missing is None else missing.short
        button.setToolTip(
            _("Follow the bones through the sequences.") if missing is None else missing.sentence
        )
        if self._request is None:
            ui.trackStage.text = ""
        elif missing is not None:
            ui.trackStage.text = missing.sentence
        else:
            ui.trackStage.text = _(
                "Ready: {bones} structures, {cameras} cameras, frames {first} to {last}, {rate:.4g} a second."
            ).format(
                bones=len(self._request.by_structure()),
                cameras=len(self._plan.cameras),
                first=self._plan.frames.start,
                last=self._plan.frames.stop - 1,
                rate=self._plan.rate or 0.0,
            )
        ui.trackGoOn.setVisible(self._can_go_on())

    def _can_go_on(self) -> bool:
        """Whether there are frames of a tracking of just these inputs."""
        if self._kept is None or self._request is None or self._plan.missing is not None:
            return False
        return inputs_digest(self._request, self._plan) == self._kept.digest


def _corrections_elsewhere(continuation: Continuation | None) -> dict[str, dict[int, np.ndarray]]:
    """Poses that were corrected in other frames than the one that is tracked on from: they are not in the new track."""
    before = TrackNodes.of_scene()
    if continuation is None or before is None or track_text(before) != continuation.track:
        return {}
    return {
        name: {frame: pose for frame, pose in poses.items() if frame != continuation.frame}
        for name, poses in before.corrections().items()
    }
