"""What Slicer's Python console calls to register: nodes in, nodes out, without the panel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slicer.ScriptedLoadableModule import ScriptedLoadableModuleLogic

from .process import environment

if TYPE_CHECKING:
    from PolyPoseLib.data.progress import Progress

    from .process.camera_run import CameraRun
    from .process.registration import Registration
    from .study.parameters import PolyPoseParameterNode
    from .study.results import OutputNodes


class RegistrationLogic(ScriptedLoadableModuleLogic):
    """The part of PolyPoseLogic that registers.

    Every failure is a PolyPoseLib.errors.PolyPoseError whose text is one sentence.
    """

    def getParameterNode(self) -> PolyPoseParameterNode:
        """The scene's PolyPoseSlicer.study.parameters.PolyPoseParameterNode; made when there is none."""
        from .scene.grid_transform import keep_linear
        from .study.parameters import PolyPoseParameterNode

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
        from .calls import Request, start
        from .study.results import OutputNodes

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
        from PolyPoseLib.errors import UntrustedResultError

        from .study.parameters import store_outputs

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
        from .calls import start_parameters

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
        from .calls import start_refinement

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
        from .calls import start_cameras

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
        from .calls import load

        return load(folder, ctNode, segmentationNode)

    def missingInput(self, parameterNode: PolyPoseParameterNode | None = None) -> str:
        """One sentence that says what is still missing before a registration can start; empty when nothing is.

        Parameters
        ----------
        parameterNode : PolyPoseParameterNode, optional
            The scene's own when it is None.

        """
        from .study.parameters import missing_input

        return environment.version_problem() or missing_input(parameterNode or self.getParameterNode())
