"""Markups in the posture of the X-rays: copies that are drawn in the place of the markups, which stay as they are."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _

from .frames import flip_vectors
from .own_nodes import remove_with_display, unsaved_node

_HIDDEN = "PolyPose.HiddenForCarried"
"""Attribute of markups that are hidden while their copies are shown; it outlives a scene's file."""


def defined_points(node: Any) -> np.ndarray:
    """The control points of markups that have been placed, in the world, (N, 3) LPS mm."""
    points = [
        node.GetNthControlPointPositionWorld(number)
        for number in range(node.GetNumberOfControlPoints())
        if _is_defined(node, number)
    ]
    return flip_vectors(np.array([[each[0], each[1], each[2]] for each in points], float).reshape(-1, 3))


def through_transform(transform: slicer.vtkMRMLTransformNode, points: np.ndarray) -> np.ndarray:
    """Points (N, 3), LPS mm, as a transform shows them."""
    to_world = vtk.vtkGeneralTransform()
    transform.GetTransformToWorld(to_world)
    moved = [to_world.TransformPoint(each) for each in flip_vectors(points).tolist()]
    return flip_vectors(np.array(moved, float).reshape(-1, 3))


class CarriedMarkups:
    """Copies of markups where a result has them; scenes do not keep them."""

    def __init__(self) -> None:
        """No copy yet."""
        self._copies: dict[str, Any] = {}

    def copy_of(self, source: Any) -> Any:
        """The copy that is shown for markups, or None."""
        return self._copies.get(source.GetID())

    def keep(self, sources: Collection[Any]) -> None:
        """Take away the copies of all other markups, and show these again."""
        wanted = {each.GetID() for each in sources}
        for identifier in [each for each in self._copies if each not in wanted]:
            remove_with_display(self._copies.pop(identifier))
        for node in slicer.util.getNodesByClass("vtkMRMLMarkupsNode"):
            if node.GetID() not in wanted and node.GetAttribute(_HIDDEN) is not None:
                node.RemoveAttribute(_HIDDEN)
                if node.GetDisplayNode() is not None:
                    node.GetDisplayNode().SetVisibility(True)

    def place(self, source: Any, points: np.ndarray, moved_by: Sequence[str]) -> None:
        """Show markups with their control points elsewhere.

        points: (N, 3) LPS mm of those that are defined; moved_by: what moved each, for the points' descriptions.
        """
        copy = self._copies.get(source.GetID())
        if copy is None or copy.GetScene() is None:
            copy = self._copies[source.GetID()] = _copied(source)
        numbers = [n for n in range(source.GetNumberOfControlPoints()) if _is_defined(source, n)]
        was = copy.StartModify()
        copy.RemoveAllControlPoints()
        for number, point, mover in zip(numbers, flip_vectors(points).tolist(), moved_by, strict=True):
            index = copy.AddControlPoint(vtk.vtkVector3d(point), source.GetNthControlPointLabel(number))
            copy.SetNthControlPointDescription(index, mover)
        copy.SetLocked(True)
        copy.EndModify(was)
        if source.GetDisplayNode() is not None and source.GetDisplayNode().GetVisibility():
            source.SetAttribute(_HIDDEN, "yes")
            source.GetDisplayNode().SetVisibility(False)


def _is_defined(node: Any, number: int) -> bool:
    return node.GetNthControlPointPositionStatus(number) == slicer.vtkMRMLMarkupsNode.PositionDefined


def _copied(source: Any) -> Any:
    """A copy without points that looks like the markups."""
    copy = unsaved_node(source.GetClassName(), _("{name} as X-rayed").format(name=source.GetName()))
    copy = slicer.mrmlScene.AddNode(copy)
    copy.CreateDefaultDisplayNodes()
    display = copy.GetDisplayNode()
    if display is not None:
        if source.GetDisplayNode() is not None:
            display.CopyContent(source.GetDisplayNode())
        display.SetSaveWithScene(False)
    return copy
