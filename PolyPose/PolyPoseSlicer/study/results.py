"""Puts a loaded result into the scene: one node per step, so that the panel stays responsive."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from ..scene.cameras import plane_to_ras, set_camera
from ..scene.frames import flip_affine
from ..scene.grid_transform import set_grid_transform
from ..scene.motions import Motion, fill_motion_table, set_table
from ..scene.names import free_name
from ..scene.nodes import Grid, Layer, Voxels, set_layer, set_volume
from .loading import LoadedResult

DETECTOR_MARGIN = 1.05
"""A detector at an unknown distance is drawn this much farther than the farthest corner of the CT."""


@dataclass
class OutputNodes:
    """The nodes of a result; those that are None are made.

    Parameters
    ----------
    transform : vtkMRMLTransformNode, optional
        A displacement grid from the X-rays' posture, which the views show, to the CT.
    volume, segmentation : nodes, optional
        The CT in HU and its segments in the X-rays' posture.
    motions : vtkMRMLTableNode, optional
        One row per structure, see PolyPoseSlicer.scene.motions.
    similarity, series, plot : nodes, optional
        The similarity over the iterations.
    cameras : list of vtkMRMLLinearTransformNode
        From each camera's axes to the world, see PolyPoseSlicer.scene.cameras.
    renderings, xrays : lists of vtkMRMLScalarVolumeNode
        Each view's final rendering and X-ray, on the detector's plane.
    made : list of vtkMRMLNode
        Those that did not exist before.
    warnings, distrust : tuples of str
        What a person should check, doubtful bones included, and why the result must not be trusted.
    seconds : dict
        Computing time by stage, and in all ("total").
    device : str
        Where it was computed.
    report : bytes, optional
        The picture report.png.
    sources : tuple of str
        Identities of the X-rays from which it was made, in the order of its cameras; empty when they are not known.

    """

    transform: slicer.vtkMRMLTransformNode | None = None
    volume: slicer.vtkMRMLScalarVolumeNode | None = None
    segmentation: slicer.vtkMRMLSegmentationNode | None = None
    motions: slicer.vtkMRMLTableNode | None = None
    similarity: slicer.vtkMRMLTableNode | None = None
    series: slicer.vtkMRMLPlotSeriesNode | None = None
    plot: slicer.vtkMRMLPlotChartNode | None = None
    cameras: list[slicer.vtkMRMLLinearTransformNode] = field(default_factory=list)
    renderings: list[slicer.vtkMRMLScalarVolumeNode] = field(default_factory=list)
    xrays: list[slicer.vtkMRMLScalarVolumeNode] = field(default_factory=list)
    made: list[slicer.vtkMRMLNode] = field(default_factory=list)
    warnings: tuple[str, ...] = ()
    distrust: tuple[str, ...] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    device: str = ""
    report: bytes | None = None
    sources: tuple[str, ...] = ()

    @property
    def trusted(self) -> bool:
        """Whether no check failed."""
        return not self.distrust

    def remove_made(self) -> None:
        """Remove the nodes that were made for a result that failed."""
        for node in self.made:
            if node.GetScene() is not None:
                node.GetScene().RemoveNode(node)
        self.made.clear()


@dataclass(frozen=True)
class SegmentStyle:
    """What a segment keeps through a registration: its name, colour and terminology (tags)."""

    segment: slicer.vtkSegment
    identifier: str

    @classmethod
    def all_of(cls, segmentation: slicer.vtkMRMLSegmentationNode | None) -> list[SegmentStyle]:
        """Copies of all segments' styles, without their voxels."""
        if segmentation is None:
            return []
        content = segmentation.GetSegmentation()
        styles = []
        for identifier in content.GetSegmentIDs():
            copy = slicer.vtkSegment()
            copy.DeepCopyMetadata(content.GetSegment(identifier))
            styles.append(cls(copy, identifier))
        return styles


BONE_WINDOW_LEVEL = (1000.0, 400.0)
"""Window and level in HU for a warped CT whose CT is not known."""


