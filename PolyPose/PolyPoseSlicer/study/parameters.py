"""What the module remembers in the scene: the parameter node."""

from __future__ import annotations

import enum
import json
from collections.abc import Callable, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

from slicer import (
    vtkMRMLLinearTransformNode,
    vtkMRMLMarkupsFiducialNode,
    vtkMRMLNode,
    vtkMRMLPlotChartNode,
    vtkMRMLPlotSeriesNode,
    vtkMRMLScalarVolumeNode,
    vtkMRMLSegmentationNode,
    vtkMRMLTableNode,
    vtkMRMLTransformNode,
)
from slicer.i18n import tr as _
from slicer.parameterNodeWrapper import parameterNodeWrapper

from PolyPoseLib.data.found_camera import FoundCamera

from .camera_source import CameraSource
from .results import OutputNodes
from .xray_source import XraySource, fields_from_text

if TYPE_CHECKING:
    from slicer import vtkMRMLScriptedModuleNode


class Preset(enum.Enum):
    """How thorough a registration is; the values are PolyPoseLib's."""

    DEFAULT = "default"
    FAST = "fast"
    PAPER = "paper"

    def label(self) -> str:
        """Its label for people."""
        return {
            "default": _("Default"),
            "fast": _("Fast (for a first look)"),
            "paper": _("Paper (the published settings)"),
        }[self.value]


class Device(enum.Enum):
    """Where it is computed; the values are PolyPoseLib's."""

    AUTO = "auto"
    CPU = "cpu"
    CUDA = "cuda"

    def label(self) -> str:
        """Its label for people."""
        return {"auto": _("Automatic"), "cpu": _("Processor (CPU)"), "cuda": _("Graphics card (GPU, CUDA)")}[
            self.value
        ]


@parameterNodeWrapper
class PolyPoseParameterNode:
    """Inputs, options and outputs of the module.

    structures: JSON {segment ID: structure}; segments that are not in it do not move as a bone.
    xrayImages, xrayTexts: one entry an X-ray; see `xray_sources`. xrayCameras: its camera's transform, or None.
    xrayCtLandmarks, xrayLandmarks: its points in the CT and in the image, or None.
    options: JSON of the advanced options (PolyPoseLib.data.options) beside preset and device.
    tracking: JSON of the settings of the section Motion, see `track_request.TrackSettings`.
    carried: nodes of the CT's posture that follow the result.
    output...: None before the first registration.
    """

    ct: vtkMRMLScalarVolumeNode
    segmentation: vtkMRMLSegmentationNode
    structures: str = "{}"
    anchor: str
    xrayImages: list[vtkMRMLNode]
    xrayTexts: list[str]
    xrayCameras: list[vtkMRMLTransformNode]
    xrayCtLandmarks: list[vtkMRMLMarkupsFiducialNode]
    xrayLandmarks: list[vtkMRMLMarkupsFiducialNode]
    preset: Preset = Preset.DEFAULT
    device: Device = Device.AUTO
    options: str = "{}"
    tracking: str = "{}"
    livePreview: bool = True
    carried: list[vtkMRMLNode]
    outputTransform: vtkMRMLTransformNode
    outputVolume: vtkMRMLScalarVolumeNode
    outputSegmentation: vtkMRMLSegmentationNode
    outputMotions: vtkMRMLTableNode
    outputSimilarity: vtkMRMLTableNode
    outputSeries: vtkMRMLPlotSeriesNode
    outputPlot: vtkMRMLPlotChartNode
    outputCameras: list[vtkMRMLLinearTransformNode]
    outputRenderings: list[vtkMRMLScalarVolumeNode]
    outputXrays: list[vtkMRMLScalarVolumeNode]
    outputMessages: str = "{}"

    if TYPE_CHECKING:  # what parameterNodeWrapper adds; every node above may be None
        parameterNode: vtkMRMLScriptedModuleNode
        StartModify: Callable[[], int]
        EndModify: Callable[[int], Any]
        connectGui: Callable[[Any], int]
        disconnectGui: Callable[[int | None], None]

        def __init__(self, parameterNode: vtkMRMLScriptedModuleNode) -> None: ...


