"""How far carried points may be off: their 95 % ellipsoids as one model."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

from PolyPoseLib.data.carried import CHI2_95

from .frames import FLIP, flip_vectors
from .own_nodes import remove_with_display, unsaved_node

_AROUND, _ALONG = 24, 16
_COLOR, _OPACITY = (0.15, 0.65, 0.95), 0.35


def ellipsoid_surface(points: np.ndarray, covariances: np.ndarray) -> vtk.vtkPolyData:
    """The 95 % ellipsoids of points (N, 3) LPS mm with covariances (N, 3, 3) mm^2 as a surface in RAS mm.

    Points without a known covariance (NaN) have none.
    """
    known = np.isfinite(covariances).all(axis=(1, 2))
    centres = flip_vectors(points[known])
    variances, axes = np.linalg.eigh(FLIP[:3, :3] @ covariances[known] @ FLIP[:3, :3])
    half = np.sqrt(CHI2_95 * variances.clip(min=0))
    ball, triangles = _unit_ball()
    vertices = centres[:, None, :] + np.einsum("va,na,nda->nvd", ball, half, axes)
    first = len(ball) * np.arange(len(centres))[:, None, None]
    corners = (triangles + first).reshape(-1)
    surface, places, faces = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(vertices.reshape(-1, 3)), deep=True))
    ends = np.arange(0, len(corners) + 1, 3, dtype=np.int64)
    faces.SetData(numpy_to_vtkIdTypeArray(ends, deep=True), numpy_to_vtkIdTypeArray(corners, deep=True))
    surface.SetPoints(places)
    surface.SetPolys(faces)
    return surface


def _unit_ball() -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) on the unit sphere, and triangles (T, 3)."""
    source = vtk.vtkSphereSource()
    source.SetRadius(1.0)
    source.SetThetaResolution(_AROUND)
    source.SetPhiResolution(_ALONG)
    source.Update()
    ball = vtk_to_numpy(source.GetOutput().GetPoints().GetData()).astype(np.float64)
    corners = vtk_to_numpy(source.GetOutput().GetPolys().GetConnectivityArray()).astype(np.int64)
    return ball / np.linalg.norm(ball, axis=1, keepdims=True), corners.reshape(-1, 3)


class EllipsoidModel:
    """One model for all carried points, in the posture of the X-rays; scenes do not keep it."""

    def __init__(self) -> None:
        """No model yet."""
        self.node: Any = None

    def show(self, points: np.ndarray, covariances: np.ndarray, visible: bool) -> None:
        """Draw the ellipsoids of points (N, 3) LPS mm with covariances (N, 3, 3) mm^2."""
        if self.node is None or self.node.GetScene() is None:
            self.node = _model()
        self.node.SetAndObservePolyData(ellipsoid_surface(points, covariances))
        self.set_visible(visible)

    def set_visible(self, visible: bool) -> None:
        """Show or hide them."""
        if self.node is not None and self.node.GetScene() is not None:
            self.node.GetDisplayNode().SetVisibility(visible)

    def clear(self) -> None:
        """Take them out of the scene."""
        if self.node is not None:
            remove_with_display(self.node)
            self.node = None


def _model() -> Any:
    model = slicer.mrmlScene.AddNode(unsaved_node("vtkMRMLModelNode", _("95 % ellipsoids of carried points")))
    model.CreateDefaultDisplayNodes()
    display = model.GetDisplayNode()
    display.SetSaveWithScene(False)
    display.SetColor(*_COLOR)
    display.SetOpacity(_OPACITY)
    display.SetVisibility2D(True)
    return model
