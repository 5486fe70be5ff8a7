"""Surfaces of labelled structures as triangles, and where planes cut them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.grid import Grid, bounding_box

MOST_TRIANGLES = 300_000
"""Of all structures together."""

FINEST_MM = (1.2, 1.8, 2.7, 4.0)
"""Voxels are put together to about this size; the larger ones where there are too many triangles."""

HALF_FULL = 0.45
"""Larger voxels count as inside from this share on: thin plates of bone stay whole."""

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

    def cut(self, axis: int, position: float) -> list[np.ndarray]:
        """Lines (S, 3) in which the plane at a position along an axis of (x, y, z) meets the surface.

        Closed lines end where they begin; a surface that is not closed has others.
        """
        # A vertex that lies on the plane counts as above it: no triangle is then met in a single point.
        height = self.points[:, axis].astype(np.float64) - position
        above = height >= 0
        corner_above = above[self.triangles]
        crossed = np.flatnonzero(corner_above.any(axis=1) & ~corner_above.all(axis=1))
        if not len(crossed):
            return []
        corners, up = self.triangles[crossed].astype(np.int64), corner_above[crossed]
        # The corner that is alone on its side, and the two edges that leave it: each is named by its two corners.
        alone = np.where((up.sum(axis=1) == 1)[:, None], up, ~up).argmax(axis=1)
        rows = np.arange(len(crossed))
        tip = corners[rows, alone]
        ends = np.stack([corners[rows, (alone + step) % 3] for step in (1, 2)], axis=1)
        edges = np.minimum(tip[:, None], ends) * len(self.points) + np.maximum(tip[:, None], ends)
        names, numbers = np.unique(edges, return_inverse=True)
        low, high = np.divmod(names, len(self.points))
        share = height[low] / (height[low] - height[high])
        points = self.points.astype(np.float64)
        places = points[low] + share[:, None] * (points[high] - points[low])
        return [places[line] for line in _chained(numbers.reshape(-1, 2))]


def _chained(segments: np.ndarray) -> list[list[int]]:
    """Lines of places from segments (S, 2) between them."""
    at: dict[int, list[int]] = {}
    ends = segments.tolist()
    for number, pair in enumerate(ends):
        for place in pair:
            at.setdefault(place, []).append(number)
    left, lines = set(range(len(ends))), []
    for first in range(len(ends)):
        if first not in left:
            continue
        left.discard(first)
        line = list(ends[first])
        for _ in range(2):  # on from its end, and then from its other one
            while (following := next((each for each in at[line[-1]] if each in left), None)) is not None:
                left.discard(following)
                one, other = ends[following]
                line.append(other if one == line[-1] else one)
            line.reverse()
        lines.append(line)
    return lines


EMPTY = Surface(np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))


def surfaces_of(labels: Volume, numbers: list[int]) -> list[Surface]:
    """Closed, smoothed surfaces of some numbers of a label map, in its frame; without triangles where it has no voxel.

    Voxels are put together first, to as large ones as it takes for the triangles to be few enough.
    """
    surfaces: list[Surface] = []
    for finest_mm in FINEST_MM:
        surfaces = [_surface(labels, number, finest_mm) for number in numbers]
        if sum(len(each.triangles) for each in surfaces) <= MOST_TRIANGLES:
            break
    return surfaces


def _surface(labels: Volume, number: int, finest_mm: float) -> Surface:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkSurfaceNets3D

    mask = labels.voxels == number
    box = bounding_box(mask)
    if box is None:
        return EMPTY
    affine = labels.affine.copy()
    affine[:3, 3] += affine[:3, :3] @ [part.start for part in reversed(box)]
    grid = Grid(mask[box].astype(np.float32), affine).coarsened(finest_mm).padded()
    inside = (grid.voxels >= min(HALF_FULL, grid.voxels.max())).astype(np.uint8)
    image = vtkImageData()
    image.SetDimensions(*inside.shape[::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(inside.ravel(), deep=True))
    nets = vtkSurfaceNets3D()
    nets.SetInputData(image)
    nets.SetValue(0, 1)
    nets.SetNumberOfIterations(SMOOTHING_ITERATIONS)
    nets.SetOutputMeshTypeToTriangles()
    nets.Update()
    surface = _from_vtk(nets.GetOutput())
    points = surface.points.astype(np.float64) @ grid.affine[:3, :3].T + grid.affine[:3, 3]
    triangles = surface.triangles
    if np.linalg.det(grid.affine[:3, :3]) < 0:  # a mirrored grid turns triangles inside out
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    return Surface(points.astype(np.float32), triangles)


def _from_vtk(mesh: object) -> Surface:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if mesh.GetNumberOfPolys() == 0:  # type: ignore[attr-defined]
        return EMPTY
    points = vtk_to_numpy(mesh.GetPoints().GetData())  # type: ignore[attr-defined]
    cells = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray())  # type: ignore[attr-defined]
    return Surface(points.astype(np.float32), cells.reshape(-1, 3).astype(np.int32))
