"""A track in the scene: what it consists of, the frame that is shown, and poses that are corrected by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import slicer
import vtk

from ..scene import track_charts, track_layout, track_views, tree_folder
from ..scene.bone_handles import show_handles
from ..scene.drawing import drawn_once
from ..scene.frames import from_vtk, to_vtk
from ..scene.plot_clicks import PlotClicks
from ..scene.rigid_outlines import RigidSurface
from ..scene.track_outlines import BoneOutlines, PoseState, XraySpot, opacity_of
from ..scene.track_parts import TrackParts
from ..scene.track_sequences import frame_numbers, label_as_frames
from .track_images import TrackImages
from .track_record import TrackRecord, to_patient
from .track_settings import KeptPoses, TrackSettings

_SAME = 1e-6
"""Poses whose matrices agree to this, mm and 1, are one pose."""

_SAVED = 5e-3
"""Slicer's file of a sequence of transforms keeps six digits: poses that agree to this, mm and 1, were saved so."""

_live: list[TrackNodes] = []


class TrackNodes:
    """The nodes of one track, and what follows the frame that its browser shows.

    Everything is found through the browser's references, so that a saved scene has its track again: `of_scene`.
    """

    def __init__(self, browser: slicer.vtkMRMLSequenceBrowserNode) -> None:
        """Take up the track of a browser that `show_track` made; raises InputError where its record is damaged."""
        self.browser = browser
        self.parts = TrackParts(browser)
        self.settings = TrackSettings.of(browser)
        self.record = TrackRecord.from_text(self.parts.get("record").GetText())
        self._outlines: dict[str, BoneOutlines] = {}
        self._observed: list[tuple[Any, int]] = []
        self._shown: int | None = None
        self._correcting: str | None = None
        self._clicks = PlotClicks(self.go_to)
        self.parts.forget_unsaved()
        self._restore_sequences()
        self.images = TrackImages(self)
        self._make_outlines()
        self._follow()
        _live.append(self)
        if browser.GetSelectedItemNumber() < 0:
            browser.SelectFirstItem()
        self._browser_changed()
        if track_layout.shown():
            self.show_layout()

    @classmethod
    def of_scene(cls) -> TrackNodes | None:
        """The track of the scene, the newest where there are several; None where there is none."""
        browsers = [
            each
            for each in slicer.util.getNodesByClass("vtkMRMLSequenceBrowserNode")
            if TrackSettings.given(each)
        ]
        for browser in reversed(browsers):
            for each in _live:
                if each.browser is browser:
                    return each
            if TrackParts(browser).get("record") is not None:
                return cls(browser)
        return None

    @property
    def names(self) -> tuple[str, ...]:
        """Of the bones."""
        return self.record.names

    @property
    def transforms(self) -> dict[str, slicer.vtkMRMLLinearTransformNode]:
        """What moves each bone from the CT to the patient, RAS; whatever is put under it moves with the bone."""
        return self._by_name("transform")

    @property
    def sequences(self) -> dict[str, slicer.vtkMRMLSequenceNode]:
        """The poses of each bone over time."""
        return self._by_name("sequence")

    @property
    def models(self) -> dict[str, slicer.vtkMRMLModelNode]:
        """The surface of each bone, under its transform."""
        return self._by_name("model")

    @property
    def charts(self) -> list[slicer.vtkMRMLPlotChartNode]:
        """Angles and translations of every joint in turn."""
        return list(self.parts.all_of("chart"))

    @property
    def folder(self) -> int:
        """The number of the folder's item in the subject hierarchy; 0 where there is none."""
        return tree_folder.folder_of(self.browser)

    @property
    def frame(self) -> int:
        """The number, in the track, of the frame that is shown, or before what was recorded besides."""
        master = self.browser.GetMasterSequenceNode()
        item = self.browser.GetSelectedItemNumber()
        if master is None or not 0 <= item < master.GetNumberOfDataNodes():
            return self.record.numbers[0]
        return self.record.nearest(float(master.GetNthIndexValue(item)))

    def go_to(self, frame: int) -> None:
        """Show a frame, or the last one before it that was tracked."""
        self.browser.SetSelectedItemByIndexValue(str(int(frame)), False)

    def doubtful_frames(self) -> list[int]:
        """Frames in which a bone is lost or its pose flagged as uncertain, and that nobody has corrected."""
        corrected = {name: self._kept(name).frames for name in self.names}
        return [
            frame
            for frame in self.record.doubtful_frames()
            if any(
                state is not PoseState.TRACKED and frame not in corrected[name]
                for name, state in self.record.states(frame).items()
            )
        ]

    def pose_at_current(self, name: str) -> np.ndarray:
        """Where a bone is in the frame that is shown: (4, 4) rig's world to the CT, LPS mm."""
        tracked = self.record.pose(name, self.frame)
        if name not in self.transforms:
            return tracked.copy()
        shown = self._shown_matrix(name)
        return tracked.copy() if _same(shown, to_patient(tracked)) else to_patient(shown)

    def poses_changed(self) -> dict[str, np.ndarray]:
        """Bones that a person moved in the frame that is shown, kept or not: (4, 4) rig's world to the CT, LPS mm."""
        return {
            name: self.pose_at_current(name)
            for name in self.transforms
            if not _same(self._shown_matrix(name), to_patient(self.record.pose(name, self.frame)))
        }

    def corrected_frames(self, name: str) -> list[int]:
        """Frames in which a bone's pose was changed by hand and kept."""
        return sorted(self._kept(name).frames)

    def start_correcting(self, name: str) -> None:
        """Put Slicer's handles on a bone, in 3D and in the slices; those of another bone go, and it stays as it is."""
        if self._correcting not in (None, name):
            self._end_handles()
        transform = self.transforms.get(name)
        if transform is None:
            return
        transform.SetCenterOfTransformation(*self._middle(name))
        show_handles(transform, True)
        self._correcting = name

    @property
    def correcting(self) -> str | None:
        """The bone that has handles."""
        return self._correcting

    def stop_correcting(self, keep: bool) -> None:
        """Take the handles away; keep the changes of this frame in the sequences, or put the bones back."""
        self._end_handles()
        if keep:
            self._keep()
        for name in self.transforms:
            self._put_back(name)
        self._show_states()

    def corrections(self) -> dict[str, dict[int, np.ndarray]]:
        """What was changed by hand and kept, by bone and frame: (4, 4) rig's world to the CT, LPS mm."""
        return {name: self._kept(name).poses for name in self.names}

    def keep_pose(self, name: str, frame: int, matrix: np.ndarray) -> None:
        """Keep what a person made of a bone's pose in a frame that need not be shown: (4, 4) CT to patient, RAS mm."""
        self._write(name, frame, matrix)
        self._note(name, frame, matrix)

    def keep_corrections(self, corrections: Mapping[str, Mapping[int, np.ndarray]]) -> None:
        """Keep those of an earlier track, as its `corrections` has them; frames that this one lacks are left out."""
        for name, poses in corrections.items():
            for frame in sorted(set(poses) & set(self.record.numbers)):
                self.keep_pose(name, frame, to_patient(poses[frame]))
        self._show_states()

    @drawn_once
    def undo(self, name: str) -> None:
        """Put the tracked pose of this frame back, also where another one was kept."""
        self._kept(name).forget(self.frame)
        self._write(name, self.frame, to_patient(self.record.pose(name, self.frame)))
        self._put_back(name)
        self._show_states()

    def show_layout(self) -> bool:
        """Switch to the track's layout with X-rays, 3D and plots; False when there is no main window."""
        if not track_views.show(len(self.spots)):
            return False
        self.images.aim()
        track_views.show_charts(self.charts)
        track_views.show_player(self.browser)
        self._clicks.connect()
        self._draw_all()
        return True

    def release(self) -> None:
        """Follow nothing any more and take the outlines away; the track stays in the scene."""
        for node, tag in self._observed:
            node.RemoveObserver(tag)
        self._observed.clear()
        self._clicks.release()
        for each in self._outlines.values():
            each.remove()
        self._outlines.clear()
        if self in _live:
            _live.remove(self)

    @drawn_once
    def remove(self) -> None:
        """Take everything that belongs to the track out of the scene, and nothing else."""
        self.release()
        if self.browser.GetScene() is None:
            return
        folder, made = self.folder, [*self.parts.nodes_made(), self.browser]
        tree_folder.remove_items(made, folder)
        self.parts.remove()

    @property
    def spots(self) -> list[XraySpot]:
        """The cameras, and where their X-rays are shown."""
        return [
            XraySpot(number, name, camera, self.settings.detectors[name])
            for number, (name, camera) in enumerate(self.record.track.cameras.items())
        ][: track_views.MOST_VIEWS]

    def _by_name(self, role: str) -> dict[str, Any]:
        found = ((name, self.parts.get(role, number)) for number, name in enumerate(self.names))
        return {name: node for name, node in found if node is not None}

    def _restore_sequences(self) -> None:
        """Give sequences what their files do not keep: exact poses, the index, and the centre of the bones' handles.

        The centre belongs to every frame: what a browser shows takes over all that a frame's node has.
        """
        rows = {number: row for row, number in enumerate(self.record.numbers)}
        for name, sequence in self.sequences.items():
            label_as_frames(sequence)
            kept, middle, bone = self._kept(name).poses, self._middle(name), self.names.index(name)
            for item, number in enumerate(frame_numbers(sequence)):
                node = sequence.GetNthDataNode(item)
                node.SetCenterOfTransformation(*middle)
                if number not in rows:
                    continue
                tracked = self.record.to_patient[rows[number], bone]
                exact = to_patient(kept[number]) if number in kept else tracked
                if np.allclose(_matrix(node), exact, rtol=0, atol=_SAVED):
                    node.SetMatrixTransformToParent(to_vtk(exact))

    def _middle(self, name: str) -> np.ndarray:
        """Of a bone as the CT has it (3,), RAS mm: about it its handles turn."""
        model = self.models.get(name)
        if model is None or model.GetPolyData() is None:
            return np.zeros(3)
        return np.array(model.GetPolyData().GetBounds()).reshape(3, 2).mean(axis=1)

    def _make_outlines(self) -> None:
        spots = self.spots
        for name, model in self.models.items():
            display = model.GetDisplayNode()
            color = display.GetColor() if display is not None else (1.0, 1.0, 0.0)
            self._outlines[name] = BoneOutlines(name, RigidSurface(model.GetPolyData()), color, spots)

    def _follow(self) -> None:
        scene = slicer.mrmlScene
        self._observe(self.browser, vtk.vtkCommand.ModifiedEvent, self._browser_changed)
        for name, transform in self.transforms.items():
            event = slicer.vtkMRMLTransformableNode.TransformModifiedEvent
            self._observe(transform, event, partial(self._moved, name))
        self._observe(scene, scene.StartCloseEvent, lambda *_ignored: self.release())
        self._observe(scene, scene.NodeRemovedEvent, self._node_removed)

    def _observe(self, node: Any, event: int, call: Callable) -> None:
        self._observed.append((node, node.AddObserver(event, call)))

    def _browser_changed(self, *_ignored: Any) -> None:
        if self.browser.GetScene() is None or self.frame == self._shown:
            return
        first, self._shown = self._shown is None, self.frame
        track_charts.move_cursors(self.parts, self.record.seconds(self._shown))
        self._show_states()
        if first:
            self._draw_all()

    def _moved(self, name: str, *_ignored: Any) -> None:
        """The browser showed another frame, or a person moved the bone."""
        if name in self._outlines and name in self.transforms:
            self._outlines[name].draw(self._shown_matrix(name))

    def _node_removed(self, *_ignored: Any) -> None:
        if self.browser.GetScene() is None:
            self.release()

    @drawn_once
    def _draw_all(self) -> None:
        for name in self.transforms:
            self._moved(name)

    def _show_states(self) -> None:
        models = self.models
        for name, state in self.record.states(self.frame).items():
            if self.frame in self._kept(name).frames:
                state = PoseState.TRACKED
            if name in self._outlines:
                self._outlines[name].set_state(state)
            display = models[name].GetDisplayNode() if name in models else None
            if display is not None and display.GetOpacity() != opacity_of(state):
                display.SetOpacity(opacity_of(state))

    def _kept(self, name: str) -> KeptPoses:
        return KeptPoses(self.sequences.get(name))

    def _keep(self) -> None:
        """Write all bones' poses into their sequences, where a person moved them from the tracked ones or back.

        All at first: what is remembered changes a sequence, upon which Slicer shows every bone as its sequence has it.
        """
        shown = {name: self._shown_matrix(name) for name in self.transforms if name in self.sequences}
        for name, matrix in shown.items():
            self._write(name, self.frame, matrix)
        for name, matrix in shown.items():
            self._note(name, self.frame, matrix)

    def _note(self, name: str, frame: int, matrix: np.ndarray) -> None:
        """Remember a pose as a person's, or forget one that is the tracked one again."""
        if _same(matrix, to_patient(self.record.pose(name, frame))):
            self._kept(name).forget(frame)
        else:
            self._kept(name).remember(frame, to_patient(matrix))

    def _write(self, name: str, frame: int, matrix: np.ndarray) -> None:
        sequence = self.sequences.get(name)
        if sequence is None:
            return
        node = sequence.GetDataNodeAtValue(str(frame))
        if node is not None and not _same(_matrix(node), matrix):
            node.SetMatrixTransformToParent(to_vtk(matrix))
            sequence.StorableModified()

    def _put_back(self, name: str) -> None:
        """Show what the sequence has."""
        sequence, transform = self.sequences.get(name), self.transforms.get(name)
        node = sequence.GetDataNodeAtValue(str(self.frame)) if sequence is not None else None
        if node is not None and transform is not None and not _same(_matrix(node), _matrix(transform)):
            transform.SetMatrixTransformToParent(to_vtk(_matrix(node)))

    def _end_handles(self) -> None:
        transform = self.transforms.get(self._correcting) if self._correcting is not None else None
        if transform is not None:
            show_handles(transform, False)
        self._correcting = None

    def _shown_matrix(self, name: str) -> np.ndarray:
        return _matrix(self.transforms[name])


def _matrix(node: slicer.vtkMRMLLinearTransformNode) -> np.ndarray:
    matrix = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToParent(matrix)
    return from_vtk(matrix)


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.allclose(one, other, rtol=0, atol=_SAME))
