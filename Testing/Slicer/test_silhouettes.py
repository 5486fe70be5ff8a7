"""Outlines on X-rays against what geometry says, and only where they belong."""

from __future__ import annotations

import unittest

import numpy as np
import scenes
import slicer
import vtk
from panel_case import views
from PolyPoseSlicer.scene import layouts
from PolyPoseSlicer.scene.bone_handles import MOST_TRIANGLES, coarsened, surface_of
from PolyPoseSlicer.scene.frames import flip_vectors
from PolyPoseSlicer.scene.silhouettes import Outline, silhouette
from PolyPoseSlicer.scene.xray_views import XrayPicture, slice_logic
from slicer_case import SlicerTestCase
from vtkmodules.util.numpy_support import vtk_to_numpy

from PolyPoseLib.geometry.camera import Camera

DETECTOR_MM = 1000.0


def picture() -> XrayPicture:
    """An X-ray of 30 x 40 pixels, 1000 mm from its source."""
    return XrayPicture("AP", Camera(*scenes.camera_matrix(), 40, 30), DETECTOR_MM, np.zeros((40, 30)))


def ball(centre: np.ndarray, radius: float, points: int = 96) -> vtk.vtkPolyData:
    """A sphere; centre: RAS mm."""
    source = vtk.vtkSphereSource()
    source.SetCenter(*centre)
    source.SetRadius(radius)
    source.SetThetaResolution(points)
    source.SetPhiResolution(points)
    source.Update()
    return source.GetOutput()


def points_of(lines: vtk.vtkPolyData) -> np.ndarray:
    return vtk_to_numpy(lines.GetPoints().GetData()).astype(float)


class SilhouetteTest(SlicerTestCase):
    def test_a_balls_outline_is_where_tangent_rays_meet_the_detector(self) -> None:
        """Every ray to the outline passes the ball's centre at its radius, and ends on the detector."""
        rng, view = np.random.default_rng(4), picture()
        source = flip_vectors(view.camera.source)
        for _case in range(8):
            centre = flip_vectors(np.array([10.0, -20.0, 30.0])) + rng.uniform(-60, 60, 3)
            radius = rng.uniform(5, 40)
            ends = points_of(silhouette(ball(centre, radius), view))
            self.assertGreater(len(ends), 20)
            rays = (ends - source) / np.linalg.norm(ends - source, axis=1)[:, None]
            passes = np.linalg.norm(np.cross(rays, centre - source), axis=1)
            np.testing.assert_allclose(passes, radius, rtol=0.01)
            np.testing.assert_allclose(view.camera.depth(flip_vectors(ends)), DETECTOR_MM, atol=0.01)

    def test_a_surface_that_is_empty_or_reaches_the_source_harms_nothing(self) -> None:
        view = picture()
        self.assertEqual(silhouette(vtk.vtkPolyData(), view).GetNumberOfPoints(), 0)
        around = silhouette(ball(flip_vectors(view.camera.source), 50.0), view)
        if around.GetNumberOfPoints():
            self.assertTrue(np.isfinite(points_of(around)).all())

    def test_a_bones_surface_encloses_its_voxels_and_is_not_too_fine(self) -> None:
        ct = scenes.add_ct(scenes.affine(left_handed=True, tilt_deg=10.0))
        segmentation = scenes.add_segmentation(ct)
        names = segmentation.GetSegmentation().GetSegmentIDs()
        surface = surface_of(segmentation, names[:1])
        mass = vtk.vtkMassProperties()
        mass.SetInputData(surface)
        volume = (scenes.labels() == 1).sum() * np.prod(scenes.SPACING)
        self.assertLess(abs(mass.GetVolume() / volume - 1), 0.25)
        self.assertLessEqual(surface.GetNumberOfCells(), MOST_TRIANGLES)
        kind = slicer.vtkSegmentationConverter.GetSegmentationClosedSurfaceRepresentationName()
        added = segmentation.GetSegmentation().ContainsRepresentation(kind)
        self.assertFalse(added, "the segmentation was changed")

    def test_a_fine_surface_is_coarsened_and_keeps_its_outline(self) -> None:
        fine = ball(np.zeros(3), 60.0, 400)
        coarse = coarsened(fine)
        self.assertGreater(fine.GetNumberOfCells(), 3 * MOST_TRIANGLES)
        self.assertLess(coarse.GetNumberOfCells(), 1.5 * MOST_TRIANGLES)
        radii = np.linalg.norm(points_of(coarse), axis=1)
        np.testing.assert_allclose(radii, 60.0, atol=0.6)

    def test_an_outline_is_seen_on_its_own_xray_alone(self) -> None:
        views()
        layouts.show(2)
        outline = Outline(1, "Outline", (1.0, 0.0, 0.0))
        outline.draw(ball(np.zeros(3), 20.0), picture())
        display = outline.node.GetDisplayNode()
        shown = [
            node.GetLayoutName()
            for node in slicer.util.getNodesByClass("vtkMRMLAbstractViewNode")
            if display.IsDisplayableInView(node.GetID())
        ]
        self.assertEqual(shown, [slice_logic(1).GetSliceNode().GetLayoutName()])
        self.assertGreater(outline.node.GetPolyData().GetNumberOfPoints(), 0)
        count = slicer.mrmlScene.GetNumberOfNodes()
        outline.remove()
        self.assertLess(slicer.mrmlScene.GetNumberOfNodes(), count - 1)


if __name__ == "__main__":
    unittest.main()
