"""The panel's landmarks: points picked in the CT and in an X-ray, and the camera that follows from them, live."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import qt
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.geometry.camera import Camera

from ..scene import landmark_lists, layouts, pixel_frames, xray_views
from ..scene.cameras import camera_of, set_camera
from ..scene.names import free_name
from ..study.camera_source import CameraSource
from ..study.landmark_fit import LandmarkFit, fit_landmarks
from ..study.parameters import PolyPoseParameterNode
from ..study.xray_source import XraySource
from .landmark_table import LandmarkTable
from .node_choice import identifiers
from .pictures import picture_of
from .place_mode import PlaceMode
from .xrays import XraysPart

SOLVE_MS = 30
"""Delay before a moved point is followed: it still looks immediate, and many events cause one update."""

NAMED_PIXELS = 8.0
"""A projection carries its name only when it is farther than this from its counterpart; nearer, names would overlap."""

SETTLE_MS = 300
"""The X-ray's camera is set when no point has moved for this long."""


class LandmarksPart:
    """Lists, picking, the table of errors, and the projections in the X-ray's view, for the selected X-ray."""

    def __init__(
        self,
        ui: Any,
        host: Any,
        xrays: XraysPart,
        show_views: Callable[[], None],
        reference: Callable[[], np.ndarray],
    ) -> None:
        """host: keeps observers. show_views: brings the X-ray views up. reference: of the patient, (3,) LPS mm."""
        self._ui, self._host, self._xrays = ui, host, xrays
        self._choice, self._listed = xrays.choice, identifiers()
        self._show_views, self._reference = show_views, reference
        self._parameters: PolyPoseParameterNode | None = None
        self._observed: list[Any] = []
        self._projected: Any = None
        self._showing = False
        self._edited = False
        self.fit: LandmarkFit | None = None
        self._fitted: Any = None
        self._row = -1
        self._table = LandmarkTable(ui)
        self._place = PlaceMode(host, self._mode_changed)
        self._solve_timer = self._timer(SOLVE_MS, self.solve)
        self._settle_timer = self._timer(SETTLE_MS, self.settle)
        ui.ctLandmarks.connect("nodeActivated(vtkMRMLNode*)", self._chosen)
        ui.xrayLandmarks.connect("nodeActivated(vtkMRMLNode*)", self._chosen)
        ui.ctPlace.connect("clicked(bool)", self.pick_in_ct)
        ui.xrayPlace.connect("clicked(bool)", self.pick_in_xray)
        ui.removeLandmark.connect("clicked()", self.remove_selected)

    def show(self, parameters: PolyPoseParameterNode | None) -> None:
        """Another parameter node, another X-ray, or one of them changed."""
        if parameters is None or parameters is not self._parameters:
            self.stop()
        self._parameters = parameters
        if parameters is None:
            self._table.show(None)
            return
        _number_frames(self._xrays.sources)
        if self._xrays.number != self._row:
            self._leave_row()
        source = self._source()
        lists = [source.ct_landmarks, source.xray_landmarks] if source is not None else [None, None]
        self._showing = True
        for selector, node in zip((self._ui.ctLandmarks, self._ui.xrayLandmarks), lists, strict=True):
            selector.setCurrentNode(node)
        self._showing = False
        self._listed = identifiers(*lists)
        self._observe(lists)
        for name in ("ctPlace", "xrayPlace", "ctLandmarks", "xrayLandmarks"):
            getattr(self._ui, name).enabled = source is not None and parameters.ct is not None
        self._place.follow()
        if source is None or source.camera_source is not CameraSource.LANDMARKS:
            self.solve()
        else:
            self._solve_timer.start()

    def stop(self) -> None:
        """End picking, and leave no observer, timer or projection."""
        self._leave_row()
        self._observe([])
        self._place.close()

    def pick_in_ct(self, on: bool) -> None:
        """Start or end picking points in the CT."""
        source = self._source()
        if not on or source is None:
            self._place.end()
            return
        node = source.ct_landmarks or self._new_list(source, _("{name}: landmarks in the CT"), in_xray=False)
        self._place.start(node)

    def pick_in_xray(self, on: bool) -> None:
        """Bring the X-ray up in its own view and pick points there, or end picking."""
        source = self._source()
        if not on or source is None:
            self._place.end()
            return
        problem = self._view_problem()
        if problem:
            self._ui.xrayPlace.checked = False
            self._table.say(problem)
            return
        node = source.xray_landmarks or self._new_list(
            source, _("{name}: landmarks in the X-ray"), in_xray=True
        )
        self._frame(node)
        number = self._xrays.number
        logic = xray_views.slice_logic(number)
        if xray_views.part(number, "image") is None or logic is None or not layouts.shown():
            self._show_views()
        self._place.start(node)

    def remove_selected(self) -> None:
        """Delete the selected landmark; from the CT's list only when no other X-ray uses it."""
        source, indices = self._source(), self._table.selected()
        if source is None or indices is None:
            return
        in_ct, in_xray = indices
        users = sum(each.ct_landmarks is source.ct_landmarks for each in self._xrays.sources)
        if source.xray_landmarks is not None:
            source.xray_landmarks.RemoveNthControlPoint(in_xray)
        if source.ct_landmarks is not None and users == 1:
            source.ct_landmarks.RemoveNthControlPoint(in_ct)

    def solve(self) -> None:
        """The camera from the points as they are now, shown at once."""
        source, report = self._source(), self._xrays.report()
        self._solve_timer.stop()
        if (
            source is None
            or source.camera_source is not CameraSource.LANDMARKS
            or report is None
            or report.xray is None
        ):
            self.fit = None
            self._table.show(None)
            self._remove_projected()
            return
        pairs = landmark_lists.pairs_of(source.ct_landmarks, source.xray_landmarks)
        if self.fit is not None and not pairs.same_as(self.fit.pairs):
            self._edited = True
        self.fit, self._fitted = fit_landmarks(pairs, report.xray), source.xray_landmarks
        self._table.show(self.fit)
        self._show_projected(source, self.fit)
        if source.found is None or self._edited:
            self._settle_timer.start()

    def settle(self) -> None:
        """Make the camera that was solved last the X-ray's initial one; an uncertain one is removed."""
        self._settle_timer.stop()
        sources, row = self._xrays.sources, self._row
        if self.fit is None or not 0 <= row < len(sources):
            return
        source, report = sources[row], self._xrays.reader.report(sources[row])
        xray = report.xray
        if source.camera_source is not CameraSource.LANDMARKS or xray is None:
            return
        if source.xray_landmarks is None or source.xray_landmarks is not self._fitted:
            return  # the rows were changed meanwhile
        self._edited = False
        node, solution = source.landmark_camera, self.fit.solution
        if solution is None or not self.fit.sure:
            if node is not None:
                source.xray_landmarks.SetNodeReferenceID(landmark_lists.CAMERA_REFERENCE, None)
                slicer.mrmlScene.RemoveNode(node)
            self._xrays.change({row: replace(source, found=None)})
            return
        camera = Camera(xray.intrinsics, solution.camera.extrinsic, *xray.image.shape)
        there = camera_of(node)
        if (
            there is not None
            and np.allclose(there.extrinsic, camera.extrinsic, atol=1e-9)
            and not source.found
        ):
            return
        set_camera(node or _new_camera(source.name, source.xray_landmarks), camera)
        fields = {**source.fields, "mirrored": xray.mirrored}
        self._xrays.change({row: replace(source, fields=fields, found=None)})

    def finish(self) -> None:
        """Do at once what the timers would do."""
        if self._solve_timer.isActive():
            self.solve()
        if self._settle_timer.isActive():
            self.settle()

    def _source(self) -> XraySource | None:
        return self._xrays.source if self._parameters is not None else None

    def _leave_row(self) -> None:
        """Settle what is due for the X-ray that was selected, and forget it."""
        if self._settle_timer.isActive() and self._parameters is not None:
            self.settle()
        self._solve_timer.stop()
        self._settle_timer.stop()
        self._remove_projected()
        self._place.end()
        self.fit, self._fitted, self._edited = None, None, False
        self._row = self._xrays.number

    def _chosen(self, *_ignored: Any) -> None:
        """Another list was chosen."""
        source = self._source()
        if self._showing or source is None or not self._choice.by_person(self._listed):
            return
        in_ct, in_xray = self._ui.ctLandmarks.currentNode(), self._ui.xrayLandmarks.currentNode()
        others = [each.xray_landmarks for each in self._xrays.sources if each is not source]
        if in_xray is not None and any(in_xray is each for each in (in_ct, *others)):
            self.show(self._parameters)
            self._table.say(
                _(
                    "'{name}' is already used by another X-ray or by the CT: each X-ray needs a list of its own."
                ).format(name=in_xray.GetName())
            )
            return
        if in_xray is not None:
            self._frame(in_xray)
        self._edited = True
        changed = replace(source, ct_landmarks=in_ct, xray_landmarks=in_xray)
        self._xrays.change({self._xrays.number: changed})

    def _new_list(self, source: XraySource, pattern: str, in_xray: bool) -> Any:
        node = landmark_lists.new_list(pattern.format(name=source.name), in_xray)
        if in_xray:
            self._frame(node)
        changed = {"xray_landmarks" if in_xray else "ct_landmarks": node}
        self._xrays.change({self._xrays.number: replace(source, **changed)})
        return node

    def _frame(self, node: Any) -> None:
        """Put a list of the selected X-ray into its frame, which lies where the X-ray is shown."""
        row = self._xrays.number
        xray = self._xrays.reader.report(self._xrays.sources[row]).xray
        if xray is None:
            return
        picture = picture_of(xray, self._reference())
        frame = pixel_frames.frame_above(node) or pixel_frames.new_frame(
            _("{name}: pixels").format(name=picture.name), row
        )
        frame.SetAttribute(pixel_frames.FRAME_ATTRIBUTE, str(row))
        shown = xray_views.plane_of(row, picture.xray.shape[1])
        plane = picture.plane if shown is None else shown
        pixel_frames.place(row, plane, picture.xray.shape[1], picture.mirrored)
        landmark_lists.put_into_frame(node, frame)

    def _view_problem(self) -> str:
        """Why the X-ray cannot be shown for picking; empty when it can."""
        problem = self._xrays.missing_until(self._xrays.number + 1)
        if problem:
            return problem
        if self._xrays.number >= layouts.MOST_VIEWS:
            return _("Only the first {count} X-rays can be shown: remove another one first.").format(
                count=layouts.MOST_VIEWS
            )
        if slicer.app.layoutManager() is None:
            return _("Slicer has no main window to show the views in.")
        return ""

    def _observe(self, nodes: list[Any]) -> None:
        """Notice every change of these lists, and of no others."""
        nodes = [node for node in nodes if node is not None]
        if nodes == self._observed:
            return
        for node in self._observed:
            for event in _events():
                self._host.removeObserver(node, event, self._touched)
            self._host.removeObserver(node, slicer.vtkMRMLMarkupsNode.PointAddedEvent, self._added)
        for node in nodes:
            self._host.addObserver(node, slicer.vtkMRMLMarkupsNode.PointAddedEvent, self._added)
            for event in _events():
                self._host.addObserver(node, event, self._touched)
        self._observed = nodes

    def _added(self, node: Any, _event: Any) -> None:
        landmark_lists.name_new_point(node)

    def _touched(self, *_ignored: Any) -> None:
        """A point was placed, moved, renamed or removed, or the one that follows the mouse in place mode was."""
        self._edited = self._edited or self.fit is None
        if not self._solve_timer.isActive():
            self._solve_timer.start()

    def _show_projected(self, source: XraySource, fit: LandmarkFit) -> None:
        if fit.solution is None:
            self._remove_projected()
            return
        if self._projected is None or self._projected.GetScene() is None:
            self._projected = landmark_lists.new_projected_list(_("projected landmarks"))
        frame = pixel_frames.frame_above(source.xray_landmarks)
        far = fit.solution.errors_px > NAMED_PIXELS
        names = [name if away else "" for name, away in zip(fit.pairs.names, far, strict=True)]
        landmark_lists.set_projected(self._projected, frame, names, fit.projected)

    def _remove_projected(self) -> None:
        if self._projected is not None and self._projected.GetScene() is not None:
            self._projected.GetDisplayNode().SetVisibility(
                False
            )  # a 3D view may draw removed points until then
            slicer.mrmlScene.RemoveNode(self._projected)
        self._projected = None

    def _mode_changed(self, node: Any) -> None:
        """Points are picked into a list from now on, or into none."""
        source = self._source()
        self._ui.ctPlace.checked = node is not None and source is not None and node is source.ct_landmarks
        self._ui.xrayPlace.checked = node is not None and source is not None and node is source.xray_landmarks

    @staticmethod
    def _timer(milliseconds: int, slot: Callable[[], None]) -> qt.QTimer:
        timer = qt.QTimer()
        timer.setSingleShot(True)
        timer.interval = milliseconds
        timer.connect("timeout()", slot)
        return timer


