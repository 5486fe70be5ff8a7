"""The Motion section's lower half: what is doubtful in a track, corrections by hand, and how the track goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import qt
import slicer
import vtk
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError

from ..process.background import Background
from ..process.track_run import Continuation
from ..process.track_saving import is_whole, saving, track_text
from ..scene.frames import from_vtk
from ..study.parameters import PolyPoseParameterNode
from ..study.track_nodes import TrackNodes
from .new_folder import empty_folder
from .track_words import frame_text, track_verdict

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.track import TrackedFrame

_BUTTONS = ("trackPrevious", "trackNext", "trackBone", "trackCorrect", "trackUndo", "trackPlots", "trackSave")
_DIRECTIONS = ("both", "forward", "backward")


@dataclass(frozen=True)
class _Moved:
    """A bone that was moved by hand in a frame and is not kept yet; matrix: (4, 4) CT to patient, RAS mm."""

    name: str
    frame: int
    matrix: np.ndarray


class TrackReview:
    """Looks at the track of the scene, and corrects it.

    A correction belongs to the frame in which it was made; going to another frame keeps it, and *Undo correction* takes
    it back.
    """

    def __init__(
        self, ui: Any, host: Any, track_on: Callable[[Continuation], None], say: Callable[[str], None]
    ) -> None:
        """host: keeps observers. track_on: starts to track on. say: shows a message."""
        self._ui, self._host, self._track_on, self._say = ui, host, track_on, say
        self._nodes: TrackNodes | None = None
        self._observed: list[tuple[Any, int, Any]] = []
        self._frame: int | None = None
        self._tracked: dict[int, TrackedFrame] = {}
        self._doubtful: list[int] = []
        self._moved: _Moved | None = None
        self._saving = Background()
        self._setting = False
        for text in (_("forward and backward"), _("forward"), _("backward")):
            ui.trackDirection.addItem(text)
        ui.trackPrevious.connect("clicked()", self.previous)
        ui.trackNext.connect("clicked()", self.next)
        ui.trackBone.connect("currentIndexChanged(int)", self._bone_chosen)
        ui.trackCorrect.connect("toggled(bool)", self._correct)
        ui.trackUndo.connect("clicked()", self.undo)
        ui.trackOn.connect("clicked()", self.track_on)
        ui.trackPlots.connect("clicked()", self.show_plots)
        ui.trackSave.connect("clicked()", self._ask_save)
        ui.trackBox.setVisible(False)

    @property
    def nodes(self) -> TrackNodes | None:
        """The track that is shown."""
        return self._nodes

    def show(self, parameters: PolyPoseParameterNode | None, running: bool, missing: str) -> None:
        """Another parameter node, or the same that changed; missing: why nothing can be tracked, or empty."""
        nodes = self._found() if parameters is not None else None
        if nodes is not self._nodes:
            self._follow(nodes)
        self._ui.trackBox.setVisible(nodes is not None)
        if nodes is None:
            return
        for name in _BUTTONS:
            getattr(self._ui, name).enabled = not running
        self._ui.trackSave.enabled = not self._saving.busy
        self._enable_track_on(nodes, running, missing)

    def _found(self) -> TrackNodes | None:
        """The track of the scene; None where there is none, or one that cannot be read."""
        try:
            return TrackNodes.of_scene()
        except PolyPoseError as error:
            self._say(str(error))
            return None

    def previous(self) -> None:
        """Go to the doubtful frame before this one."""
        if self._nodes is not None:
            now = self._nodes.frame
            self._go([frame for frame in self._doubtful if frame < now][-1:])

    def next(self) -> None:
        """Go to the doubtful frame after this one."""
        if self._nodes is not None:
            now = self._nodes.frame
            self._go([frame for frame in self._doubtful if frame > now][:1])

    def undo(self) -> None:
        """Put the chosen bone back where the track has it in this frame."""
        nodes, name = self._nodes, self._ui.trackBone.currentText
        if nodes is not None and name in nodes.names:
            self._moved = None
            nodes.undo(name)
            self._corrections_changed()

    def track_on(self) -> None:
        """Track on from the bones of this frame as they are now."""
        nodes = self._nodes
        if nodes is not None:
            self.stop()
            direction = _DIRECTIONS[max(self._ui.trackDirection.currentIndex, 0)]
            self._track_on(Continuation(track_text(nodes), nodes.frame, nodes.poses_changed(), direction))

    def show_plots(self) -> None:
        """Show the track's own layout."""
        if self._nodes is not None:
            self._nodes.show_layout()

    def stop(self) -> None:
        """Take the handles away; what was moved is kept."""
        self._ui.trackCorrect.checked = False

    def close(self) -> None:
        """Follow no track any more, and end what is under way."""
        self._saving.drop()
        if self._nodes is not None and self._nodes.browser.GetScene() is not None:
            self.stop()
        self._follow(None)
        self._ui.trackBox.setVisible(False)

    def save(self, folder: str) -> None:
        """Write the track into a folder, or a new one within where it is not empty."""
        nodes = self._nodes
        if nodes is None or self._saving.busy:
            return
        work = saving(nodes, empty_folder(Path(folder), "PolyPose-track"))
        lines = (
            []
            if is_whole(nodes)
            else [_("The scene has the poses alone: tables and plots of joints are left out.")]
        )
        if any(nodes.corrected_frames(name) for name in nodes.names):
            lines.append(_("Corrections are not in it before you track on from them."))
        self._ui.trackSave.enabled = False
        self._say(_("Saving the track..."))
        self._saving.run(work, lambda path: self._saved(path, lines), self._not_saved)

    def _saved(self, path: Path, lines: list[str]) -> None:
        self._ui.trackSave.enabled = True
        self._say("\n".join([_("Written to {folder}.").format(folder=path), *lines]))

    def _not_saved(self, error: Exception) -> None:
        self._ui.trackSave.enabled = True
        self._say(_("The track could not be written: {reason}").format(reason=error))

    def _ask_save(self) -> None:
        window = self._ui.motionSection.window()
        folder = qt.QFileDialog.getExistingDirectory(window, _("Save the track into a folder"))
        if folder:
            self.save(str(folder))

    def _follow(self, nodes: TrackNodes | None) -> None:
        """Follow another track's frames, or none."""
        for node, event, call in self._observed:
            self._host.removeObserver(node, event, call)
        self._observed.clear()
        self._nodes, self._moved, self._frame = nodes, None, None
        self._setting = True
        self._ui.trackCorrect.checked = False
        self._ui.trackBone.clear()
        for name in nodes.names if nodes is not None else ():
            self._ui.trackBone.addItem(name)
        self._setting = False
        if nodes is None:
            return
        self._observe(nodes.browser, vtk.vtkCommand.ModifiedEvent, self._browser_changed)
        for transform in nodes.transforms.values():
            self._observe(
                transform, slicer.vtkMRMLTransformableNode.TransformModifiedEvent, self._transform_changed
            )
        self._tracked = {each.frame: each for each in nodes.record.track.frames}
        self._doubtful = nodes.doubtful_frames()
        verdict = track_verdict(nodes.record.track)
        self._ui.trackVerdict.text = "\n".join([verdict.headline, *verdict.lines])
        self._ui.trackVerdict.setStyleSheet(verdict.style)
        self._browser_changed()

    def _observe(self, node: Any, event: int, call: Any) -> None:
        self._observed.append((node, event, call))
        self._host.addObserver(node, event, call)

    def _browser_changed(self, *_ignored: Any) -> None:
        """Another frame may be shown: what was moved by hand in the one before it is kept."""
        nodes = self._nodes
        if nodes is None or nodes.browser.GetScene() is None or nodes.frame == self._frame:
            return
        moved, self._moved = self._moved, None
        self._frame = nodes.frame
        if moved is not None:
            nodes.keep_pose(moved.name, moved.frame, moved.matrix)
            self._doubtful = nodes.doubtful_frames()
        self._show_frame()

    def _transform_changed(self, node: Any, *_ignored: Any) -> None:
        """A bone was moved by hand, or the browser shows another frame."""
        nodes = self._nodes
        if nodes is None or nodes.correcting is None or nodes.frame != self._frame:
            return
        name = nodes.correcting
        if nodes.transforms.get(name) is node:
            matrix = vtk.vtkMatrix4x4()
            node.GetMatrixTransformToParent(matrix)
            self._moved = _Moved(name, nodes.frame, from_vtk(matrix))

    def _show_frame(self) -> None:
        nodes = self._nodes
        if nodes is None:
            return
        frame = nodes.frame
        corrected = [name for name in nodes.names if frame in nodes.corrected_frames(name)]
        self._ui.trackFrameText.text = frame_text(self._tracked.get(frame), nodes.names, frame, corrected)
        self._ui.trackPrevious.setToolTip(_count(sum(each < frame for each in self._doubtful)))
        self._ui.trackNext.setToolTip(_count(sum(each > frame for each in self._doubtful)))

    def _corrections_changed(self) -> None:
        """Look anew which frames are doubtful: corrected ones are not. Playing asks for it in no frame."""
        if self._nodes is not None:
            self._doubtful = self._nodes.doubtful_frames()
            self._show_frame()

    def _go(self, frames: list[int]) -> None:
        if self._nodes is not None and frames:
            self._nodes.go_to(frames[0])

    def _bone_chosen(self, *_ignored: Any) -> None:
        if not self._setting and self._ui.trackCorrect.checked:
            self._keep_moved()
            self._start_correcting()

    def _correct(self, on: bool) -> None:
        nodes = self._nodes
        if self._setting or nodes is None:
            return
        if on:
            self._start_correcting()
        else:
            self._moved = None
            nodes.stop_correcting(keep=True)
            self._corrections_changed()

    def _start_correcting(self) -> None:
        nodes, name = self._nodes, self._ui.trackBone.currentText
        if nodes is not None and name in nodes.names:
            nodes.start_correcting(name)

    def _keep_moved(self) -> None:
        moved, self._moved = self._moved, None
        if moved is not None and self._nodes is not None:
            self._nodes.keep_pose(moved.name, moved.frame, moved.matrix)
            self._corrections_changed()

    def _enable_track_on(self, nodes: TrackNodes, running: bool, missing: str) -> None:
        if nodes.record.track.smoothed:
            missing = _("A smoothed track cannot be continued: track without smoothing first.")
        for name in ("trackOn", "trackDirection"):
            getattr(self._ui, name).enabled = not running and not missing
        self._ui.trackOn.setToolTip(
            missing
            or _(
                "Track anew from the bones of this frame, as you have corrected them; other frames are kept."
            )
        )


def _count(frames: int) -> str:
    return _("{count} doubtful frames in this direction.").format(count=frames)
