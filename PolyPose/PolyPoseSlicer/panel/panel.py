"""The module's panel: builds the form, hands the parameter node to its parts, and ends what it started."""

from __future__ import annotations

from typing import Any

import slicer
import vtk

from ..process.renderer import Renderer
from ..process.track_folder import TRACKS
from ..scene import layouts
from ..study.parameters import PolyPoseParameterNode, missing_bones, missing_xrays, xray_sources
from ..study.snapshot import Snapshot
from ..study.track_nodes import TrackNodes
from .adjustment import AdjustmentPart
from .cameras import CameraPart
from .carm import CarmPart
from .export import ExportPart
from .landmarks import LandmarksPart
from .node_choice import NodeChoice
from .register import RegisterPart
from .review import ReviewPart
from .saving import SavingPart
from .segment_bones import SegmentPart
from .shortcuts import Shortcuts
from .steps import Steps
from .structures import StructuresPart
from .track_review import TrackReview
from .tracking import TrackPart
from .xrays import XraysPart

_INPUTS = ("ct", "segmentation")
"""Fields of the parameter node that selectors of the form fill in."""


class Panel:
    """Lives as long as the module's widget.

    It observes the scene, the parameter node and the segmentation through the widget's VTKObservationMixin, and
    leaves no observer, process or file after `cleanup`.
    """

    def __init__(self, host: Any, logic: Any) -> None:
        """host: the ScriptedLoadableModuleWidget, which is a VTKObservationMixin too."""
        self._host, self.logic = host, logic
        self.parameters: PolyPoseParameterNode | None = None
        self._connection: Any = None
        self._segmentation: Any = None
        self._refreshing = False
        form = slicer.util.loadUI(host.resourcePath("UI/PolyPose.ui"))
        host.layout.addWidget(form)
        self.ui = slicer.util.childWidgetVariables(form)
        form.setMRMLScene(slicer.mrmlScene)
        ui = self.ui
        self.renderer = Renderer(self._say)
        self.steps = Steps(ui)
        self.structures = StructuresPart(ui)
        self.segment = SegmentPart(ui, self.structures.propose)
        self.choice = NodeChoice(host, self._nodes_deleted, self._nodes_added)
        self._inputs: dict[str, str] = {}
        self.xrays = XraysPart(ui, self.choice, self._xray_selected)
        self.carm = CarmPart(ui, self.xrays, self.renderer, self._show_views)
        requirements = host.resourcePath("requirements.txt")
        self.landmarks = LandmarksPart(ui, host, self.xrays, self._show_views, self.carm.reference)
        self.cameras = CameraPart(
            ui, logic, requirements, self.xrays, self.carm.look_at, self.landmarks.finish
        )
        self.review = ReviewPart(ui, logic, self.renderer, self._reports, self.carm.reference)
        self._shortcuts = Shortcuts(
            form, {"Ctrl+Shift+B": self.review.swap_posture, "Ctrl+Shift+F": self.review.swap_flicker}
        )
        self.saving = SavingPart(ui, self.review)
        self.export = ExportPart(ui, requirements)
        self.register = RegisterPart(ui, logic, requirements, self._result_came, self._changed)
        self.adjustment = AdjustmentPart(ui, self.review, self.register)
        self.tracking = TrackPart(ui, logic, requirements, self.xrays.reader, self._track_came, self._changed)
        self.track_review = TrackReview(ui, host, self.tracking.start, self.tracking.say)
        scene = slicer.mrmlScene
        host.addObserver(scene, scene.StartCloseEvent, self._scene_closes)
        host.addObserver(scene, scene.EndCloseEvent, self._scene_closed)
        host.addObserver(scene, scene.StartImportEvent, self._scene_imports)
        host.addObserver(scene, scene.EndImportEvent, self._scene_imported)
        slicer.app.connect("aboutToQuit()", self.stop)
        self.use(logic.getParameterNode())

    def enter(self) -> None:
        """The module is opened."""
        self.use(self.logic.getParameterNode())
        self._shortcuts.start()
        self._show_pictures_again()

    def exit(self) -> None:
        """Another module is opened: registration, tracking, search and segmentation go on, everything else stops."""
        self._shortcuts.stop()
        self.carm.stop()
        self.adjustment.stop()
        self.track_review.stop()
        self.review.pause()
        self.renderer.close()
        self.use(None)

    def cleanup(self) -> None:
        """The module is reloaded or the application ends."""
        slicer.app.disconnect("aboutToQuit()", self.stop)
        self._shortcuts.stop()
        self.stop()
        self.adjustment.close()
        self.review.close()
        self.use(None)

    def stop(self) -> None:
        """End every process and timer, and remove their files."""
        self.segment.close()
        self.xrays.close()
        self.carm.stop()
        self.cameras.close()
        self.landmarks.stop()
        self.register.close()
        self.tracking.close()
        self.track_review.close()
        self.export.close()
        self.review.pause()
        self.renderer.close()
        self.choice.close()

    def use(self, parameters: PolyPoseParameterNode | None) -> None:
        """Follow another parameter node, or none."""
        if self.parameters is not None:
            self.landmarks.stop()
            self.parameters.disconnectGui(self._connection)
            self._host.removeObserver(
                self.parameters.parameterNode, vtk.vtkCommand.ModifiedEvent, self._changed
            )
        self.parameters, self._connection = parameters, None
        if parameters is not None:
            self._connection = parameters.connectGui(self.ui)
            self._host.addObserver(parameters.parameterNode, vtk.vtkCommand.ModifiedEvent, self._changed)
        self._changed()

    def _changed(self, *_ignored: Any) -> None:
        """The parameter node, or the segmentation, changed."""
        if self._refreshing:
            return
        self._refreshing = True
        try:
            parameters = self.parameters
            if parameters is not None:
                self._remember_inputs(parameters)
            self._observe_segmentation(parameters.segmentation if parameters is not None else None)
            self.structures.show(parameters)
            self.segment.show(parameters)
            self.xrays.show(parameters)
            self.cameras.show(parameters)
            self.landmarks.show(parameters)
            self.carm.show(parameters)
            unready = self.xrays.missing_until()
            self.register.show(parameters, unready)
            self.review.show(parameters, self.register.running)
            self.saving.show(parameters)
            self.export.show(parameters)
            self.adjustment.show(parameters)
            self.tracking.show(parameters)
            self.track_review.show(parameters, self.tracking.running, self.tracking.missing)
            self._show_steps(parameters, unready)
        finally:
            self._refreshing = False

    def _show_steps(self, parameters: PolyPoseParameterNode | None, unready: str) -> None:
        """Mark the steps that are done; unready: what an X-ray still lacks, or empty."""
        if parameters is not None:
            self.steps.show(
                {
                    "inputsSection": not missing_bones(parameters),
                    "xraysSection": not (missing_xrays(parameters) or unready),
                    "cameraSection": self.xrays.have_cameras,
                    "reviewSection": parameters.outputTransform is not None,
                    "motionSection": self.track_review.nodes is not None,
                }
            )

    def _remember_inputs(self, parameters: PolyPoseParameterNode) -> None:
        """Note the inputs, but not what a selector chose in the place of one that was deleted."""
        for name in _INPUTS:
            node = getattr(parameters, name)
            if self.choice.by_person([self._inputs.get(name, "")]):
                self._inputs[name] = node.GetID() if node is not None else ""

    def _nodes_deleted(self) -> None:
        """Nodes were deleted: what a selector chose in the place of an input is taken back."""
        parameters = self.parameters
        if parameters is None:
            return
        for name, identifier in self._inputs.items():
            if identifier and slicer.mrmlScene.GetNodeByID(identifier) is None:
                self._inputs[name] = ""
                setattr(parameters, name, None)
        self._changed()

    def _nodes_added(self) -> None:
        """Nodes were added: they may be carried along."""
        self.review.list_carriable()

    def _observe_segmentation(self, node: Any) -> None:
        """Notice segments that are added, removed or renamed."""
        if node is self._segmentation:
            return
        content = slicer.vtkSegmentation
        for event in (content.SegmentAdded, content.SegmentRemoved, content.SegmentModified):
            if self._segmentation is not None:
                self._host.removeObserver(self._segmentation, event, self._changed)
            if node is not None:
                self._host.addObserver(node, event, self._changed)
        self._segmentation = node

    def _scene_closes(self, *_ignored: Any) -> None:
        self.stop()
        TRACKS.remove()
        self.adjustment.close()
        self.review.undo.forget()
        self.review.close()
        self.use(None)

    def _scene_closed(self, *_ignored: Any) -> None:
        self.choice.close()  # nodes that come next get the IDs of those that went
        if self._host.parent.isEntered:
            self.use(self.logic.getParameterNode())

    def _scene_imports(self, *_ignored: Any) -> None:
        """A scene is about to be added: selectors are emptied meanwhile, which is not the user's choice."""
        self.adjustment.close()
        self.review.undo.forget()
        self.use(None)

    def _scene_imported(self, *_ignored: Any) -> None:
        """A scene was loaded: its parameter node replaces ours."""
        if self._host.parent.isEntered:
            self.use(self.logic.getParameterNode())
            self._show_pictures_again()

    def _show_pictures_again(self) -> None:
        """Draw the pictures of a scene that was saved in our layout: they are not saved with it."""
        if layouts.shown() and not self.review.pictures.items:
            self._show_views()

    def _result_came(self, nodes: Any, before: Snapshot) -> None:
        """Show a new result, unless another module is open; it can be undone in either case."""
        self.adjustment.close()
        self.review.undo.remember(before)
        if self.parameters is not None:
            self.review.result_came(nodes)
            self.steps.open("reviewSection")

    def _track_came(self, nodes: TrackNodes) -> None:
        """Show a new track, unless another module is open."""
        if self.parameters is not None:
            self._changed()
            self.steps.open("motionSection")
            nodes.show_layout()

    def _reports(self) -> list[Any]:
        sources = xray_sources(self.parameters) if self.parameters is not None else []
        return [self.xrays.reader.report(source) for source in sources]

    def _xray_selected(self) -> None:
        self.cameras.show(self.parameters)
        self.landmarks.show(self.parameters)
        self.carm.xray_selected()
        self.review.follow_cameras()

    def _show_views(self) -> None:
        self.review.show_layout()

    def _say(self, text: str) -> None:
        """Something could not be rendered."""
        self.ui.carmStatus.text = text
        if not self.ui.carmLive.checked:
            self.ui.reviewState.text = text
