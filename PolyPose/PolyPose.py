"""PolyPose in 3D Slicer: one CT aligned to two or more X-rays, bone by bone. The four classes Slicer looks for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import slicer
from slicer.i18n import tr as _
from slicer.i18n import translate
from slicer.ScriptedLoadableModule import (
    ScriptedLoadableModule,
    ScriptedLoadableModuleLogic,
    ScriptedLoadableModuleTest,
    ScriptedLoadableModuleWidget,
)
from slicer.util import VTKObservationMixin

if str(Path(__file__).parent) not in sys.path:
    sys.path.insert(0, str(Path(__file__).parent))

from PolyPoseSlicer.process import environment

environment.make_core_importable()


class PolyPose(ScriptedLoadableModule):
    """What the application shows of the module before it is opened."""

    def __init__(self, parent: Any) -> None:
        """Fill in the module's description."""
        super().__init__(parent)
        parent.title = "PolyPose"
        parent.categories = [translate("qSlicerAbstractCoreModule", "Registration")]
        parent.dependencies = []
        parent.contributors = ["PolyPose contributors"]
        parent.helpText = _(
            "Aligns one CT to two or more X-rays of the same patient in another posture: every bone keeps its "
            "shape and gets its own rigid motion, soft tissue follows smoothly. Research software, not for "
            "clinical decisions."
        )
        parent.acknowledgementText = _(
            "The method is the polyrigid 2D/3D registration of Gopalakrishnan et al. (PolyPose, 2025)."
        )
        slicer.app.connect("startupCompleted()", registerSampleData)


def registerSampleData() -> None:
    """Offer the sample data in the module Sample Data; does nothing in a Slicer that is too old."""
    if environment.version_problem():
        return
    from PolyPoseSlicer import samples

    samples.register(lambda: PolyPoseLogic().getParameterNode())


class PolyPoseWidget(ScriptedLoadableModuleWidget, VTKObservationMixin):
    """The module's panel; PolyPoseSlicer.panel builds and runs it."""

    def __init__(self, parent: Any = None) -> None:
        """Called when the module is opened for the first time."""
        ScriptedLoadableModuleWidget.__init__(self, parent)
        VTKObservationMixin.__init__(self)
        self.panel: Any = None

    def setup(self) -> None:
        """Build the panel, or say in its place that this Slicer is too old."""
        super().setup()
        problem = environment.version_problem()
        if problem:
            import qt

            label = qt.QLabel(problem)
            label.wordWrap = True
            self.layout.addWidget(label)
            return
        from PolyPoseSlicer.panel.panel import Panel

        self.panel = Panel(self, PolyPoseLogic())

    def enter(self) -> None:
        """Called each time the module is opened."""
        if self.panel is not None:
            self.panel.enter()

    def exit(self) -> None:
        """Called each time another module is opened."""
        if self.panel is not None:
            self.panel.exit()

    def cleanup(self) -> None:
        """Called when the module is reloaded and when the application ends."""
        if self.panel is not None:
            self.panel.cleanup()
            self.panel = None
        self.removeObservers()


