"""Surfaces of labelled structures as triangles, and where planes cut them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.grid import bounding_box

MOST_TRIANGLES = 250_000
"""Of all structures together; more are thinned out."""

SMOOTHING_ITERATIONS = 5
"""Steps by which stairs of voxels are smoothed; vertices stay within their voxel."""


@dataclass(frozen=True)
class Surface:
    """Triangles in one frame.

    Attributes
    ----------
    points
        (N, 3) float32 vertices, LPS mm.
    triangles
        (M, 3) int32 indices of vertices.

    """

    points: np.ndarray
    triangles: np.ndarray

    def moved(self, motion: np.ndarray) -> Surface:
        """The same under a rigid motion (4, 4)."""
        return Surface((self.points @ motion[:3, :3].T + motion[:3, 3]).astype(np.float32), self.triangles)

    def cut(self, axis: int, position: float) -> np.ndarray:
        """Segments (S, 2, 3) in which the plane at a position along an axis of (x, y, z) meets the triangles."""
        # A vertex that lies on the plane counts as above it: no triangle is then met in a single point.
        height = self.points[:, axis].astype(np.float64) - position
        above = height >= 0
        corner_above = above[self.triangles]
        crossed = np.flatnonzero(corner_above.any(axis=1) & ~corner_above.all(axis=1))
        if not len(crossed):
            return np.empty((0, 2, 3))
        corners, up = self.triangles[crossed], corner_above[crossed]
        # The corner that is alone on its side, and the two edges that leave it.
        alone = np.where((up.sum(axis=1) == 1)[:, None], up, ~up).argmax(axis=1)
        rows = np.arange(len(crossed))
        tip = corners[rows, alone]
        ends = [corners[rows, (alone + step) % 3] for step in (1, 2)]
        points = self.points.astype(np.float64)
        met = []
        for end in ends:
            share = height[tip] / (height[tip] - height[end])
            met.append(points[tip] + share[:, None] * (points[end] - points[tip]))
        return np.stack(met, axis=1)


EMPTY = Surface(np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))


def surfaces_of(labels: Volume, numbers: list[int]) -> list[Surface]:
    """Closed, smoothed surfaces of some numbers of a label map, in its frame; without triangles where it has no voxel."""
    raw = [_surface(labels, number) for number in numbers]
    total = sum(len(each.triangles) for each in raw)
    if total <= MOST_TRIANGLES:
        return raw
    return [_thinned(each, MOST_TRIANGLES / total) for each in raw]


def _surface(labels: Volume, number: int) -> Surface:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkSurfaceNets3D

    mask = labels.voxels == number
    box = bounding_box(mask)
    if box is None:
        return EMPTY
    padded = np.pad(mask[box], 1).astype(np.uint8)
    image = vtkImageData()
    image.SetDimensions(*padded.shape[::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(padded.ravel(), deep=True))
    nets = vtkSurfaceNets3D()
    nets.SetInputData(image)
    nets.SetValue(0, 1)
    nets.SetNumberOfIterations(SMOOTHING_ITERATIONS)
    nets.SetOutputMeshTypeToTriangles()
    nets.Update()
    surface = _from_vtk(nets.GetOutput())
    first = np.array([part.start for part in reversed(box)]) - 1
    points = labels.to_world(surface.points + first).astype(np.float32)
    triangles = surface.triangles
    if np.linalg.det(labels.affine[:3, :3]) < 0:  # a mirrored grid turns triangles inside out
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    return Surface(points, triangles)


def _thinned(surface: Surface, share: float) -> Surface:
    """With about a share of the triangles."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

    if not len(surface.triangles):
        return surface
    points, cells = vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(surface.points, deep=True))
    offsets = np.arange(0, 3 * len(surface.triangles) + 1, 3, dtype=np.int64)
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True),
        numpy_to_vtkIdTypeArray(surface.triangles.ravel().astype(np.int64), deep=True),
    )
    mesh = vtkPolyData()
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    decimation = vtkQuadricDecimation()
    decimation.SetInputData(mesh)
    decimation.SetTargetReduction(1 - share)
    decimation.Update()
    return _from_vtk(decimation.GetOutput())


def _from_vtk(mesh: object) -> Surface:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if mesh.GetNumberOfPolys() == 0:  # type: ignore[attr-defined]
        return EMPTY
    points = vtk_to_numpy(mesh.GetPoints().GetData())  # type: ignore[attr-defined]
    cells = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray())  # type: ignore[attr-defined]
    return Surface(points.astype(np.float32), cells.reshape(-1, 3).astype(np.int32))