@dataclass(frozen=True)
class InputStyle:
    """How the inputs are shown, copied so that no node is needed later."""

    segments: list[SegmentStyle] = field(default_factory=list)
    window_level: tuple[float, float] = BONE_WINDOW_LEVEL

    @classmethod
    def of(
        cls,
        ct: slicer.vtkMRMLScalarVolumeNode | None,
        segmentation: slicer.vtkMRMLSegmentationNode | None,
    ) -> InputStyle:
        """The style of a CT and a segmentation; either may be None."""
        display = ct.GetScalarVolumeDisplayNode() if ct is not None else None
        shown = BONE_WINDOW_LEVEL if display is None else (display.GetWindow(), display.GetLevel())
        return cls(SegmentStyle.all_of(segmentation), shown)


def fill_nodes(loaded: LoadedResult, nodes: OutputNodes, style: InputStyle, name: str) -> Iterator[None]:
    """Make and fill the nodes one by one; yields after each.

    style: of the inputs; number n of its segments has label n + 1 in the result.
    name: begins the names of new nodes.
    """
    from PolyPoseLib.io.report.words import cautions

    result = loaded.result
    nodes.warnings, nodes.distrust = tuple(cautions(result)), tuple(result.distrust)
    nodes.seconds, nodes.device, nodes.report = dict(result.seconds), result.device, loaded.report
    nodes.transform = _node(nodes, nodes.transform, "vtkMRMLGridTransformNode", _("{name} transform"), name)
    set_grid_transform(nodes.transform, result.transform.vectors, result.transform.affine)
    yield
    nodes.volume = _node(nodes, nodes.volume, "vtkMRMLScalarVolumeNode", _("{name} warped CT"), name)
    set_volume(
        nodes.volume, result.warped_ct.voxels, flip_affine(result.warped_ct.affine), style.window_level
    )
    yield
    segmentation = nodes.segmentation = _node(
        nodes, nodes.segmentation, "vtkMRMLSegmentationNode", _("{name} warped segmentation"), name
    )
    yield from _fill_segmentation(segmentation, loaded, style.segments)
    # The Segment Editor and exports to label maps take their grid from it.
    segmentation.SetReferenceImageGeometryParameterFromVolumeNode(nodes.volume)
    nodes.motions = _node(nodes, nodes.motions, "vtkMRMLTableNode", _("{name} motions"), name)
    fill_motion_table(nodes.motions, motions_from(loaded))
    yield
    _fill_plot(nodes, result.history, name)
    yield
    yield from _fill_views(loaded, nodes, name)


def _node(nodes: OutputNodes, given: Any, kind: str, pattern: str, name: str) -> Any:
    """The given node while it is in the scene, otherwise a new one."""
    if given is not None and given.GetScene() is not None:
        return given
    node = slicer.mrmlScene.AddNewNodeByClass(kind, free_name(pattern.format(name=name)))
    nodes.made.append(node)
    return node


def _fill_segmentation(
    node: slicer.vtkMRMLSegmentationNode, loaded: LoadedResult, styles: list[SegmentStyle]
) -> Iterator[None]:
    """Warped segments with the names, colours and terminology that they had."""
    warped = loaded.result.warped_labels
    labels = {
        styles[number - 1].identifier if number <= len(styles) else f"Label_{number}": number
        for number in loaded.labels
    }
    whole = Layer(Voxels(warped.voxels, Grid(warped.affine, warped.voxels.shape)), labels)
    was = node.StartModify()
    node.SetAndObserveTransformNodeID(None)
    content = node.GetSegmentation()
    content.RemoveAllSegments()
    content.SetSourceRepresentationName(
        slicer.vtkSegmentationConverter.GetSegmentationBinaryLabelmapRepresentationName()
    )
    known = {style.identifier: style.segment for style in styles}
    order = [style.identifier for style in styles] + [each for each in labels if each not in known]
    layers = [whole, *loaded.overlapping]
    images = [_layer_image(layer) for layer in layers]
    for identifier in order:
        for layer, image in reversed(list(zip(layers, images, strict=True))):
            if identifier in layer.labels:
                _add_segment(content, identifier, known.get(identifier), image, layer.labels[identifier])
                break
    node.CreateDefaultDisplayNodes()
    node.EndModify(was)
    yield


def _layer_image(layer: Layer) -> slicer.vtkOrientedImageData:
    image = slicer.vtkOrientedImageData()
    set_layer(image, layer.voxels)
    return image


