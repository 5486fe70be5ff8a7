"""Ellipsoids of carried points, as one surface."""

from __future__ import annotations

import unittest

import numpy as np
import vtk
from PolyPoseSlicer.scene.ellipsoids import ellipsoid_surface
from PolyPoseSlicer.scene.frames import flip_vectors
from vtkmodules.util.numpy_support import vtk_to_numpy


class EllipsoidTest(unittest.TestCase):
    def test_every_vertex_lies_on_the_95_percent_surface(self) -> None:
        from scipy.stats import chi2

        random = np.random.default_rng(5)
        points = random.uniform(-100, 100, (7, 3))
        roots = random.normal(size=(7, 3, 3))
        covariances = roots @ roots.transpose(0, 2, 1) + 0.01 * np.eye(3)
        covariances[4] = np.nan
        surface = ellipsoid_surface(points, covariances)
        vertices = flip_vectors(vtk_to_numpy(surface.GetPoints().GetData()).astype(float)).reshape(6, -1, 3)
        for number, own in zip((0, 1, 2, 3, 5, 6), vertices, strict=True):
            away = own - points[number]
            squared = np.einsum("vi,ij,vj->v", away, np.linalg.inv(covariances[number]), away)
            np.testing.assert_allclose(squared, chi2.ppf(0.95, 3), rtol=1e-3)
        edges = vtk.vtkFeatureEdges()
        edges.SetInputData(surface)
        edges.FeatureEdgesOff()
        edges.ManifoldEdgesOff()
        edges.Update()
        self.assertEqual(edges.GetOutput().GetNumberOfCells(), 0)  # closed

    def test_no_points_give_an_empty_surface(self) -> None:
        surface = ellipsoid_surface(np.zeros((0, 3)), np.zeros((0, 3, 3)))
        self.assertEqual(surface.GetNumberOfCells(), 0)


if __name__ == "__main__":
    unittest.main()
