"""Outlines of a rigid surface from any side, fast enough to follow a sequence that is scrubbed.

What does not change with the pose (planes of the triangles, and which two share an edge) is worked out once; a frame
costs one product over the triangles and one comparison over the edges.
"""

from __future__ import annotations

import numpy as np
import vtk
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

_LEAST_DEPTH = 0.05
"""Points nearer to the source than this share of the detector's distance are drawn there."""


class RigidSurface:
    """A closed surface, ready for outlines.

    Parameters
    ----------
    surface : vtkPolyData
        Closed, its triangles all turned the same way; in coordinates of its own, mm.

    """

    def __init__(self, surface: vtk.vtkPolyData) -> None:
        triangles = vtk.vtkTriangleFilter()
        triangles.SetInputData(surface)
        triangles.PassVertsOff()
        triangles.PassLinesOff()
        triangles.Update()
        found = triangles.GetOutput()
        if found.GetNumberOfCells() == 0:
            self._centre, self.points = np.zeros(3), np.zeros((0, 3))
            corners = np.zeros((0, 3), np.int64)
        else:
            self.points = vtk_to_numpy(found.GetPoints().GetData()).astype(np.float64)
            self._centre = (self.points.min(axis=0) + self.points.max(axis=0)) / 2
            corners = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(np.int64)
        first, second, third = (self.points[corners[:, each]] - self._centre for each in range(3))
        normals = np.cross(second - first, third - first)
        self._ends, self._sides = _shared_edges(corners, len(self.points))
        normals[_folded(normals, self._sides)] *= -1
        # Products of centred coordinates fit float32, which halves the time of a frame.
        self._offsets = np.einsum("ti,ti->t", normals, first).astype(np.float32)
        self._normals = normals.astype(np.float32)

    @property
    def bounds(self) -> np.ndarray:
        """Corners (8, 3) of its box; none for an empty surface."""
        if not len(self.points):
            return np.zeros((0, 3))
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return np.array(
            [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i, j, k in np.ndindex(2, 2, 2)]
        )

    def edges_towards(self, source: np.ndarray) -> np.ndarray:
        """Edges (N, 2) between triangles that face a point (3,) and triangles that do not, as numbers of points."""
        seen = self._normals @ (source - self._centre).astype(np.float32) > self._offsets
        return self._ends[seen[self._sides[:, 0]] != seen[self._sides[:, 1]]]

    def outline(self, to_world: np.ndarray, source: np.ndarray, plane: Detector) -> vtk.vtkPolyData:
        """Lines on a detector where rays from its source graze the surface, in the world.

        to_world: (4, 4) rigid, where the surface is. source: (3,) in the world.
        """
        inside = np.linalg.inv(to_world)
        edges = self.edges_towards(inside[:3, :3] @ source + inside[:3, 3])
        used, ends = np.unique(edges, return_inverse=True)
        places = self.points[used] @ to_world[:3, :3].T + to_world[:3, 3]
        return _lines(plane.shadow(places, source), ends.reshape(-1, 2))


class Detector:
    """The plane on which rays end: at a distance along the camera's axis (3,), seen from its source."""

    def __init__(self, axis: np.ndarray, distance: float) -> None:
        self._axis, self._distance = np.asarray(axis, dtype=np.float64), float(distance)

    def shadow(self, points: np.ndarray, source: np.ndarray) -> np.ndarray:
        """Where rays from the source (3,) through points (N, 3) meet the plane."""
        rays = points - source
        depth = np.maximum(rays @ self._axis, _LEAST_DEPTH * self._distance)
        return source + rays * (self._distance / depth)[:, None]


def _shared_edges(corners: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends (E, 2) of edges that exactly two triangles share, and the numbers (E, 2) of these triangles.

    Coarsened surfaces have some edges of more triangles, whose sides say nothing of the outline.
    """
    pairs = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    owners = np.tile(np.arange(len(corners)), 3)
    keys = pairs.min(axis=1) * max(points, 1) + pairs.max(axis=1)
    order = np.argsort(keys, kind="stable")
    keys, owners, pairs = keys[order], owners[order], pairs[order]
    starts = np.flatnonzero(np.r_[True, keys[1:] != keys[:-1]]) if len(keys) else np.zeros(0, np.int64)
    same = starts[np.diff(np.r_[starts, len(keys)]) == 2]
    return pairs[same], np.stack([owners[same], owners[same + 1]], axis=1)


def _folded(normals: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Which triangles (T,) lie the other way round than most of those beside them, as coarsening leaves some.

    Each would have an outline of its own, a speck inside that of the bone.
    """
    units = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    against = np.einsum("ei,ei->e", units[sides[:, 0]], units[sides[:, 1]]) < 0
    beside = np.bincount(sides.ravel(), minlength=len(normals))
    opposed = np.bincount(sides[against].ravel(), minlength=len(normals))
    return 2 * opposed > beside


def _lines(points: np.ndarray, ends: np.ndarray) -> vtk.vtkPolyData:
    """Separate lines (N, 2) between points (P, 3)."""
    places = vtk.vtkPoints()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float32).reshape(-1, 3), deep=True))
    cells = vtk.vtkCellArray()
    offsets = np.arange(0, 2 * len(ends) + 1, 2, dtype=np.int64)
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(ends.ravel(), np.int64), deep=True),
    )
    found = vtk.vtkPolyData()
    found.SetPoints(places)
    found.SetLines(cells)
    return found
