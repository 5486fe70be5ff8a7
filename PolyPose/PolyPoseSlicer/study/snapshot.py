"""A result as it is in the scene, kept so that another can be undone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import slicer
import vtk

from ..scene.cameras import CAMERA_ATTRIBUTE
from ..scene.frames import from_vtk, to_vtk
from ..scene.motions import MOTIONS_ATTRIBUTE
from ..scene.own_nodes import remove_with_display
from .parameters import PolyPoseParameterNode
from .results import set_plot

_NODES = ("outputTransform", "outputVolume", "outputSegmentation", "outputMotions", "outputSimilarity")
_LISTS = ("outputCameras", "outputRenderings", "outputXrays")
_CURVE = ("outputSeries", "outputPlot")
_ATTRIBUTES = (CAMERA_ATTRIBUTE, MOTIONS_ATTRIBUTE)


@dataclass(frozen=True)
class Snapshot:
    """What a parameter node's result holds: contents of its output nodes by its own fields, and its messages.

    Registrations give nodes new images, grids and segments and leave the old ones as they were, so that these are
    referred to and not copied.
    """

    nodes: dict[str, _Content | None]
    lists: dict[str, list[_Content]]
    messages: str

    @classmethod
    def of(cls, parameters: PolyPoseParameterNode) -> Snapshot:
        """The result as it is now; an absent one, too."""
        return cls(
            {name: _Content.of(getattr(parameters, name)) for name in (*_NODES, *_CURVE)},
            {
                name: [content for node in getattr(parameters, name) if (content := _Content.of(node))]
                for name in _LISTS
            },
            parameters.outputMessages,
        )

    @property
    def empty(self) -> bool:
        """Whether it holds no result."""
        return self.nodes["outputTransform"] is None

    def restore_curve(self, parameters: PolyPoseParameterNode) -> None:
        """Give the similarity's table, which a running registration fills, what it held."""
        content, table = self.nodes["outputSimilarity"], parameters.outputSimilarity
        if content is not None and table is not None:
            content.put(table)

    def restore(self, parameters: PolyPoseParameterNode) -> None:
        """Give the output nodes what they held; nodes that it does not know are removed, absent ones made again."""
        was = parameters.StartModify()
        for name, content in self.nodes.items():
            setattr(parameters, name, _restored(getattr(parameters, name), content))
        for name, contents in self.lists.items():
            present = [node for node in getattr(parameters, name) if node is not None]
            for node in present[len(contents) :]:
                remove_with_display(node)
            nodes = [*present, *[None] * len(contents)][: len(contents)]
            pairs = zip(nodes, contents, strict=True)
            setattr(parameters, name, [_restored(node, content) for node, content in pairs])
        parameters.outputMessages = self.messages
        if parameters.outputSegmentation is not None:
            parameters.outputSegmentation.SetReferenceImageGeometryParameterFromVolumeNode(
                parameters.outputVolume
            )
        chart, series, table = parameters.outputPlot, parameters.outputSeries, parameters.outputSimilarity
        if chart is not None and series is not None and table is not None:
            set_plot(chart, series, table)
        parameters.EndModify(was)


@dataclass(frozen=True)
class _Content:
    """One node's class, name and what a registration writes into it."""

    kind: str
    name: str
    attributes: dict[str, str | None]
    held: Any

    @classmethod
    def of(cls, node: Any) -> _Content | None:
        """None for an absent node."""
        if node is None or node.GetScene() is None:
            return None
        attributes = {name: node.GetAttribute(name) for name in _ATTRIBUTES}
        return cls(node.GetClassName(), node.GetName(), attributes, _held(node))

    def put(self, node: Any) -> None:
        """Write it into a node of its class."""
        was = node.StartModify()
        for name, value in self.attributes.items():
            node.SetAttribute(name, value)
        _PUT.get(self.kind, _put_nothing)(node, self.held)
        node.EndModify(was)


def _held(node: Any) -> Any:
    """What a node holds, apart from how it is shown."""
    if node.IsA("vtkMRMLVolumeNode"):
        matrix = vtk.vtkMatrix4x4()
        node.GetIJKToRASMatrix(matrix)
        return node.GetImageData(), from_vtk(matrix)
    if node.IsA("vtkMRMLLinearTransformNode"):
        matrix = vtk.vtkMatrix4x4()
        node.GetMatrixTransformToParent(matrix)
        return from_vtk(matrix)
    if node.IsA("vtkMRMLTransformNode"):
        return node.GetTransformFromParent()
    if node.IsA("vtkMRMLSegmentationNode"):
        content = node.GetSegmentation()
        source = content.GetSourceRepresentationName()
        return source, [(each, content.GetSegment(each)) for each in content.GetSegmentIDs()]
    if node.IsA("vtkMRMLTableNode"):
        table = vtk.vtkTable()
        table.DeepCopy(node.GetTable())
        return table
    return None


def _put_volume(node: Any, held: Any) -> None:
    image, to_ras = held
    node.SetAndObserveTransformNodeID(None)
    node.SetIJKToRASMatrix(to_vtk(to_ras))
    node.SetAndObserveImageData(image)


def _put_segmentation(node: Any, held: Any) -> None:
    source, segments = held
    content = node.GetSegmentation()
    content.RemoveAllSegments()
    content.SetSourceRepresentationName(source)
    for identifier, segment in segments:
        content.AddSegment(segment, identifier)


def _put_table(node: Any, held: Any) -> None:
    table = vtk.vtkTable()
    table.DeepCopy(held)
    node.SetAndObserveTable(table)


def _put_nothing(_node: Any, _held: Any) -> None:
    """For plots, which refer to a table."""


_PUT = {
    "vtkMRMLScalarVolumeNode": _put_volume,
    "vtkMRMLLinearTransformNode": lambda node, held: node.SetMatrixTransformToParent(to_vtk(held)),
    "vtkMRMLGridTransformNode": lambda node, held: node.SetAndObserveTransformFromParent(held),
    "vtkMRMLTransformNode": lambda node, held: node.SetAndObserveTransformFromParent(held),
    "vtkMRMLSegmentationNode": _put_segmentation,
    "vtkMRMLTableNode": _put_table,
}


def _restored(node: Any, content: _Content | None) -> Any:
    """The node with a content, made where it is absent; removed, and None, where there was none."""
    if node is not None and node.GetScene() is None:
        node = None
    if content is None:
        if node is not None:
            remove_with_display(node)
        return None
    if node is not None:
        content.put(node)
        return node
    made: Any = slicer.mrmlScene.AddNewNodeByClass(content.kind, content.name)
    content.put(made)
    if made.IsA("vtkMRMLDisplayableNode") and not made.IsA("vtkMRMLTransformNode"):
        made.CreateDefaultDisplayNodes()
    return made
