"""The outline of a surface on each X-ray, as its camera sees it."""

from __future__ import annotations

import numpy as np
import slicer
import vtk
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from .frames import flip_vectors
from .own_nodes import remove_with_display
from .xray_views import XrayPicture, slice_logic

_LEAST_DEPTH = 0.05
"""Points nearer to the source than this share of the detector's distance have no outline."""


def silhouette(surface: vtk.vtkPolyData, picture: XrayPicture) -> vtk.vtkPolyData:
    """Lines on the X-ray's detector, RAS mm, where rays from its source graze a closed surface in RAS."""
    source = flip_vectors(picture.camera.source)
    edges = vtk.vtkPolyDataSilhouette()
    edges.SetInputData(surface)
    edges.SetDirectionToSpecifiedOrigin()
    edges.SetOrigin(*source)
    edges.SetEnableFeatureAngle(False)
    edges.SetBorderEdges(False)
    used = vtk.vtkCleanPolyData()  # the filter before it keeps all points of the surface
    used.SetInputConnection(edges.GetOutputPort())
    used.PointMergingOff()
    used.Update()
    lines = used.GetOutput()
    if lines.GetNumberOfPoints() == 0:
        return lines
    points = vtk_to_numpy(lines.GetPoints().GetData()).astype(np.float64)
    depth = picture.camera.depth(flip_vectors(points))
    share = picture.detector_mm / np.maximum(depth, _LEAST_DEPTH * picture.detector_mm)
    projected = source + share[:, None] * (points - source)
    moved = vtk.vtkPoints()
    moved.SetData(numpy_to_vtk(np.ascontiguousarray(projected, np.float32), deep=True))
    lines.SetPoints(moved)
    return lines


class Outline:
    """One bone's outline in the slice view of one X-ray, and nowhere else."""

    def __init__(self, number: int, name: str, color: tuple[float, float, float]) -> None:
        """number: of the X-ray. name: of the model node. color: red, green, blue from 0 to 1."""
        self._number = number
        self.node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", name)
        self.node.SetSaveWithScene(False)
        self.node.SetHideFromEditors(True)
        self.node.CreateDefaultDisplayNodes()
        display = self.node.GetDisplayNode()
        display.SetSaveWithScene(False)
        display.SetColor(*color)
        display.SetVisibility2D(True)
        display.SetSliceDisplayModeToProjection()
        display.SetSliceIntersectionThickness(3)

    def draw(self, surface: vtk.vtkPolyData, picture: XrayPicture) -> None:
        """Show the outline of a surface in RAS on the X-ray; nothing while the layout has no view of it."""
        logic = slice_logic(self._number)
        display = self.node.GetDisplayNode()
        if logic is None or display is None:
            return
        view = logic.GetSliceNode().GetID()
        if not (display.GetNumberOfViewNodeIDs() == 1 and display.IsViewNodeIDPresent(view)):
            display.SetViewNodeIDs([view])
        self.node.SetAndObservePolyData(silhouette(surface, picture))

    def remove(self) -> None:
        """Take it out of the scene."""
        remove_with_display(self.node)
