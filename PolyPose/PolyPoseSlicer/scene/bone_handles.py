"""A bone that a person moves: its surface under a transform with Slicer's handles, and its outline on the X-rays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _

from . import layouts
from .drawing import drawn_once
from .frames import flip_map, from_vtk, to_vtk
from .names import free_name
from .own_nodes import remove_with_display
from .silhouettes import Outline
from .xray_views import XrayPicture

MOST_TRIANGLES = 30_000
"""Larger surfaces are coarsened, so that outlines follow the handles."""


def surface_of(
    segmentation: slicer.vtkMRMLSegmentationNode, segments: Sequence[str], most: int = MOST_TRIANGLES
) -> vtk.vtkPolyData:
    """The closed surface of segments where they are shown, RAS mm, coarsened; empty when they have no voxel.

    most: triangles, about.
    """
    whole = vtk.vtkAppendPolyData()
    for segment in segments:
        surface = vtk.vtkPolyData()
        slicer.vtkSlicerSegmentationsModuleLogic.GetSegmentClosedSurfaceRepresentation(
            segmentation, segment, surface, True
        )
        whole.AddInputData(surface)
    whole.Update()
    return coarsened(whole.GetOutput(), most)


def coarsened(surface: vtk.vtkPolyData, most: int = MOST_TRIANGLES) -> vtk.vtkPolyData:
    """The surface with about so many triangles, where it has more."""
    if surface.GetNumberOfCells() <= most:
        return surface
    fewer = vtk.vtkQuadricClustering()
    fewer.SetInputData(surface)
    box = np.array(surface.GetBounds()).reshape(3, 2)
    sides = box[:, 1] - box[:, 0]
    cell = np.sqrt(2 * (sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0]) / most)
    fewer.AutoAdjustNumberOfDivisionsOff()
    fewer.SetNumberOfDivisions(*(int(max(side / cell, 8)) for side in sides))
    fewer.Update()
    return fewer.GetOutput()


class BoneHandles:
    """One bone's handles; `remove` takes all of it out of the scene.

    Parameters
    ----------
    name : str
        Of the bone.
    surface : vtkPolyData
        In the X-rays' posture, RAS mm.
    color : tuple of float
        Red, green, blue from 0 to 1.

    """

    def __init__(self, name: str, surface: vtk.vtkPolyData, color: tuple[float, float, float]) -> None:
        self._name, self._surface, self._color = name, surface, color
        self._outlines: list[Outline] = []
        scene = slicer.mrmlScene
        self.transform = scene.AddNewNodeByClass(
            "vtkMRMLLinearTransformNode", free_name(_("Adjustment of {name}").format(name=name))
        )
        self.transform.SetSaveWithScene(False)
        box = np.array(surface.GetBounds()).reshape(3, 2)
        self.transform.SetCenterOfTransformation(*box.mean(axis=1))
        self.model = scene.AddNewNodeByClass(
            "vtkMRMLModelNode", free_name(_("{name}, adjusted").format(name=name))
        )
        self.model.SetSaveWithScene(False)
        self.model.SetAndObservePolyData(surface)
        self.model.CreateDefaultDisplayNodes()
        display = self.model.GetDisplayNode()
        display.SetSaveWithScene(False)
        display.SetColor(*color)
        display.SetVisibility2D(True)
        display.SetSliceIntersectionThickness(3)
        display.SetViewNodeIDs(layouts.patient_views())
        self.model.SetAndObserveTransformNodeID(self.transform.GetID())
        self._observer = self.transform.AddObserver(
            slicer.vtkMRMLTransformableNode.TransformModifiedEvent, self._moved
        )
        self._pictures: Sequence[XrayPicture] = ()

    @drawn_once
    def show(self, pictures: Sequence[XrayPicture], handles: bool) -> None:
        """Draw the outlines on these X-rays, with handles in the slices and in 3D or without."""
        self._pictures = pictures
        for outline in self._outlines[len(pictures) :]:
            outline.remove()
        del self._outlines[len(pictures) :]
        for number in range(len(self._outlines), len(pictures)):
            name = free_name(_("Outline of {name}").format(name=self._name))
            self._outlines.append(Outline(number, name, self._color))
        self.model.SetDisplayVisibility(True)
        show_handles(self.transform, handles)
        self.draw()

    def hide(self) -> None:
        """Show nothing of it; how the bone was moved is kept."""
        for outline in self._outlines:
            outline.remove()
        self._outlines.clear()
        self._pictures = ()
        if self.present:
            show_handles(self.transform, False)
            self.model.SetDisplayVisibility(False)

    @drawn_once
    def draw(self) -> None:
        """Draw the outlines where the bone is now."""
        moved = vtk.vtkTransformPolyDataFilter()
        place = vtk.vtkTransform()
        place.SetMatrix(to_vtk(self._matrix()))
        moved.SetTransform(place)
        moved.SetInputData(self._surface)
        moved.Update()
        for outline, picture in zip(self._outlines, self._pictures, strict=True):
            outline.draw(moved.GetOutput(), picture)

    @property
    def motion(self) -> np.ndarray:
        """How the bone was moved in the X-rays' posture, (4, 4) LPS mm."""
        return flip_map(self._matrix())

    @property
    def present(self) -> bool:
        """Whether its nodes are still in the scene: a person may delete them."""
        return self.transform.GetScene() is not None and self.model.GetScene() is not None

    def reset(self) -> None:
        """Put the bone back where the registration has it."""
        self.transform.SetMatrixTransformToParent(vtk.vtkMatrix4x4())

    @drawn_once
    def remove(self) -> None:
        """Take handles, surface and outlines out of the scene."""
        self.hide()
        self.transform.RemoveObserver(self._observer)
        for node in (self.model, self.transform):
            remove_with_display(node)

    def _matrix(self) -> np.ndarray:
        matrix = vtk.vtkMatrix4x4()
        self.transform.GetMatrixTransformToWorld(matrix)
        return from_vtk(matrix)

    def _moved(self, *_ignored: Any) -> None:
        if self.present:
            self.draw()


def show_handles(transform: slicer.vtkMRMLTransformNode, on: bool) -> None:
    """Slicer's own handles of a transform; not over the X-rays, where the bone's place is another."""
    if transform.GetDisplayNode() is None:
        transform.CreateDefaultDisplayNodes()
    display = transform.GetDisplayNode()
    was = display.StartModify()
    display.SetSaveWithScene(False)
    display.SetViewNodeIDs(layouts.patient_views())
    display.SetEditorScalingEnabled(False)
    display.SetEditorScalingSliceEnabled(False)
    display.SetEditorVisibility(on)
    display.SetEditorVisibility3D(on)
    display.SetEditorSliceIntersectionVisibility(on)
    display.EndModify(was)
