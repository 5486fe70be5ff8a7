"""The views: slices and 3D show the patient whole when they are new, and stay as the user left them afterwards."""

from __future__ import annotations

import types
import unittest
from typing import Any
from unittest import mock
from xml.etree import ElementTree

import numpy as np
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer.scene import fitting, layouts, xray_views
from PolyPoseSlicer.study.result_origin import remember_segments


def slice_nodes() -> list:
    """The slice views of the anatomy."""
    logic = slicer.app.applicationLogic()
    names = [each.GetLayoutName() for each in layouts.anatomy_views()]
    return [logic.GetSliceLogicByLayoutName(name).GetSliceNode() for name in names]


def box(node: slicer.vtkMRMLDisplayableNode) -> np.ndarray:
    """(2, 3) RAS mm: least and largest corner."""
    bounds = [0.0] * 6
    node.GetRASBounds(bounds)
    return np.array(bounds).reshape(3, 2).T


def corners(node: slicer.vtkMRMLDisplayableNode) -> np.ndarray:
    """(8, 3) RAS mm."""
    return np.array(np.meshgrid(*box(node).T)).reshape(3, -1).T


class ViewsTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        folder = scenes.save_result(self.folder / "given")
        remember_segments(folder, self.segmentation)
        self.result = str(folder)

    def assert_slices_show(self, volume: slicer.vtkMRMLScalarVolumeNode) -> None:
        low, high = box(volume)
        for node in slice_nodes():
            axes = node.GetSliceToRAS()
            centre = np.array([axes.GetElement(row, 3) for row in range(3)])
            self.assertTrue((centre > low).all() and (centre < high).all(), node.GetLayoutName())
            for axis in (0, 1):
                direction = np.array([axes.GetElement(row, axis) for row in range(3)])
                self.assertGreaterEqual(
                    node.GetFieldOfView()[axis] + 1e-3, abs(direction) @ (high - low), node.GetLayoutName()
                )

    def camera(self) -> slicer.vtkMRMLCameraNode:
        cameras = slicer.util.getNodesByClass("vtkMRMLCameraNode")
        return next(each for each in cameras if each.GetLayoutName() == layouts.THREE_D_VIEW)

    def assert_3d_shows(self, *nodes: slicer.vtkMRMLDisplayableNode) -> None:
        camera = self.camera()
        forward = np.subtract(camera.GetFocalPoint(), camera.GetPosition())
        for node in nodes:
            seen = corners(node) - camera.GetPosition()
            cosine = seen @ forward / np.linalg.norm(seen, axis=1) / np.linalg.norm(forward)
            angles = np.degrees(np.arccos(cosine))
            self.assertLess(angles.max(), camera.GetViewAngle() / 2, node.GetName())

    def disturb(self) -> None:
        """As a user who looks at something else."""
        for node in slice_nodes():
            node.SetFieldOfView(11.0, 12.0, 1.0)
            node.SetSliceOffset(700.0)
        self.camera().SetPosition(3000, 3000, 3000)
        self.camera().SetFocalPoint(4000, 3000, 3000)

    def left_alone(self) -> bool:
        return self.camera().GetPosition() == (3000, 3000, 3000) and all(
            node.GetFieldOfView()[:2] == (11.0, 12.0) for node in slice_nodes()
        )

    def test_entering_the_layout_shows_the_ct_whole_and_the_carms(self) -> None:
        self.ui.layoutButton.click()
        self.assert_slices_show(self.ct)
        self.assertEqual(len(xray_views.carm_nodes()), 4)
        self.assert_3d_shows(self.ct, *xray_views.carm_nodes())

    def test_afterwards_the_views_are_the_users(self) -> None:
        self.ui.layoutButton.click()
        self.disturb()
        self.ui.xraysTable.selectRow(1)
        self.ui.carmLive.checked = True
        self.panel.parameters.anchor = "femur_left"
        self.ui.showAfter.checked = True
        self.panel._show_views()
        self.assertTrue(self.left_alone())
        self.ui.layoutButton.click()
        self.assert_slices_show(self.ct)
        self.assert_3d_shows(self.ct)

    def test_a_new_result_and_another_ct_are_shown_whole(self) -> None:
        self.ui.layoutButton.click()
        self.disturb()
        self.panel.review.load_result(self.result)
        self.assert_slices_show(self.panel.parameters.outputVolume)
        self.assert_3d_shows(self.ct, *xray_views.carm_nodes())
        self.ui.showBefore.checked = True
        self.ui.showAfter.checked = False
        self.disturb()
        matrix = scenes.affine()
        matrix[:3, 3] += 500
        other = scenes.add_ct(matrix, "other")
        self.ui.ctSelector.setCurrentNode(other)
        self.assertEqual({each.GetBackgroundVolumeID() for each in layouts.anatomy_views()}, {other.GetID()})
        self.assert_slices_show(other)
        self.assert_3d_shows(other)

    def test_a_ct_outside_of_the_layout_changes_no_view(self) -> None:
        slicer.app.layoutManager().setLayout(slicer.vtkMRMLLayoutNode.SlicerLayoutFourUpView)
        before = [each.GetBackgroundVolumeID() for each in layouts.anatomy_views()]
        self.ui.ctSelector.setCurrentNode(scenes.add_ct(None, "other"))
        self.assertEqual([each.GetBackgroundVolumeID() for each in layouts.anatomy_views()], before)

    def test_a_volume_is_shown_whole_in_slices_and_3d(self) -> None:
        self.ui.layoutButton.click()
        self.disturb()
        fitting.show_volume(self.ct, self.segmentation)
        self.assert_slices_show(self.ct)
        self.assert_3d_shows(self.ct)


