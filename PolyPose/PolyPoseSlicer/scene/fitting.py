"""Fits slices and 3D views to what they show: Slicer does neither when a script sets a background or a layout."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import slicer

from . import layouts
from .xray_views import carm_nodes

_MARGIN = 1.05
_SURROUNDINGS = 1.6
"""How much more than a node is seen around it."""


def show_volume(
    volume: slicer.vtkMRMLScalarVolumeNode, *others: slicer.vtkMRMLDisplayableNode | None
) -> None:
    """Show a volume in all slices, and it and other nodes in 3D, whole."""
    layouts.set_background(volume)
    fit_slices()
    fit_3d(volume, *others)


def fit_slices() -> None:
    """Show the whole background volume, its middle slices, in every slice view of the anatomy."""
    for logic in _slice_logics():
        if logic.GetSliceCompositeNode().GetBackgroundVolumeID():
            logic.FitSliceToBackground()


def fit_3d(*nodes: slicer.vtkMRMLDisplayableNode | None) -> None:
    """Let the layout's 3D view show nodes and the C-arms whole, from the side that it is seen from."""
    box = _box([*(each for each in nodes if each is not None), *carm_nodes()])
    if box is not None:
        _look_at(box.mean(axis=0), float(np.linalg.norm(box[1] - box[0])) / 2)


def look_at(node: slicer.vtkMRMLDisplayableNode) -> None:
    """Put the slices of the anatomy through the middle of a node, and the layout's 3D view near it."""
    box = _box([node])
    if box is None:
        return
    centre = box.mean(axis=0)
    for logic in _slice_logics():
        logic.GetSliceNode().JumpSliceByOffsetting(*centre)
    _look_at(centre, _SURROUNDINGS * float(np.linalg.norm(box[1] - box[0])) / 2)


def _look_at(centre: np.ndarray, radius: float) -> None:
    """Let the layout's 3D view show a ball, RAS mm, from the side that it is seen from."""
    for node in slicer.util.getNodesByClass("vtkMRMLCameraNode"):
        if node.GetLayoutName() != layouts.THREE_D_VIEW:
            continue
        from_centre = np.subtract(node.GetPosition(), node.GetFocalPoint())
        distance = _MARGIN * radius / np.sin(np.radians(node.GetViewAngle()) / 2)
        was = node.StartModify()
        node.SetFocalPoint(*centre)
        node.SetPosition(*(centre + from_centre / max(np.linalg.norm(from_centre), 1e-6) * distance))
        node.ResetClippingRange()
        node.EndModify(was)


def view_sizes() -> list[tuple[int, int]]:
    """Pixels across and down of the slice views of the anatomy."""
    return [tuple(logic.GetSliceNode().GetDimensions()[:2]) for logic in _slice_logics()]


def _slice_logics() -> list[slicer.vtkMRMLSliceLogic]:
    """Of the slice views of the anatomy that there are."""
    application = slicer.app.applicationLogic()
    names = [composite.GetLayoutName() for composite in layouts.anatomy_views()]
    logics = [application.GetSliceLogicByLayoutName(name) for name in names]
    return [logic for logic in logics if logic is not None]


def _box(nodes: Iterable[slicer.vtkMRMLDisplayableNode]) -> np.ndarray | None:
    """Least and largest corner, RAS mm, of a box around nodes; None without any that has a size."""
    corners = []
    for node in nodes:
        bounds = [0.0] * 6
        node.GetRASBounds(bounds)
        if bounds[0] < bounds[1]:
            corners.append(np.array(bounds).reshape(3, 2).T)
    return np.array([np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]]) if corners else None
