"""The Review section on a loaded result: every control, and what it does to nodes, pictures and files."""

from __future__ import annotations

import csv
import io
import threading
import unittest
from typing import Any
from unittest import mock

import numpy as np
import scenes
import slicer
import vtk
from panel_case import PanelCase
from PolyPoseSlicer.scene import deformation, layouts, xray_views
from PolyPoseSlicer.scene.compare import Mode, compared, edges_of, normalized, resized, shrunk
from PolyPoseSlicer.scene.frames import from_vtk, to_vtk
from PolyPoseSlicer.scene.grid_transform import set_grid_transform
from PolyPoseSlicer.study.result_origin import remember_segments
from slicer_case import INSIDE_SLICER, SlicerTestCase
from vtkmodules.util.numpy_support import vtk_to_numpy

# isort: split
import qt


class CompareTest(SlicerTestCase):
    def setUp(self) -> None:
        super().setUp()
        rng = np.random.default_rng(3)
        self.xray, self.drawn = rng.random((40, 30)), rng.random((20, 15)).astype(np.float32)

    def test_every_mode_gives_a_picture_of_the_xrays_size(self) -> None:
        for mode in Mode:
            for amount in (0.0, 0.5, 1.0):
                rgb = compared(self.xray, self.drawn, mode, amount)
                self.assertEqual((rgb.shape, rgb.dtype), ((40, 30, 3), np.uint8), mode)

    def test_the_ends_of_a_blend_are_the_two_images(self) -> None:
        xray = compared(self.xray, self.drawn, Mode.XRAY, 0.5)
        drawn = compared(self.xray, self.drawn, Mode.RENDERING, 0.5)
        np.testing.assert_array_equal(compared(self.xray, self.drawn, Mode.BLEND, 0.0), xray)
        np.testing.assert_array_equal(compared(self.xray, self.drawn, Mode.BLEND, 1.0), drawn)
        np.testing.assert_array_equal(compared(self.xray, self.drawn, Mode.FLICKER, 0.5), xray)
        np.testing.assert_array_equal(compared(self.xray, self.drawn, Mode.FLICKER, 0.5, True), drawn)

    def test_images_that_agree_blend_to_grey(self) -> None:
        rgb = compared(self.xray, self.xray, Mode.BLEND, 0.5).astype(int)
        self.assertLessEqual(np.abs(rgb - rgb[..., :1]).max(), 1)

    def test_a_checkerboard_holds_both(self) -> None:
        rgb = compared(np.zeros((64, 64)), np.indices((64, 64))[0] * 1.0, Mode.CHECKERBOARD, 1.0)
        self.assertGreater(rgb.max(), 150)
        self.assertGreater((rgb == compared(np.zeros((64, 64)), None, Mode.XRAY, 0)).mean(), 0.3)

    def test_flat_and_odd_images(self) -> None:
        self.assertEqual(normalized(np.full((4, 4), 7.0)).max(), 0)
        self.assertEqual(edges_of(np.zeros((5, 5), np.float32)).max(), 0)
        self.assertEqual(shrunk(np.arange(35.0).reshape(5, 7), 2).shape, (2, 3))
        np.testing.assert_array_equal(resized(np.arange(4).reshape(2, 2), 4, 4)[::2, ::2], [[0, 1], [2, 3]])


def pixels(view: Any) -> np.ndarray:
    """What a view of the harness draws, (N, 3)."""
    return vtk_to_numpy(view.image().GetPointData().GetScalars()).copy()


class ReviewTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        folder = scenes.save_result(self.folder / "given")
        remember_segments(folder, self.segmentation)
        self.panel.review.load_result(str(folder))
        self.node = self.panel.parameters
        self.pictures = self.panel.review.pictures

    def image(self, number: int) -> np.ndarray:
        return slicer.util.arrayFromVolume(xray_views.part(number, "image")).copy()

    def backgrounds(self) -> set:
        return {each.GetBackgroundVolumeID() for each in layouts.anatomy_views()}

    def test_the_layout_shows_pictures_carms_and_slices(self) -> None:
        self.assertTrue(layouts.shown())
        for number in range(2):
            logic = slicer.app.applicationLogic().GetSliceLogicByLayoutName(xray_views.view_name(number))
            image = xray_views.part(number, "image")
            self.assertEqual(logic.GetSliceCompositeNode().GetBackgroundVolumeID(), image.GetID())
            detector = xray_views.part(number, "detector")
            self.assertIsNotNone(detector.GetDisplayNode().GetTextureImageDataConnection())
            camera = self.pictures.items[number].camera
            source = -camera.extrinsic[:3, :3].T @ camera.extrinsic[:3, 3] * [-1, -1, 1]
            points = slicer.util.arrayFromModelPoints(xray_views.part(number, "beam"))
            self.assertLess(np.linalg.norm(points - source, axis=1).min(), 13)
        self.assertEqual(self.backgrounds(), {self.node.outputVolume.GetID()})
        self.ui.layoutButton.click()
        self.assertEqual(len(self.pictures.items), 2)

    def test_an_xray_view_follows_no_other_view_and_keeps_its_picture(self) -> None:
        groups = []
        for number in range(2):
            logic = slicer.app.applicationLogic().GetSliceLogicByLayoutName(xray_views.view_name(number))
            groups.append(logic.GetSliceNode().GetViewGroup())
            before = [logic.GetSliceNode().GetSliceToRAS().GetElement(row, 3) for row in range(3)]
            slicer.vtkMRMLSliceNode.JumpAllSlices(
                slicer.mrmlScene, 10, 20, 30, slicer.vtkMRMLSliceNode.OffsetJumpSlice, 0
            )
            after = [logic.GetSliceNode().GetSliceToRAS().GetElement(row, 3) for row in range(3)]
            self.assertEqual(after, before)
            slicer.app.applicationLogic().GetSelectionNode().SetActiveVolumeID(self.ct.GetID())
            slicer.app.applicationLogic().PropagateVolumeSelection()
            image = xray_views.part(number, "image")
            self.assertEqual(logic.GetSliceCompositeNode().GetBackgroundVolumeID(), image.GetID())
        self.assertEqual(len({0, *groups}), 3)

    def test_a_picture_lies_where_the_camera_projects_it(self) -> None:
        picture = self.pictures.items[0]
        matrix = vtk.vtkMatrix4x4()
        xray_views.part(0, "image").GetIJKToRASMatrix(matrix)
        corner = np.array(matrix.MultiplyPoint((3, 5, 0, 1)))[:3] * [-1, -1, 1]
        in_camera = picture.camera.extrinsic[:3] @ [*corner, 1]
        pixel = picture.camera.intrinsics @ in_camera / in_camera[2]
        np.testing.assert_allclose(pixel[:2], [3, 5], atol=1e-6)

    def test_before_and_after(self) -> None:
        self.ui.showBefore.checked = True
        self.assertEqual(self.backgrounds(), {self.ct.GetID()})
        self.assertFalse(self.node.outputSegmentation.GetDisplayNode().GetVisibility())
        self.wait(lambda: all(each.before is not None for each in self.pictures.items))
        self.ui.showAfter.checked = True
        self.assertEqual(self.backgrounds(), {self.node.outputVolume.GetID()})
        self.assertFalse(self.segmentation.GetDisplayNode().GetVisibility())
        self.assertIsNone(self.ct.GetTransformNodeID())

    def test_comparison_of_one_view_and_of_all(self) -> None:
        other = self.image(1)
        self.ui.compareView.currentIndex = 1
        for mode in range(self.ui.compareMode.count):
            self.ui.compareMode.currentIndex = mode
            self.ui.compareAmount.value = 70
        np.testing.assert_array_equal(self.image(1), other)
        self.assertEqual(self.pictures.mode, [Mode.RENDERING, Mode.BLEND])
        self.ui.compareView.currentIndex = 2
        self.assertEqual(self.ui.compareMode.currentIndex, Mode.BLEND.value)
        self.ui.compareView.currentIndex = 0
        self.ui.compareMode.currentIndex = Mode.EDGES.value
        self.assertEqual(self.pictures.mode, [Mode.EDGES, Mode.EDGES])

    def test_flicker_swaps_and_stops(self) -> None:
        self.pictures.items[0].rendering = np.flipud(self.pictures.items[0].xray) + np.arange(30)
        self.ui.compareMode.currentIndex = Mode.FLICKER.value
        first = self.image(0)
        self.wait(lambda: (self.image(0) != first).any(), 5)
        self.wait(lambda: (self.image(0) == first).all(), 5)
        self.ui.compareMode.currentIndex = Mode.XRAY.value
        self.assertFalse(self.panel.review._flicker.isActive())

    def test_seen_from_the_other_side(self) -> None:
        logic = slicer.app.applicationLogic().GetSliceLogicByLayoutName(xray_views.view_name(0))
        before = logic.GetSliceNode().GetSliceToRAS().GetElement(0, 0)
        self.ui.fromDetector.checked = not self.ui.fromDetector.checked
        self.assertAlmostEqual(logic.GetSliceNode().GetSliceToRAS().GetElement(0, 0), -before)

    def away(self, number: int) -> float:
        """Millimetres between a view's slice and its image."""
        shown = from_vtk(xray_views.slice_logic(number).GetSliceNode().GetSliceToRAS())
        plane = xray_views.plane_of(number, self.pictures.items[number].xray.shape[1])
        normal = np.cross(plane[:3, 0], plane[:3, 1])
        return abs(float((plane[:3, 3] - shown[:3, 3]) @ (normal / np.linalg.norm(normal))))

    def test_xrays_stay_in_their_views_whatever_moves_all_slices(self) -> None:
        """Jumps and the slider leave a view on its image; panning and zooming are kept."""
        for number in range(2):
            view = xray_views.slice_logic(number).GetSliceNode()
            view.JumpAllSlices(10.0, 20.0, 30.0)
            self.wait(lambda number=number: self.away(number) < 1e-3)
            view.JumpSliceByCentering(-40.0, 5.0, 8.0)
            self.wait(lambda number=number: self.away(number) < 1e-3)
            view.SetSliceOffset(view.GetSliceOffset() + 50.0)
            self.wait(lambda number=number: self.away(number) < 1e-3)
            self.pictures.aim()
            slicer.app.processEvents()
            self.assertLess(self.away(number), 1e-3)
            field = view.GetFieldOfView()
            view.SetFieldOfView(field[0] / 2, field[1] / 2, field[2])
            shown = from_vtk(view.GetSliceToRAS())
            shown[:3, 3] += 7.0 * shown[:3, 0]
            view.GetSliceToRAS().DeepCopy(to_vtk(shown))
            view.UpdateMatrices()
            slicer.app.processEvents()
            np.testing.assert_allclose(from_vtk(view.GetSliceToRAS()), shown, atol=1e-3)
            self.assertAlmostEqual(view.GetFieldOfView()[0], field[0] / 2)
        self.pictures.clear()
        offset = view.GetSliceOffset()
        view.SetSliceOffset(offset + 50.0)
        slicer.app.processEvents()
        self.assertAlmostEqual(view.GetSliceOffset(), offset + 50.0, msg="the view is still followed")

    def test_grid_and_arrows_exclude_each_other(self) -> None:
        self.ui.showGrid.checked = True
        display = self.node.outputTransform.GetDisplayNode()
        self.assertTrue(display.GetVisibility() and display.GetVisibility2D())
        self.assertEqual(display.GetVisualizationMode(), display.VIS_MODE_GRID)
        self.ui.showGlyphs.checked = True
        self.assertFalse(self.ui.showGrid.checked)
        self.assertEqual(display.GetVisualizationMode(), display.VIS_MODE_GLYPH)
        self.ui.showGlyphs.checked = False
        self.assertFalse(display.GetVisibility())

    def test_grid_and_arrows_are_not_drawn_over_the_xrays(self) -> None:
        for box in (self.ui.showGrid, self.ui.showGlyphs):
            box.checked = True
            display = self.node.outputTransform.GetDisplayNode()
            for node in slicer.util.getNodesByClass("vtkMRMLSliceNode"):
                is_xray = node.GetLayoutName().startswith("PolyPoseXray")
                self.assertEqual(display.IsDisplayableInView(node.GetID()), not is_xray, node.GetLayoutName())
            for node in slicer.util.getNodesByClass("vtkMRMLViewNode"):
                self.assertTrue(display.IsDisplayableInView(node.GetID()))

    @unittest.skipIf(INSIDE_SLICER, "looks into the harness's views")
    def test_no_pixel_of_an_xray_changes_with_grid_and_arrows(self) -> None:
        """The views are genuine: they draw what they draw in the application, whatever a display node says."""
        opened = slicer.app.layoutManager().slices
        names = [xray_views.view_name(0), xray_views.view_name(1)]
        before = {name: pixels(opened[name]) for name in (*names, "Red")}
        for made_by_another_module in (False, True):
            if made_by_another_module:
                slicer.mrmlScene.RemoveNode(self.node.outputTransform.GetDisplayNode())
                self.node.outputTransform.CreateDefaultDisplayNodes()
            for box in (self.ui.showGrid, self.ui.showGlyphs):
                box.checked = True
                for name in names:
                    np.testing.assert_array_equal(pixels(opened[name]), before[name])
                self.assertTrue((pixels(opened["Red"]) != before["Red"]).any(), "it is not drawn at all")
                box.checked = False
                np.testing.assert_array_equal(pixels(opened["Red"]), before["Red"])

    def test_the_volume_change_and_its_folds(self) -> None:
        vectors, affine = scenes.field()
        self.ui.showJacobian.checked = True
        self.wait(lambda: "fold" in self.ui.jacobianText.text.lower())
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode")
        set_grid_transform(node, np.zeros_like(vectors), affine)
        change = deformation.volume_change(node)()
        np.testing.assert_allclose(change.values, 1, atol=1e-6)
        self.assertIn("No folds", change.text)
        k, _j, _i = np.indices(vectors.shape[:3])
        squeezed = np.zeros_like(vectors)
        squeezed += (-2.0 * k[..., None] * affine[:3, 2]).astype(np.float32)
        set_grid_transform(node, squeezed, affine)
        change = deformation.volume_change(node)()
        np.testing.assert_allclose(change.values, -1, atol=1e-4)
        self.assertEqual(change.folds, 1)
        volume = deformation.show_volume_change(change)
        colors = volume.GetDisplayNode().GetColorNode()
        rgba = [0.0] * 4
        colors.GetColor(0, rgba)
        self.assertEqual(rgba[:3], [1.0, 0.0, 1.0])
        self.ui.showJacobian.checked = False
        self.assertEqual({each.GetForegroundVolumeID() for each in layouts.anatomy_views()}, {None})

    def test_a_map_that_is_no_longer_wanted_does_not_come(self) -> None:
        go = threading.Event()
        with mock.patch.object(deformation, "_change", lambda *_: go.wait(20)):
            self.ui.showJacobian.checked = True
        self.assertEqual(self.ui.jacobianText.text, "Computing...")
        self.ui.weightStructure.currentIndex = self.ui.weightStructure.findText("femur")
        go.set()
        self.wait(lambda: "only 'femur'" in self.ui.jacobianText.text)
        self.ui.weightStructure.currentIndex = 0
        self.assertEqual(self.ui.jacobianText.text, "")
        self.assertEqual({each.GetForegroundVolumeID() for each in layouts.anatomy_views()}, {None})

    def test_a_map_that_cannot_be_computed_says_why(self) -> None:
        with mock.patch.object(deformation, "_change", side_effect=MemoryError("no memory is left")):
            self.ui.showJacobian.checked = True
            self.wait(lambda: "no memory is left" in self.ui.jacobianText.text)

    def test_the_weight_of_a_structure(self) -> None:
        self.ui.showJacobian.checked = True
        index = self.ui.weightStructure.findText("femur")
        self.ui.weightStructure.currentIndex = index
        self.assertFalse(self.ui.showJacobian.checked)
        self.wait(lambda: "only 'femur'" in self.ui.jacobianText.text)
        pelvis, femur = self.segmentation.GetSegmentation().GetSegmentIDs()[:2]
        values, _affine = deformation.structure_weight(
            self.segmentation, {"pelvis": [pelvis], "femur": [femur]}, "femur", deformation.Weighting()
        )()
        self.assertGreaterEqual(values.min(), 0)
        self.assertAlmostEqual(values.max(), 1, places=3)
        shown = {each.GetForegroundVolumeID() for each in layouts.anatomy_views()}
        self.assertEqual(len(shown), 1)
        self.assertIsNotNone(shown.pop())
        self.ui.weightStructure.currentIndex = 0
        self.assertEqual({each.GetForegroundVolumeID() for each in layouts.anatomy_views()}, {None})

    def test_only_the_bones(self) -> None:
        self.ui.bonesOnly.checked = True
        display = self.segmentation.GetDisplayNode()
        content = self.segmentation.GetSegmentation()
        shown = [display.GetSegmentVisibility(content.GetNthSegmentID(n)) for n in range(3)]
        self.assertEqual(shown, [True, True, False])
        self.ui.bonesOnly.checked = False
        self.assertTrue(display.GetSegmentVisibility(content.GetNthSegmentID(2)))

    def test_motions_relative_copied_and_saved(self) -> None:
        table = self.ui.motionsTable
        self.assertEqual([table.item(row, 1).text() for row in range(2)], ["0.00", "10.00"])
        self.assertEqual(table.item(1, 7).text(), "\u00b1 0.4 mm")
        self.assertIn("95 % across the beam [mm] 0.2", table.item(1, 7).toolTip())
        self.ui.relativeTo.currentIndex = 2
        self.assertEqual([table.item(row, 1).text() for row in range(2)], ["10.00", "0.00"])
        self.ui.copyMotions.click()
        text = qt.QApplication.clipboard().text()
        self.assertEqual(text.splitlines()[0].split("\t")[0], "Relative to femur")
        self.assertEqual(text.splitlines()[1].split("\t")[1], "10.00")
        path = self.folder / "motions.csv"
        self.panel.review.motions.save(str(path))
        self.assertIn('"', path.read_text(encoding="utf-8-sig").splitlines()[1])
        self.ui.relativeTo.currentIndex = 0
        self.assertIn("95 % along the beam [mm] 0.4", self.panel.review.motions.text())

    def test_cells_that_begin_like_formulas_are_texts(self) -> None:
        motions = self.panel.review.motions
        numbers = motions.lines[1]
        for name in ('=HYPERLINK("http://a")', "+1+cmd", "-2+3", "@SUM(A1)", "\t=1", "\r=1"):
            motions._rows[1] = [name, *numbers[1:]]
            for separator in (",", "\t"):
                rows = list(csv.reader(io.StringIO(motions.text(separator), newline=""), delimiter=separator))
                self.assertEqual(rows[2], ["'" + name, *numbers[1:]])
        motions._rows[1] = ["two\nlines, one\rname", "-1.50", "-0.10, 0.20, -0.97", "-"]
        row = list(csv.reader(io.StringIO(motions.text(","), newline="")))[2]
        self.assertEqual(row, motions.lines[1])

    def test_the_report_names_no_image_of_the_scene(self) -> None:
        self.node.ct.SetName("Secretname CT")
        for source in self.panel.xrays.sources:
            source.image.SetName("Secretname X-ray")
        self.panel.review.refresh_pictures(force=True)
        path = self.folder / "report.html"
        self.panel.saving.save_report(str(path))
        self.assertNotIn("Secretname", path.read_text(encoding="utf-8"))

    def test_the_report_holds_pictures_motions_and_warnings(self) -> None:
        path = self.folder / "report.html"
        self.panel.saving.save_report(str(path))
        text = path.read_text(encoding="utf-8")
        for expected in ("something was odd", "femur", "data:image/png;base64", "Research software"):
            self.assertIn(expected, text)
        self.panel.saving.save_report(str(self.folder / "no" / "where.html"))
        self.assertIn("cannot be written", self.ui.reviewState.text)

    def test_a_folder_that_is_no_result_is_said(self) -> None:
        volume = self.node.outputVolume
        self.panel.review.load_result(str(self.folder))
        self.assertTrue(self.ui.reviewState.text)
        self.assertIs(self.node.outputVolume, volume)

    def test_a_result_of_other_segments_gets_no_wrong_names(self) -> None:
        folder = scenes.save_result(self.folder / "foreign")
        self.panel.review.load_result(str(folder))
        content = self.node.outputSegmentation.GetSegmentation()
        self.assertEqual(content.GetNthSegment(0).GetName(), "Label 1")


if __name__ == "__main__":
    unittest.main()
