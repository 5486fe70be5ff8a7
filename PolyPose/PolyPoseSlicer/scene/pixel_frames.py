"""The pixels of X-rays as a frame in the scene: a transform from (column, row, 0) of the file to where it is shown.

Points under such a transform are stored in the file's own pixels, and stay on the X-ray wherever its camera moves.
"""

from __future__ import annotations

import numpy as np
import slicer

from .frames import to_vtk
from .names import free_name

FRAME_ATTRIBUTE = "PolyPose.PixelFrame"
"""Attribute of a frame's transform node: the number of the view that shows its X-ray."""

NO_VIEW = "none"
"""The attribute of a frame whose X-ray no view shows."""


def frame_above(points: slicer.vtkMRMLMarkupsNode | None) -> slicer.vtkMRMLLinearTransformNode | None:
    """The frame that a list of points lies in; None when it lies elsewhere."""
    parent = points.GetParentTransformNode() if points is not None else None
    return parent if parent is not None and parent.GetAttribute(FRAME_ATTRIBUTE) else None


def new_frame(name: str, number: int | None = None) -> slicer.vtkMRMLLinearTransformNode:
    """A frame for the X-ray that view number shows, or that none shows yet; `place` moves it."""
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", free_name(name))
    node.SetAttribute(FRAME_ATTRIBUTE, NO_VIEW if number is None else str(number))
    return node


def all_frames() -> list[slicer.vtkMRMLLinearTransformNode]:
    """Every frame of the scene."""
    nodes = slicer.util.getNodesByClass("vtkMRMLLinearTransformNode")
    return [node for node in nodes if node.GetAttribute(FRAME_ATTRIBUTE)]


def place(number: int, plane: np.ndarray, width: int, mirrored: bool) -> None:
    """Put the frames of a view where its X-ray is shown.

    plane: (4, 4) from (column, row, slice, 1) as seen from the source to RAS mm. mirrored: the file's columns, of
    which there are `width`, run the other way.
    """
    matrix = to_vtk(np.asarray(plane) @ file_to_source(width, mirrored))
    for node in all_frames():
        if node.GetAttribute(FRAME_ATTRIBUTE) == str(number):
            node.SetMatrixTransformToParent(matrix)


def file_to_source(width: int, mirrored: bool) -> np.ndarray:
    """(4, 4) from (column, row, slice, 1) of the file to those of the image as seen from the source, and back."""
    matrix = np.eye(4)
    if mirrored:
        matrix[0, 0], matrix[0, 3] = -1.0, width - 1.0
    return matrix