def structures_of(parameters: PolyPoseParameterNode) -> dict[str, list[str]]:
    """{structure: segment IDs} of the segments that still exist."""
    content = parameters.segmentation.GetSegmentation() if parameters.segmentation is not None else None
    groups: dict[str, list[str]] = {}
    for segment, structure in json.loads(parameters.structures or "{}").items():
        if structure and content is not None and content.GetSegment(segment) is not None:
            groups.setdefault(structure, []).append(segment)
    return groups


def xray_sources(parameters: PolyPoseParameterNode) -> list[XraySource]:
    """The X-rays of the parameter node; an entry whose image was deleted is left out."""
    sources = []
    texts = parameters.xrayTexts
    # Scenes of earlier versions have no landmarks.
    lists = list(zip_longest(parameters.xrayCtLandmarks, parameters.xrayLandmarks))[: len(texts)]
    lists += [(None, None)] * (len(texts) - len(lists))
    entries = zip(parameters.xrayImages, texts, parameters.xrayCameras, lists, strict=True)
    for image, text, camera, (ct_landmarks, xray_landmarks) in entries:
        stored = fields_from_text(text)
        path, frame = stored.pop("path", ""), stored.pop("frame", None)
        camera_source, found = CameraSource.of(stored.pop("way", None)), stored.pop("found", None)
        if image is not None or path:
            found = FoundCamera.from_dict(found) if found else None
            sources.append(
                XraySource(
                    image, path, frame, stored, camera, camera_source, ct_landmarks, xray_landmarks, found
                )
            )
    return sources


def store_xray_sources(parameters: PolyPoseParameterNode, sources: Sequence[XraySource]) -> None:
    """Remember X-rays in the parameter node, in one change."""
    was = parameters.StartModify()
    parameters.xrayImages = [each.image for each in sources]
    parameters.xrayCameras = [each.camera_transform for each in sources]
    parameters.xrayCtLandmarks = [each.ct_landmarks for each in sources]
    parameters.xrayLandmarks = [each.xray_landmarks for each in sources]
    parameters.xrayTexts = [_text_of(each) for each in sources]
    parameters.EndModify(was)


def _text_of(source: XraySource) -> str:
    """What the parameter node stores of an X-ray beside its nodes."""
    more = {"path": source.path, "frame": source.frame, "way": source.camera_source.value}
    if source.found is not None:
        more["found"] = source.found.to_dict()
    return json.dumps({**source.fields, **more})


def carried_nodes(parameters: PolyPoseParameterNode) -> list[Any]:
    """What is carried along with the result: nodes that still exist, and have not become the module's own since."""
    own = own_nodes(parameters)
    return [each for each in parameters.carried if each is not None and each not in own]


def store_carried(parameters: PolyPoseParameterNode, nodes: Sequence[Any]) -> None:
    """Remember what is carried along."""
    parameters.carried = list(nodes)


def own_nodes(parameters: PolyPoseParameterNode) -> list[Any]:
    """The nodes that the module's inputs and outputs are: what follows them is not one of them."""
    outputs = outputs_of(parameters)
    return [
        parameters.ct,
        parameters.segmentation,
        outputs.volume,
        outputs.segmentation,
        *outputs.renderings,
        *outputs.xrays,
        *parameters.xrayImages,
        *parameters.xrayLandmarks,
    ]


def options_of(parameters: PolyPoseParameterNode) -> dict:
    """The study's options: the advanced ones, preset and device; a camera model only where an X-ray uses it."""
    chosen = {"preset": parameters.preset.value, "device": parameters.device.value}
    options = {**json.loads(parameters.options or "{}"), **chosen}
    if not any(
        source.camera_source in (CameraSource.LEARNED, CameraSource.AUTO)
        for source in xray_sources(parameters)
    ):
        options.pop("camera_model", None)
    return options


