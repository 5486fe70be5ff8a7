"""Landmarks picked by real clicks in real views."""

from __future__ import annotations

import unittest

import landmark_case
import numpy as np
import slicer
from landmark_panel_case import LandmarksCase
from panel_case import INSIDE_SLICER, lay_out, views
from PolyPoseSlicer.scene import xray_views
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.xray_source import XraySource

# isort: split
from harness.views import SliceView


class ShownView(SliceView):
    """A slice view of the application's window, with the mouse of the harness's."""

    def __init__(self, name: str) -> None:
        widget = views().sliceWidget(name)
        self.node, self.logic = widget.mrmlSliceNode(), widget.sliceLogic()
        self.window, self.interactor = widget.sliceView().renderWindow(), widget.sliceView().interactor()
        lay_out()

    def image(self) -> None:
        self.window.Render()


class PickTest(LandmarksCase):
    """Real clicks through Slicer's own interactor styles and displayable managers."""

    def view(self, name: str) -> SliceView:
        return ShownView(name) if INSIDE_SLICER else views().slices[name]

    def xray_view(self) -> SliceView:
        return self.view(xray_views.view_name(0))

    def place_of(self, view, world: np.ndarray) -> tuple[float, float]:
        """Where a slice view draws a point of RAS, in pixels from its lower left corner."""
        to_xy = np.linalg.inv(_matrix(view.node.GetXYToRAS()))
        return tuple((to_xy @ [*world, 1.0])[:2])

    def pixel_world(self, pixel: np.ndarray) -> np.ndarray:
        plane = xray_views.plane_of(0, self.camera.width)
        return (plane @ [*pixel, 0.0, 1.0])[:3]

    def test_clicks_in_the_xrays_view_are_its_pixels(self) -> None:
        self.ui.xrayPlace.click()
        self.assertTrue(self.ui.xrayPlace.checked)
        node = self.source().xray_landmarks
        view = self.xray_view()
        wanted = np.array([[6.0, 8.0], [22.0, 10.0], [9.0, 31.0], [20.0, 28.0]])
        for pixel in wanted:
            view.click(*self.place_of(view, self.pixel_world(pixel)))
        self.assertEqual(node.GetNumberOfDefinedControlPoints(), 4)
        picked = np.array([node.GetNthControlPointPosition(n) for n in range(4)])
        np.testing.assert_allclose(picked[:, :2], wanted, atol=0.12)  # half a screen pixel
        np.testing.assert_allclose(picked[:, 2], 0, atol=1e-6)
        self.assertEqual([node.GetNthControlPointLabel(n) for n in range(4)], ["1", "2", "3", "4"])
        self.ui.xrayPlace.click()
        self.assertFalse(self.ui.xrayPlace.checked)
        self.assertIsNone(self.panel.landmarks._place.placing())
        view.click(*self.place_of(view, self.pixel_world(np.array([15.0, 15.0]))))
        self.assertEqual(node.GetNumberOfDefinedControlPoints(), 4)

    def test_a_mirrored_file_keeps_its_own_columns(self) -> None:
        self.ui.xrayMirrored.currentIndex = 1
        self.ui.xrayPlace.click()
        view = self.xray_view()
        view.click(*self.place_of(view, self.pixel_world(np.array([5.0, 9.0]))))
        column, row, _depth = self.source().xray_landmarks.GetNthControlPointPosition(0)
        self.assertAlmostEqual(column, self.camera.width - 1 - 5.0, delta=0.12)
        self.assertAlmostEqual(row, 9.0, delta=0.12)

    def test_clicks_in_a_slice_of_the_ct(self) -> None:
        self.panel._show_views()
        self.ui.ctPlace.click()
        node = self.source().ct_landmarks
        view = self.view("Red")
        ras = landmark_case.CENTER * [-1, -1, 1]
        view.node.SetOrientation("Axial")
        view.fit()
        view.node.JumpSliceByCentering(*ras)
        view.click(*self.place_of(view, ras))
        self.assertEqual(node.GetNumberOfDefinedControlPoints(), 1)
        np.testing.assert_allclose(node.GetNthControlPointPositionWorld(0), ras, atol=1.0)
        self.ui.xrayPlace.click()
        self.assertFalse(self.ui.ctPlace.checked)
        self.assertTrue(self.ui.xrayPlace.checked)

    def test_a_point_picked_in_another_view_is_told(self) -> None:
        self.ui.xrayPlace.click()
        view = self.view("Red")
        view.fit()
        view.click(150, 120)
        self.settle()
        self.assertEqual(self.rows()[-1][3], "not on the X-ray")
        self.assertIn("X-ray's own view", self.ui.landmarksText.text)

    def test_a_dragged_point_is_followed(self) -> None:
        self.panel._show_views()
        self.give()
        view = self.xray_view()
        node = self.source().xray_landmarks
        before = np.array(node.GetNthControlPointPosition(1))
        start = np.array(self.place_of(view, np.array(node.GetNthControlPointPositionWorld(1))))
        view.image()
        view.drag(tuple(start), (start[0] + 12.0, start[1]))
        after = np.array(node.GetNthControlPointPosition(1))
        self.assertGreater(np.abs(after - before)[:2].max(), 0.5)
        self.assertAlmostEqual(after[2], 0.0, places=6)
        self.settle()
        self.assertGreater(float(self.rows()[1][2]), 0.2)

    def test_the_right_button_ends_picking(self) -> None:
        self.ui.xrayPlace.click()
        view = self.xray_view()
        view.move(100, 100)
        view.interactor.InvokeEvent("RightButtonPressEvent")
        view.interactor.InvokeEvent("RightButtonReleaseEvent")
        self.assertFalse(self.ui.xrayPlace.checked)

    def test_a_deleted_list_ends_picking(self) -> None:
        self.ui.xrayPlace.click()
        slicer.mrmlScene.RemoveNode(self.source().xray_landmarks)
        self.settle()
        self.assertFalse(self.ui.xrayPlace.checked)

    def test_an_unreadable_xray_above_is_named(self) -> None:
        sources = parameters.xray_sources(self.panel.parameters)
        broken = XraySource(path=str(self.folder / "nowhere.dcm"))
        parameters.store_xray_sources(self.panel.parameters, [broken, *sources])
        self.ui.xraysTable.selectRow(1)
        self.ui.xrayPlace.click()
        self.assertFalse(self.ui.xrayPlace.checked)
        self.assertIn("'nowhere.dcm' is not ready", self.ui.landmarksText.text)


def _matrix(matrix) -> np.ndarray:
    return np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(4)])


if __name__ == "__main__":
    unittest.main()
