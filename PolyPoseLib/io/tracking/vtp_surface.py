"""A bone's surface in one frame as VTP, with how far each of its vertices may be off."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.stats import chi2

from PolyPoseLib.errors import InputError

UNCERTAINTY = "uncertainty_mm"
"""Array of the vertices: the longest half axis of the 95 % ellipsoid."""


def uncertainty_mm(points: np.ndarray, covariance: np.ndarray, centroid: np.ndarray) -> np.ndarray:
    """How far points (N, 3) of a bone may be off: the longest half axes (N,) of their 95 % ellipsoids, mm.

    covariance: (6, 6) of the bone's pose, of [rotation (rad), translation (mm)] about the centroid (3,); points and
    centroid are in the CT, LPS mm.
    """
    arms = np.asarray(points, np.float64) - centroid
    turns = np.cross(np.eye(3), arms[:, None]).transpose(0, 2, 1)
    jacobian = np.concatenate([turns, np.broadcast_to(np.eye(3), turns.shape)], axis=2)
    spread = jacobian @ covariance @ jacobian.transpose(0, 2, 1)
    largest = np.linalg.eigvalsh(spread)[:, -1]
    return np.sqrt(chi2.ppf(0.95, 3) * np.maximum(largest, 0)).astype(np.float32)


def write_vtp(path: Path, points: np.ndarray, triangles: np.ndarray, uncertainty: np.ndarray) -> None:
    """Write a surface: vertices (N, 3) in LPS mm, triangles (M, 3) of indices, uncertainty (N,) mm of the vertices.

    Raises InputError where it cannot be written.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    places, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float32), deep=True))
    offsets = np.arange(0, 3 * len(triangles) + 1, 3, dtype=np.int64)
    corners = np.ascontiguousarray(triangles, np.int64).ravel()
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(corners, deep=True))
    mesh.SetPoints(places)
    mesh.SetPolys(cells)
    values = numpy_to_vtk(np.ascontiguousarray(uncertainty, np.float32), deep=True)
    values.SetName(UNCERTAINTY)
    mesh.GetPointData().AddArray(values)
    space = vtkStringArray()
    space.SetName("SPACE")
    space.InsertNextValue("LPS")
    mesh.GetFieldData().AddArray(space)
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(mesh)
    if not writer.Write():
        raise InputError(f"{path.name}: VTK cannot write this surface: check the space on the disk.")
