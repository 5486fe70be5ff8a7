"""Nodes that are carried along with a result: which can be, and how they are put under its transform and back."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import slicer
import vtk
from slicer.i18n import tr as _

from .deformation import MAP_ATTRIBUTE
from .names import free_name
from .own_nodes import remove_with_display

POINT_KINDS = (
    "vtkMRMLMarkupsFiducialNode",
    "vtkMRMLMarkupsLineNode",
    "vtkMRMLMarkupsAngleNode",
    "vtkMRMLMarkupsCurveNode",
)
"""Markups that their control points define; planes and boxes have shapes of their own."""

_OTHER_KINDS = ("vtkMRMLModelNode", "vtkMRMLSegmentationNode", "vtkMRMLVolumeNode")
_MOVED = "PolyPose.Carried"
"""Attribute of a node that is under a result's transform; like the references, it outlives a scene's file."""

_BETWEEN = "PolyPose.CarriedBetween"
"""Attribute of the hidden transforms that are made here."""

_PARENT, _UNDER = "PolyPoseCarriedFrom", "PolyPoseCarriedBy"
"""References to the transform that a node had, and to that under which it is now."""


def is_points(node: Any) -> bool:
    """Whether a node is carried point by point."""
    return any(node.IsA(kind) for kind in POINT_KINDS)


def carriable_nodes(others: Collection[Any]) -> list[Any]:
    """The nodes of the scene that can be carried along, in the scene's order; others: those that are not offered."""
    left_out = {node.GetID() for node in others if node is not None}
    found: dict[str, Any] = {}
    for kind in (*POINT_KINDS, *_OTHER_KINDS):
        for node in slicer.util.getNodesByClass(kind):
            if node.GetID() not in left_out and _is_offered(node):
                found[node.GetID()] = node
    return list(found.values())


def _is_offered(node: Any) -> bool:
    """Whether it is a person's node and not one that is drawn from others."""
    own = node.GetAttribute(MAP_ATTRIBUTE) is not None or not node.GetSaveWithScene()
    slice_model = node.GetAttribute("SliceLogic.IsSliceModelNode") is not None
    return not (own or slice_model or node.GetHideFromEditors())


def moved_nodes() -> list[Any]:
    """All nodes that are under a result's transform now, and were not before."""
    nodes = slicer.util.getNodesByClass("vtkMRMLTransformableNode")
    return [node for node in nodes if node.GetAttribute(_MOVED) is not None]


def put_under(node: Any, transform: slicer.vtkMRMLTransformNode) -> None:
    """Let a node follow a transform from where it is shown, its own transforms included; done once."""
    if node.GetAttribute(_MOVED) is not None:
        under = node.GetNodeReference(_UNDER)
        if under is not None and node.GetParentTransformNode() is under and _leads_to(under, transform):
            return
        put_back(node)
    parent = node.GetParentTransformNode()
    if parent is transform:  # a live preview has put it there, and takes it away
        parent = None
    under = transform if parent is None else _placed_as(parent, transform)
    was = node.StartModify()
    node.SetAttribute(_MOVED, "yes")
    node.SetNodeReferenceID(_PARENT, parent.GetID() if parent is not None else None)
    node.SetNodeReferenceID(_UNDER, under.GetID())
    node.SetAndObserveTransformNodeID(under.GetID())
    node.EndModify(was)


def put_back(node: Any) -> None:
    """Put a node back where it was, unless somebody has put it elsewhere meanwhile."""
    if node.GetAttribute(_MOVED) is None:
        return
    parent, under = node.GetNodeReference(_PARENT), node.GetNodeReference(_UNDER)
    was = node.StartModify()
    node.RemoveAttribute(_MOVED)
    for role in (_PARENT, _UNDER):
        node.RemoveNodeReferenceIDs(role)
    if node.GetParentTransformNode() in (None, under):
        node.SetAndObserveTransformNodeID(parent.GetID() if parent is not None else None)
    node.EndModify(was)
    if under is not None and under.GetAttribute(_BETWEEN) is not None:
        remove_with_display(under)


def _leads_to(under: Any, transform: Any) -> bool:
    return under is transform or under.GetParentTransformNode() is transform


def _placed_as(parent: Any, transform: Any) -> Any:
    """A hidden transform that does what a node's own ones do, under the result's: theirs may hold other nodes."""
    between = slicer.mrmlScene.CreateNodeByClass("vtkMRMLTransformNode")
    between.UnRegister(None)
    between.SetName(free_name(_("{name} carried along").format(name=parent.GetName())))
    between.SetHideFromEditors(True)
    between.SetAttribute(_BETWEEN, "yes")
    between = slicer.mrmlScene.AddNode(between)
    if parent.IsTransformToWorldLinear():
        matrix = vtk.vtkMatrix4x4()
        parent.GetMatrixTransformToWorld(matrix)
        between.SetMatrixTransformToParent(matrix)
    else:
        to_world = vtk.vtkGeneralTransform()
        parent.GetTransformToWorld(to_world)
        between.SetAndObserveTransformToParent(to_world)
    between.SetAndObserveTransformNodeID(transform.GetID())
    return between
