"""Outlines of rigid surfaces against geometry and VTK's own filter, and how long they take."""

from __future__ import annotations

import time
import unittest

import numpy as np
import scenes
import vtk
from PolyPoseSlicer.scene.frames import to_vtk
from PolyPoseSlicer.scene.rigid_outlines import Detector, RigidSurface
from slicer_case import SlicerTestCase
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

SOURCE = np.array([30.0, -700.0, 60.0])
AXIS = np.array([0.0, 1.0, 0.0])
DETECTOR = Detector(AXIS, 900.0)


def ring(points: int = 40) -> vtk.vtkPolyData:
    """A closed surface that is not convex, far from its coordinates' origin; points: along a side of its box."""
    step = 80.0 / points
    grid = vtk.vtkImageData()
    grid.SetDimensions(points, points, points)
    grid.SetSpacing(step, step, step)
    grid.SetOrigin(80.0, 0.0, -340.0)
    axis = (np.arange(points) - points / 2) * step
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    inside = 9.0 - np.hypot(np.hypot(x, y) - 25.0, z + 0.1 * x)
    grid.GetPointData().SetScalars(numpy_to_vtk(inside.ravel(), deep=True))
    contour = vtk.vtkFlyingEdges3D()
    contour.SetInputData(grid)
    contour.SetValue(0, 0.0)
    contour.Update()
    return contour.GetOutput()


def shifted(matrix: np.ndarray, by: tuple[float, float, float]) -> np.ndarray:
    matrix = matrix.copy()
    matrix[:3, 3] += by
    return matrix


def moved(surface: vtk.vtkPolyData, matrix: np.ndarray) -> vtk.vtkPolyData:
    place, turn = vtk.vtkTransformPolyDataFilter(), vtk.vtkTransform()
    turn.SetMatrix(to_vtk(matrix))
    place.SetTransform(turn)
    place.SetInputData(surface)
    place.Update()
    return place.GetOutput()


def segments(lines: vtk.vtkPolyData) -> set[tuple]:
    """Ends of all lines, rounded, whichever comes first."""
    points = vtk_to_numpy(lines.GetPoints().GetData()).round(1) + 0.0
    ends = vtk_to_numpy(lines.GetLines().GetConnectivityArray()).reshape(-1, 2)
    return {tuple(sorted(map(tuple, points[each].tolist()))) for each in ends}


class RigidOutlinesTest(SlicerTestCase):
    def test_edges_are_those_of_vtk(self) -> None:
        """In poses drawn at random; VTK is given the surface where it is, this the pose."""
        rng, surface = np.random.default_rng(1), ring()
        rigid = RigidSurface(surface)
        for _case in range(5):
            pose = scenes.rotation(tuple(rng.normal(size=3)), rng.uniform(-180, 180))
            pose[:3, 3] = rng.uniform(-40, 40, 3) - pose[:3, :3] @ (120, 40, -300)
            found = rigid.outline(pose, SOURCE, DETECTOR)
            edges = vtk.vtkPolyDataSilhouette()
            edges.SetInputData(moved(surface, pose))
            edges.SetDirectionToSpecifiedOrigin()
            edges.SetOrigin(*SOURCE)
            edges.SetEnableFeatureAngle(False)
            edges.SetBorderEdges(False)
            edges.Update()
            points = vtk_to_numpy(edges.GetOutput().GetPoints().GetData()).astype(float)
            rays = points - SOURCE
            shadow = vtk.vtkPoints()
            for each in SOURCE + rays * (900.0 / (rays @ AXIS))[:, None]:
                shadow.InsertNextPoint(*each)
            edges.GetOutput().SetPoints(shadow)
            wanted = segments(edges.GetOutput())
            self.assertGreater(len(wanted), 60)
            # Triangles seen edge on may fall to either side, and numbers round up or down.
            self.assertLess(len(wanted ^ segments(found)), 0.05 * len(wanted))

    def test_a_balls_outline_passes_it_at_its_radius_and_ends_on_the_detector(self) -> None:
        source = vtk.vtkSphereSource()
        source.SetRadius(40.0)
        source.SetThetaResolution(120)
        source.SetPhiResolution(120)
        source.Update()
        pose = shifted(np.eye(4), (15.0, -30.0, 80.0))
        found = RigidSurface(source.GetOutput()).outline(pose, SOURCE, DETECTOR)
        ends = vtk_to_numpy(found.GetPoints().GetData()).astype(float)
        rays = (ends - SOURCE) / np.linalg.norm(ends - SOURCE, axis=1)[:, None]
        np.testing.assert_allclose(
            np.linalg.norm(np.cross(rays, pose[:3, 3] - SOURCE), axis=1), 40.0, rtol=0.01
        )
        np.testing.assert_allclose((ends - SOURCE) @ AXIS, 900.0, atol=0.01)

    def test_nothing_and_what_reaches_the_source_harm_nothing(self) -> None:
        self.assertEqual(
            RigidSurface(vtk.vtkPolyData()).outline(np.eye(4), SOURCE, DETECTOR).GetNumberOfCells(), 0
        )
        around = RigidSurface(ring()).outline(
            shifted(np.eye(4), tuple(SOURCE - (120, 40, -300))), SOURCE, DETECTOR
        )
        self.assertTrue(np.isfinite(vtk_to_numpy(around.GetPoints().GetData())).all())

    def test_a_frame_of_200_000_triangles_is_faster_than_the_eye(self) -> None:
        """Three bones on two X-rays; processor time, as the machine may be busy with other things."""
        bone = RigidSurface(ring(130))
        self.assertGreater(3 * 2 * len(bone.points), 200_000)  # twice as many triangles as points
        other = SOURCE + np.array([400.0, 50.0, 0.0])
        begun = time.process_time()
        for frame in range(5):
            for _bone in range(3):
                for source in (SOURCE, other):
                    bone.outline(scenes.rotation((1, 2, 3), 5.0 * frame), source, DETECTOR)
        self.assertLess((time.process_time() - begun) / 5, 0.1)


if __name__ == "__main__":
    unittest.main()
