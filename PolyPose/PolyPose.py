"""PolyPose in 3D Slicer: one CT aligned to two or more X-rays, bone by bone. The four classes Slicer looks for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from PolyPoseSlicer.process.camera_run import CameraRun
    from PolyPoseSlicer.process.registration import Registration
    from PolyPoseSlicer.study.parameters import PolyPoseParameterNode
    from PolyPoseSlicer.study.results import OutputNodes

    from PolyPoseLib.data.progress import Progress


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
        slicer.app.connect("startupCompleted()", registerWithApplication)


def registerWithApplication() -> None:
    """Make the layouts known, and offer the sample data in the module Sample Data; nothing in a Slicer too old."""
    if environment.version_problem():
        return
    from PolyPoseSlicer import samples
    from PolyPoseSlicer.scene import layouts

    layouts.register()
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

    Every failure is a PolyPoseLib.errors.PolyPoseError whose text is one sentence.
    """

    def getParameterNode(self) -> PolyPoseParameterNode:
        """The scene's PolyPoseSlicer.study.parameters.PolyPoseParameterNode; made when there is none."""
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
        progress: Callable[[Progress], None] | None = None,
    ) -> OutputNodes:
        """Register nodes and wait for the result.

        Parameters
        ----------
        ctNode : vtkMRMLScalarVolumeNode
            The preoperative CT in HU, taken as it is shown, its transforms included; never changed.
        segmentationNode : vtkMRMLSegmentationNode
            Its bones, taken as they are shown; never changed.
        structures : dict of str to sequence of str, or sequence of str
            {structure: names or IDs of the segments that move together}, or names of segments that each move by
            themselves.
        xrays : sequence of XraySource, image node, or path
            One entry per X-ray; PolyPoseSlicer.study.xray_source.XraySource also holds what is known of its geometry.
        anchor : str
            The structure that stays where it is and defines the cameras.
        outputTransform : vtkMRMLTransformNode, optional
            Filled with the map from the X-rays' posture, which the views show, to the CT; made when it is None.
        outputVolume : vtkMRMLScalarVolumeNode, optional
            Filled with the CT in the X-rays' posture, in HU; made when it is None.
        outputSegmentation : vtkMRMLSegmentationNode, optional
            Filled with the bones in the X-rays' posture; made when it is None.
        options : dict, optional
            As in PolyPoseLib.data.options, such as {"preset": "fast"}.
        outputFolder : path, optional
            Where to keep the result folder; None keeps the nodes only.
        progress : callable, optional
            Called with each PolyPoseLib.data.progress.Progress; an exception in it stops the registration.

        Returns
        -------
        PolyPoseSlicer.study.results.OutputNodes
            The three output nodes, and tables, cameras, renderings and warnings.

        Raises
        ------
        InputError
            Something is missing or wrong.
        UntrustedResultError
            The nodes were made, but the result must not be trusted.
        CancelledError
            It was cancelled.
        PolyPoseError
            Any other failure; the text is one sentence.

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
    ) -> Registration:
        """Start a registration of nodes and return at once.

        Parameters
        ----------
        ctNode, segmentationNode, structures, xrays, anchor
            As in `register`.
        outputTransform, outputVolume, outputSegmentation, options, outputFolder
            As in `register`.
        preview : bool
            Refresh outputTransform while the registration runs.

        Returns
        -------
        PolyPoseSlicer.process.registration.Registration
            Call its `poll` on the main thread until `state.ended`, or `wait`.

        Raises
        ------
        InputError
            Something is missing or wrong.

        """
        from PolyPoseSlicer.calls import Request, start
        from PolyPoseSlicer.study.results import OutputNodes

        nodes = OutputNodes(outputTransform, outputVolume, outputSegmentation)
        inputs = (ctNode, segmentationNode, structures, xrays, anchor)
        return start(Request(*inputs, nodes, options, outputFolder, preview))

    def registerParameters(
        self,
        parameterNode: PolyPoseParameterNode | None = None,
        progress: Callable[[Progress], None] | None = None,
    ) -> OutputNodes:
        """Register what a parameter node asks for, wait, and store the output nodes in it.

        Parameters
        ----------
        parameterNode : PolyPoseParameterNode, optional
            The scene's own when it is None.
        progress : callable, optional
            As in `register`.

        Returns
        -------
        PolyPoseSlicer.study.results.OutputNodes

        Raises
        ------
        PolyPoseError
            As in `register`; after UntrustedResultError the output nodes are stored as well.

        """
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
        parameterNode: PolyPoseParameterNode | None = None,
        preview: bool | None = None,
        outputFolder: str | Path | None = None,
    ) -> Registration:
        """Start a registration of what a parameter node asks for and return at once.

        Parameters
        ----------
        parameterNode : PolyPoseParameterNode, optional
            The scene's own when it is None.
        preview : bool, optional
            Refresh the output transform while the registration runs; None leaves that to the parameter node.
        outputFolder : path, optional
            Where to keep the result folder.

        Returns
        -------
        PolyPoseSlicer.process.registration.Registration
            When it has ended, PolyPoseSlicer.study.parameters.store_outputs puts its nodes into the parameter node.

        Raises
        ------
        InputError
            Something is missing or wrong.

        """
        from PolyPoseSlicer.calls import start_parameters

        return start_parameters(parameterNode or self.getParameterNode(), preview, outputFolder)

    def startRefinement(
        self,
        adjustments: Mapping[str, Any],
        parameterNode: PolyPoseParameterNode | None = None,
        outputFolder: str | Path | None = None,
    ) -> Registration:
        """Fit the bones of a parameter node's result again, from where they are or were moved by hand.

        Parameters
        ----------
        adjustments : dict of str to (4, 4) array
            How bones were moved in the X-rays' posture, LPS mm; the others start where the result has them. None is
            looked for elsewhere.
        parameterNode : PolyPoseParameterNode, optional
            The scene's own when it is None.
        outputFolder : path, optional
            Where to keep the result folder.

        Returns
        -------
        PolyPoseSlicer.process.registration.Registration
            As `startParameters` gives it.

        Raises
        ------
        InputError
            Something is missing or wrong, or there is no result.

        """
        from PolyPoseSlicer.calls import start_refinement

        return start_refinement(parameterNode or self.getParameterNode(), adjustments, outputFolder)

    def startCameras(
        self, numbers: Sequence[int], parameterNode: PolyPoseParameterNode | None = None
    ) -> CameraRun:
        """Start to look for the initial cameras of some X-rays, each from its camera source; stores nothing.

        Parameters
        ----------
        numbers : sequence of int
            Of the parameter node's X-rays, from 0.
        parameterNode : PolyPoseParameterNode, optional
            The scene's own when it is None.

        Returns
        -------
        PolyPoseSlicer.process.camera_run.CameraRun
            Call its `poll` on the main thread until `state.ended`; then `found` holds a
            PolyPoseLib.data.found_camera.FoundCamera for each entry of numbers, by its place in it.

        Raises
        ------
        InputError
            Something is missing or wrong.

        """
        from PolyPoseSlicer.calls import start_cameras

        return start_cameras(parameterNode or self.getParameterNode(), numbers)

    def loadResult(self, folder: str | Path, ctNode: Any = None, segmentationNode: Any = None) -> OutputNodes:
        """Open the result folder of an earlier registration.

        Parameters
        ----------
        folder : path
            As the registration wrote it.
        ctNode : vtkMRMLScalarVolumeNode, optional
            Gives the warped CT its window and level.
        segmentationNode : vtkMRMLSegmentationNode, optional
            Gives the segments their names and colours; the one that the folder was made from.

        Returns
        -------
        PolyPoseSlicer.study.results.OutputNodes

        Raises
        ------
        InputError
            The folder holds no complete result; nothing was added to the scene.

        """
        from PolyPoseSlicer.calls import load

        return load(folder, ctNode, segmentationNode)

    def missingInput(self, parameterNode: PolyPoseParameterNode | None = None) -> str:
        """One sentence that says what is still missing before a registration can start; empty when nothing is.

        Parameters
        ----------
        parameterNode : PolyPoseParameterNode, optional
            The scene's own when it is None.

        """
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