class PolyPoseLogic(ScriptedLoadableModuleLogic):
    """Registers nodes of the scene; needs no panel.

    Everything that goes wrong is a PolyPoseLib.errors.PolyPoseError whose text is one sentence.
    """

    def getParameterNode(self) -> Any:
        """The scene's PolyPoseSlicer.study.parameters.PolyPoseParameterNode."""
        from PolyPoseSlicer.scene.grid_transform import keep_linear
        from PolyPoseSlicer.study.parameters import PolyPoseParameterNode

        parameters = PolyPoseParameterNode(super().getParameterNode())
        keep_linear(parameters.outputTransform)
        return parameters

    def register(
        self,
        ctNode: Any,
        segmentationNode: Any,
        structures: Mapping[str, Sequence[str]] | Sequence[str],
        xrays: Sequence[Any],
        anchor: str,
        outputTransform: Any = None,
        outputVolume: Any = None,
        outputSegmentation: Any = None,
        options: Mapping[str, Any] | None = None,
        outputFolder: str | Path | None = None,
        progress: Callable[[Any], None] | None = None,
    ) -> Any:
        """Register and wait; returns PolyPoseSlicer.study.results.OutputNodes.

        ctNode, segmentationNode: taken as they are shown, their transforms included; never changed.
        structures: {structure: names or IDs of segments}, or names of segments that each move by themselves.
        xrays: PolyPoseSlicer.study.xray_source.XraySource, image node, or path of a file each.
        anchor: the structure that stays where it is.
        output...: nodes to fill; made when they are None. outputTransform maps from the X-rays' posture, which
            the views show, to the CT, which lies under it.
        options: as in PolyPoseLib.data.options, such as {"preset": "fast"}.
        outputFolder: where to keep the result folder.
        progress: called with each PolyPoseLib.data.progress.Progress.

        Raises InputError (something is missing or wrong), UntrustedResultError (the nodes are made, but must
        not be trusted), CancelledError, or another PolyPoseError.
        """
        registration = self.startRegistration(
            ctNode,
            segmentationNode,
            structures,
            xrays,
            anchor,
            outputTransform,
            outputVolume,
            outputSegmentation,
            options,
            outputFolder,
        )
        return registration.wait(progress)

    def startRegistration(
        self,
        ctNode: Any,
        segmentationNode: Any,
        structures: Mapping[str, Sequence[str]] | Sequence[str],
        xrays: Sequence[Any],
        anchor: str,
        outputTransform: Any = None,
        outputVolume: Any = None,
        outputSegmentation: Any = None,
        options: Mapping[str, Any] | None = None,
        outputFolder: str | Path | None = None,
        preview: bool = False,
    ) -> Any:
        """As `register`, but returns at once a `process.registration.Registration`, which has to be polled.

        preview: refresh outputTransform while it runs.
        """
        from PolyPoseSlicer.calls import start
        from PolyPoseSlicer.study.results import OutputNodes

        nodes = OutputNodes(outputTransform, outputVolume, outputSegmentation)
        return start(
            ctNode, segmentationNode, structures, xrays, anchor, nodes, options, outputFolder, preview
        )

    def registerParameters(
        self, parameterNode: Any = None, progress: Callable[[Any], None] | None = None
    ) -> Any:
        """Register what a parameter node says, wait, store the outputs in it and return them."""
        from PolyPoseSlicer.study.parameters import store_outputs

        from PolyPoseLib.errors import UntrustedResultError

        parameters = parameterNode or self.getParameterNode()
        registration = self.startParameters(parameters, preview=False)
        try:
            return registration.wait(progress)
        finally:
            if registration.error is None or isinstance(registration.error, UntrustedResultError):
                store_outputs(parameters, registration.nodes)

    def startParameters(
        self,
        parameterNode: Any = None,
        preview: bool | None = None,
        outputFolder: str | Path | None = None,
    ) -> Any:
        """As `startRegistration`, from a parameter node; PolyPoseSlicer.study.parameters.store_outputs at its end."""
        from PolyPoseSlicer.calls import start_parameters

        return start_parameters(parameterNode or self.getParameterNode(), preview, outputFolder)

    def startCameras(self, numbers: Sequence[int], parameterNode: Any = None) -> Any:
        """Look for the first cameras of some X-rays of a parameter node, counted from 0, by their chosen ways.

        Returns at once a `process.camera_run.CameraRun`, which has to be polled; `found` tells how sure each
        camera is. Nothing is stored. Raises InputError when something is missing or wrong.
        """
        from PolyPoseSlicer.calls import start_cameras

        return start_cameras(parameterNode or self.getParameterNode(), numbers)

    def loadResult(self, folder: str | Path, ctNode: Any = None, segmentationNode: Any = None) -> Any:
        """Open the folder of an earlier registration; returns PolyPoseSlicer.study.results.OutputNodes.

        segmentationNode: gives the segments their names and colours when the folder was made from it.
        Raises InputError when the folder holds no whole result.
        """
        from PolyPoseSlicer.calls import load

        return load(folder, ctNode, segmentationNode)

    def missingInput(self, parameterNode: Any = None) -> str:
        """One sentence that says what is still missing, empty when a registration can start."""
        from PolyPoseSlicer.study.parameters import missing_input

        return environment.version_problem() or missing_input(parameterNode or self.getParameterNode())


class PolyPoseTest(ScriptedLoadableModuleTest):
    """The self test that `Reload and Test` and Slicer's test runner call."""

    def setUp(self) -> None:
        """Start from an empty scene."""
        slicer.mrmlScene.Clear()

    def runTest(self) -> None:
        """All tests."""
        from PolyPoseSlicer import self_test

        self.setUp()
        tests = (
            (self_test.test_frames, ()),
            (self_test.test_study, ()),
            (self_test.test_registration, (PolyPoseLogic(),)),
        )
        for test, needs in tests:
            self.delayDisplay((test.__doc__ or test.__name__).splitlines()[0])
            test(self, *needs)
            slicer.mrmlScene.Clear()