def camera_model_of(parameters: PolyPoseParameterNode) -> str:
    """Path of the camera model that was trained on the CT, empty when there is none."""
    return str(json.loads(parameters.options or "{}").get("camera_model") or "")


def store_camera_model(parameters: PolyPoseParameterNode, path: str) -> None:
    """Remember the path of a camera model; an empty one forgets it."""
    options = json.loads(parameters.options or "{}")
    options.pop("camera_model", None)
    if path:
        options["camera_model"] = path
    parameters.options = json.dumps(options)


def outputs_of(parameters: PolyPoseParameterNode) -> OutputNodes:
    """The output nodes of the parameter node, to be filled again or reviewed."""
    messages = json.loads(parameters.outputMessages or "{}")
    return OutputNodes(
        transform=parameters.outputTransform,
        volume=parameters.outputVolume,
        segmentation=parameters.outputSegmentation,
        motions=parameters.outputMotions,
        similarity=parameters.outputSimilarity,
        series=parameters.outputSeries,
        plot=parameters.outputPlot,
        cameras=[each for each in parameters.outputCameras if each is not None],
        renderings=[each for each in parameters.outputRenderings if each is not None],
        xrays=[each for each in parameters.outputXrays if each is not None],
        warnings=tuple(messages.get("warnings", ())),
        distrust=tuple(messages.get("distrust", ())),
        seconds=messages.get("seconds", {}),
        device=messages.get("device", ""),
        sources=tuple(messages.get("sources", ())),
    )


def store_outputs(parameters: PolyPoseParameterNode, nodes: OutputNodes) -> None:
    """Remember the output nodes, in one change."""
    was = parameters.StartModify()
    parameters.outputTransform = nodes.transform
    parameters.outputVolume = nodes.volume
    parameters.outputSegmentation = nodes.segmentation
    parameters.outputMotions = nodes.motions
    parameters.outputSimilarity = nodes.similarity
    parameters.outputSeries = nodes.series
    parameters.outputPlot = nodes.plot
    parameters.outputCameras = list(nodes.cameras)
    parameters.outputRenderings = list(nodes.renderings)
    parameters.outputXrays = list(nodes.xrays)
    parameters.outputMessages = json.dumps(
        {
            "warnings": list(nodes.warnings),
            "distrust": list(nodes.distrust),
            "seconds": nodes.seconds,
            "device": nodes.device,
            "sources": list(nodes.sources),
        }
    )
    parameters.EndModify(was)


def missing_structures(parameters: PolyPoseParameterNode) -> str:
    """One sentence that says what is still missing of the CT and its structures; empty when nothing is."""
    if parameters.ct is None:
        return _("Choose the CT.")
    if parameters.segmentation is None:
        return _("Choose the segmentation of the CT's bones.")
    if not structures_of(parameters):
        return _("Assign at least one segment to a structure, or have the structures proposed.")
    return ""


def missing_bones(parameters: PolyPoseParameterNode) -> str:
    """One sentence that says what is still missing of CT and bones; empty when nothing is."""
    missing = missing_structures(parameters)
    if not missing and parameters.anchor not in structures_of(parameters):
        return _("Choose the anchor: the structure that stays where it is.")
    return missing


def missing_xrays(parameters: PolyPoseParameterNode) -> str:
    """One sentence that says what is still missing of the X-rays; empty when nothing is."""
    sources = xray_sources(parameters)
    if not sources:
        return _("Add an X-ray; two or more from different directions are better.")
    rigs = [source.fields["rig"] for source in sources if source.fields.get("rig")]
    alone = next((name for name in rigs if rigs.count(name) == 1), None)
    if alone is not None:
        return _(
            'The rig "{name}" has only one X-ray: enter it for another X-ray as well, or clear it.'
        ).format(name=alone)
    return ""


def missing_input(parameters: PolyPoseParameterNode) -> str:
    """One sentence that says what is still missing before a registration can start; empty when nothing is."""
    return missing_bones(parameters) or missing_xrays(parameters)