def _add_segment(
    content: slicer.vtkSegmentation,
    identifier: str,
    style: slicer.vtkSegment | None,
    image: slicer.vtkOrientedImageData,
    label: int,
) -> None:
    """Add one segment that shares its layer with others."""
    segment = slicer.vtkSegment()
    if style is not None:
        segment.DeepCopyMetadata(style)
    else:
        segment.SetName(_("Label {number}").format(number=label))
    segment.SetLabelValue(label)
    name = slicer.vtkSegmentationConverter.GetSegmentationBinaryLabelmapRepresentationName()
    segment.AddRepresentation(name, image)
    content.AddSegment(segment, identifier)


def motions_from(loaded: LoadedResult) -> dict[str, Motion]:
    """The motion of each structure from the CT to the X-rays' posture."""
    return {
        name: Motion(
            np.linalg.inv(each.fixed_to_moving), loaded.centroids.get(name), each.uncertainty, each.doubts
        )
        for name, each in loaded.result.structures.items()
    }


def _fill_plot(nodes: OutputNodes, history: list[dict[str, Any]], name: str) -> None:
    """A table of the similarity and a chart that shows it."""
    known = [each for each in history if isinstance(each.get("similarity"), (int, float))]
    nodes.similarity = _node(nodes, nodes.similarity, "vtkMRMLTableNode", _("{name} similarity"), name)
    fill_similarity_table(nodes.similarity, [float(each["similarity"]) for each in known])
    nodes.series = _node(nodes, nodes.series, "vtkMRMLPlotSeriesNode", _("{name} similarity curve"), name)
    nodes.plot = _node(nodes, nodes.plot, "vtkMRMLPlotChartNode", _("{name} similarity plot"), name)
    set_plot(nodes.plot, nodes.series, nodes.similarity)


def fill_similarity_table(node: slicer.vtkMRMLTableNode, similarities: list[float]) -> None:
    """A table with one row per iteration."""
    numbers = [float(number) for number in range(1, len(similarities) + 1)]
    set_table(node, {"iteration": numbers, "similarity": similarities})


def set_plot(
    chart: slicer.vtkMRMLPlotChartNode,
    series: slicer.vtkMRMLPlotSeriesNode,
    table: slicer.vtkMRMLTableNode,
) -> None:
    """Let a chart show the similarity over the iterations."""
    series.SetAndObserveTableNodeID(table.GetID())
    series.SetXColumnName("iteration")
    series.SetYColumnName("similarity")
    series.SetPlotType(slicer.vtkMRMLPlotSeriesNode.PlotTypeScatter)
    series.SetMarkerStyle(slicer.vtkMRMLPlotSeriesNode.MarkerStyleNone)
    chart.RemoveAllPlotSeriesNodeIDs()
    chart.AddAndObservePlotSeriesNodeID(series.GetID())
    chart.SetTitle(_("Similarity"))
    chart.SetXAxisTitle(_("Iteration"))
    chart.SetYAxisTitle(_("Similarity"))
    chart.SetLegendVisibility(False)


def _fill_views(loaded: LoadedResult, nodes: OutputNodes, name: str) -> Iterator[None]:
    """The camera, the rendering and the X-ray of each view."""
    result = loaded.result
    corners = result.warped_ct.corners()
    for number, found in enumerate(result.cameras):
        camera = found.camera
        view = found.name or _("view {number}").format(number=number + 1)
        transform = _nth(
            nodes, nodes.cameras, number, "vtkMRMLLinearTransformNode", "{name} camera " + view, name
        )
        set_camera(transform, camera, found.similarity)
        xray = loaded.xrays[number] if number < len(loaded.xrays) else None
        depth = float(camera.depth(corners).max()) * DETECTOR_MARGIN
        if xray is not None and xray.source_to_detector_mm:
            depth = float(xray.source_to_detector_mm)
        plane = plane_to_ras(camera, depth)
        rendering = _nth(
            nodes, nodes.renderings, number, "vtkMRMLScalarVolumeNode", "{name} rendering " + view, name
        )
        set_volume(rendering, np.asarray(result.renderings_after[number], np.float32)[None], plane)
        yield
        if xray is not None:
            image = _nth(nodes, nodes.xrays, number, "vtkMRMLScalarVolumeNode", "{name} X-ray " + view, name)
            set_volume(image, np.asarray(xray.image, np.float32)[None], plane)
            yield


def _nth(nodes: OutputNodes, given: list, number: int, kind: str, pattern: str, name: str) -> Any:
    """Number n of a list of nodes; made, and added to the list, when it is not there."""
    node = _node(nodes, given[number] if number < len(given) else None, kind, pattern, name)
    given[number : number + 1] = [node]
    return node