def least_width(layout: ElementTree.Element) -> int:
    """Pixels that the views of a layout need."""
    widths = []
    for item in layout.findall("item"):
        inner, view = item.find("layout"), item.find("view")
        if inner is not None:
            widths.append(least_width(inner))
        elif view is not None:
            slices = view.get("class") == "vtkMRMLSliceNode"
            widths.append(layouts.SLICE_PX if slices else layouts.THREE_D_PX)
    return sum(widths) if layout.get("type") == "horizontal" else max(widths)


class LayoutTest(PanelCase):
    def node(self) -> slicer.vtkMRMLLayoutNode:
        return slicer.app.layoutManager().layoutLogic().GetLayoutNode()

    def window(self, width: int) -> Any:
        """While this lasts, the window is so many pixels wide."""
        manager = slicer.app.layoutManager()
        sized = types.SimpleNamespace(
            viewport=lambda: types.SimpleNamespace(width=width),
            setLayout=manager.setLayout,
            layoutLogic=manager.layoutLogic,
        )
        application = types.SimpleNamespace(layoutManager=lambda: sized)
        return mock.patch.object(layouts, "slicer", types.SimpleNamespace(app=application))

    def names(self) -> list[str]:
        """Layout names of the views that the layout shows."""
        nodes = slicer.app.layoutManager().layoutLogic().GetViewNodes()
        return [nodes.GetItemAsObject(index).GetLayoutName() for index in range(nodes.GetNumberOfItems())]

    def forget(self) -> None:
        """As in an application that has not loaded the module yet."""
        for number in self.numbers():
            self.node().SetLayoutDescription(number, "")
            self.assertFalse(self.node().IsLayoutDescription(number))

    def numbers(self) -> dict[int, str]:
        """Descriptions of all layouts by their number."""
        all_of_them = [
            layouts.Arrangement(views, plot, narrow)
            for views in range(1, layouts.MOST_VIEWS + 1)
            for plot in (False, True)
            for narrow in (False, True)
        ]
        return {each.number: each.description for each in all_of_them}

    def test_all_layouts_are_known_once_they_are_registered(self) -> None:
        self.forget()
        layouts.register()
        layouts.register()
        self.assertEqual(len(self.numbers()), 4 * layouts.MOST_VIEWS)
        for number, description in self.numbers().items():
            self.assertEqual(self.node().GetLayoutDescription(number), description)

    def test_no_layout_widens_a_window_that_can_hold_two_slices(self) -> None:
        """Views side by side fit; each gets a share of the row, as a 3D view without one gets next to nothing."""
        for views in range(1, layouts.MOST_VIEWS + 1):
            for width in range(2 * layouts.SLICE_PX, 2400, 90):
                with self.window(width):
                    layouts.show(views)
                root = ElementTree.fromstring(self.node().GetCurrentLayoutDescription())
                self.assertEqual(len(list(root.iter("view"))), views + 4)
                for item in root.iter("item"):
                    self.assertIn("splitSize", item.attrib)
                self.assertLessEqual(least_width(root), width, (views, width))
        with self.window(1500):
            layouts.show(2)
        self.assertNotIn('type="tab"', self.node().GetCurrentLayoutDescription())

    def test_the_curve_comes_and_goes_in_the_layout(self) -> None:
        self.fill()
        self.ui.layoutButton.click()
        for on in (True, False, True):
            self.ui.showCurve.checked = on
            self.assertTrue(layouts.shown())
            self.assertEqual(layouts.PLOT_VIEW in self.names(), on)
        slicer.app.layoutManager().setLayout(slicer.vtkMRMLLayoutNode.SlicerLayoutFourUpView)
        self.ui.showCurve.checked = False
        self.assertFalse(layouts.shown())

    def test_a_layout_whose_number_came_with_a_scene_is_shown(self) -> None:
        for repair in (layouts.register, lambda: layouts.show(2)):
            self.forget()
            self.node().SetViewArrangement(layouts.LAYOUT + 1)
            self.assertEqual(self.node().GetCurrentLayoutDescription(), "")
            with self.window(1500):
                repair()
            self.assertEqual(self.node().GetCurrentLayoutDescription(), layouts.Arrangement(2).description)

    def test_a_scene_that_was_saved_in_the_layout_opens_with_its_pictures(self) -> None:
        self.fill()
        self.ui.layoutButton.click()
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.util.saveScene(path))
        slicer.mrmlScene.Clear()
        slicer.app.layoutManager().setLayout(slicer.vtkMRMLLayoutNode.SlicerLayoutFourUpView)
        slicer.util.loadScene(path)
        self.wait(lambda: len(self.panel.review.pictures.items) == 2, 5)
        self.assertTrue(layouts.shown())
        for number in range(2):
            logic = xray_views.slice_logic(number)
            image = xray_views.part(number, "image")
            self.assertEqual(logic.GetSliceCompositeNode().GetBackgroundVolumeID(), image.GetID())


if __name__ == "__main__":
    unittest.main()