def _events() -> tuple[int, ...]:
    """What may change a camera."""
    node = slicer.vtkMRMLMarkupsNode
    return (
        node.PointModifiedEvent,
        node.PointPositionDefinedEvent,
        node.PointPositionUndefinedEvent,
        node.PointRemovedEvent,
        slicer.vtkMRMLTransformableNode.TransformModifiedEvent,
    )


def _new_camera(xray: str, landmarks: slicer.vtkMRMLMarkupsFiducialNode) -> Any:
    """A camera's transform that belongs to an X-ray's list of points."""
    name = free_name(_("Camera of {name} by landmarks").format(name=xray))
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", name)
    landmarks.SetNodeReferenceID(landmark_lists.CAMERA_REFERENCE, node.GetID())
    return node


def _number_frames(sources: list[XraySource]) -> None:
    """Let each frame follow the view of its X-ray, or none when it has no X-ray; frames without points are removed."""
    owners = {}
    for row, source in enumerate(sources):
        frame = pixel_frames.frame_above(source.xray_landmarks)
        if frame is not None:
            owners[frame.GetID()] = str(row)
    used = {node.GetTransformNodeID() for node in slicer.util.getNodesByClass("vtkMRMLMarkupsFiducialNode")}
    for frame in pixel_frames.all_frames():
        number = owners.get(frame.GetID(), pixel_frames.NO_VIEW)
        if frame.GetID() not in used:
            slicer.mrmlScene.RemoveNode(frame)
        elif frame.GetAttribute(pixel_frames.FRAME_ATTRIBUTE) != number:
            frame.SetAttribute(pixel_frames.FRAME_ATTRIBUTE, number)
