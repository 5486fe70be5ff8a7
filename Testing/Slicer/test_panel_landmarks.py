"""Landmarks in the panel: solved live, kept with the scene."""

from __future__ import annotations

from dataclasses import replace

import landmark_case
import numpy as np
import slicer
from landmark_panel_case import LandmarksCase
from panel_case import choose_node, lay_out
from PolyPoseSlicer.scene import landmark_lists, pixel_frames, xray_views
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.camera_source import CameraSource

from PolyPoseLib.data.found_camera import FoundCamera


class LiveTest(LandmarksCase):
    def test_the_camera_follows_the_points(self) -> None:
        self.give()
        np.testing.assert_allclose(self.shown(), self.camera.extrinsic, atol=1e-3)
        self.assertIn("6 of 6 landmarks used, RMS error 0.0 mm", self.ui.landmarksText.text)
        self.assertNotIn("9888", self.ui.landmarksText.text)
        self.assertEqual([row[3] for row in self.rows()], ["used"] * 6)
        self.assertEqual(self.ui.xraysTable.item(0, 1).text(), "landmarks")
        self.assertIn("landmarks", self.ui.xraysTable.item(0, 2).text())
        # The C-arm's sliders stand at the solved camera.
        placed = self.panel.carm.placement().extrinsic(self.panel.carm.reference())
        np.testing.assert_allclose(placed[:3, :3], self.camera.extrinsic[:3, :3], atol=3e-3)
        np.testing.assert_allclose(placed[:3, 3], self.camera.extrinsic[:3, 3], atol=2.0)

    def test_a_moved_point_moves_errors_projections_and_camera(self) -> None:
        self.give()
        before = self.shown()
        node = self.source().xray_landmarks
        projected = self.panel.landmarks._projected
        self.assertTrue(projected.GetLocked() and projected.GetHideFromEditors())
        self.assertEqual(projected.GetNumberOfControlPoints(), 6)
        column, row, _depth = node.GetNthControlPointPosition(2)
        for shift in (1.0, 3.0, 5.0):
            node.SetNthControlPointPosition(2, column + shift, row, 0.0)
        self.wait(lambda: max(float(each[2]) for each in self.rows()) > 0.3)
        errors = [float(each[2]) for each in self.rows()]
        for n in range(6):
            far = np.subtract(projected.GetNthControlPointPosition(n), node.GetNthControlPointPosition(n))
            self.assertAlmostEqual(float(np.linalg.norm(far)), errors[n], delta=0.06)
        self.settle()
        self.assertGreater(np.abs(self.shown() - before).max(), 1e-3)

    def test_the_point_that_follows_the_mouse_is_no_edit(self) -> None:
        rng = np.random.default_rng(3)
        self.give(pixels=rng.permutation(self.pixels) + rng.uniform(-8, 8, (6, 2)))
        finding = FoundCamera.from_dict(
            {
                "extrinsic": self.camera.extrinsic.tolist(), "sure": False, "mirrored": False, "within": [2, 10],
                "how": "6 of 6 landmarks", "warnings": [], "similarity": None, "runner_up": None,
            }
        )  # fmt: skip
        self.panel.xrays.change({0: replace(self.source(), found=finding)})
        self.settle()
        node = self.source().xray_landmarks
        for column in (10, 12):
            node.SetNthControlPointPosition(
                node.AddControlPoint([column, 8, 0]), column, 8, 0, slicer.vtkMRMLMarkupsNode.PositionPreview
            )
            self.settle()
        node.RemoveNthControlPoint(7)
        node.RemoveNthControlPoint(6)
        self.settle()
        self.assertIsNotNone(self.source().found)
        node.SetNthControlPointPosition(2, 20, 20, 0.0)
        self.settle()
        self.assertIsNone(self.source().found)

    def test_a_wrong_pair_is_left_out_and_marked(self) -> None:
        wrong = self.pixels.copy()
        wrong[4] += [20, -12]
        self.give(pixels=wrong)
        self.assertEqual([row[3] == "used" for row in self.rows()], [True] * 4 + [False, True])
        self.assertIn("inconsistent with the others", self.rows()[4][3])
        np.testing.assert_allclose(self.shown(), self.camera.extrinsic, atol=1e-3)

    def test_fewer_than_four_and_lines_are_text(self) -> None:
        self.give(self.points[:3], self.pixels[:3])
        self.assertIn("3 of at least 4 pairs", self.ui.landmarksText.text)
        self.assertEqual(self.rows()[0][1:], ["-", "-", "pending"])
        self.assertIsNone(self.shown())
        self.assertIn("pick landmarks", self.ui.xraysTable.item(0, 2).text())
        line = landmark_case.CENTER + np.outer(np.linspace(-20, 20, 5), [1, 0, 0])
        self.give(line, self.camera.project(line))
        self.assertIn("on one line", self.ui.landmarksText.text)
        self.assertIn("9888", self.ui.landmarksText.text)

    def test_points_that_become_too_few_take_the_camera_away(self) -> None:
        self.give()
        self.assertIsNotNone(self.source().landmark_camera)
        cameras = slicer.mrmlScene.GetNumberOfNodesByClass("vtkMRMLLinearTransformNode")
        for _ in range(3):
            self.ui.landmarksTable.selectRow(0)
            self.ui.removeLandmark.click()
            self.wait(lambda: not self.panel.landmarks._solve_timer.isActive())
        self.settle()
        self.assertEqual(self.source().ct_landmarks.GetNumberOfControlPoints(), 3)
        self.assertEqual(self.source().xray_landmarks.GetNumberOfControlPoints(), 3)
        self.assertIsNone(self.source().landmark_camera)
        self.assertIsNone(self.shown())
        after = slicer.mrmlScene.GetNumberOfNodesByClass("vtkMRMLLinearTransformNode")
        self.assertEqual(after, cameras - 1)

    def test_contradicting_landmarks_are_not_taken(self) -> None:
        rng = np.random.default_rng(3)
        self.give(pixels=rng.permutation(self.pixels) + rng.uniform(-8, 8, (6, 2)))
        self.assertIn("9888", self.ui.landmarksText.text)
        self.assertIsNone(self.shown())

    def test_the_image_moves_with_the_camera_and_stays_zoomed(self) -> None:
        self.panel._show_views()
        lay_out()
        view = slicer.app.applicationLogic().GetSliceLogicByLayoutName(xray_views.view_name(0)).GetSliceNode()
        across, down, deep = view.GetFieldOfView()
        view.SetFieldOfView(across / 3, down / 3, deep)
        self.give()
        plane = xray_views.plane_of(0, self.camera.width)
        center = (plane @ [(self.camera.width - 1) / 2, (self.camera.height - 1) / 2, 0, 1])[:3]
        np.testing.assert_allclose(
            [view.GetSliceToRAS().GetElement(row, 3) for row in range(3)], center, atol=1e-3
        )
        np.testing.assert_allclose(view.GetFieldOfView()[:2], [across / 3, down / 3], rtol=1e-6)
        source = -self.camera.extrinsic[:3, :3].T @ self.camera.extrinsic[:3, 3]
        towards = center * [-1, -1, 1] - source
        axis = self.camera.extrinsic[2, :3]
        self.assertGreater(towards @ axis / np.linalg.norm(towards), 0.98)


class ListsTest(LandmarksCase):
    def test_an_xray_list_belongs_to_one_xray(self) -> None:
        self.give()
        node = self.source().xray_landmarks
        self.ui.xraysTable.selectRow(1)
        self.choose(CameraSource.LANDMARKS)
        self.assertIsNone(self.ui.xrayLandmarks.currentNode())
        choose_node(self.ui.xrayLandmarks, node)
        self.assertIn("each X-ray needs a list of its own", self.ui.landmarksText.text)
        self.assertIsNone(self.ui.xrayLandmarks.currentNode())
        self.assertIsNone(self.source(1).xray_landmarks)
        # The CT's list may be shared.
        choose_node(self.ui.ctLandmarks, self.source().ct_landmarks)
        self.assertIs(self.source(1).ct_landmarks, self.source().ct_landmarks)
        self.assertIn("Only in the CT", self._text_after_solving())

    def _text_after_solving(self) -> str:
        self.settle()
        return self.ui.landmarksText.text

    def test_a_deleted_list_is_forgotten(self) -> None:
        self.give()
        slicer.mrmlScene.RemoveNode(self.source().ct_landmarks)
        self.settle()
        self.assertIsNone(self.source().ct_landmarks)
        self.assertIn("0 of at least 4", self.ui.landmarksText.text)
        frames = pixel_frames.all_frames()
        self.assertEqual(len(frames), 1)
        slicer.mrmlScene.RemoveNode(self.source().xray_landmarks)
        self.settle()
        self.assertEqual(pixel_frames.all_frames(), [])
        self.assertIsNone(self.panel.landmarks._projected)

    def test_a_deleted_list_is_not_replaced_by_another_that_the_selector_moves_on_to(self) -> None:
        self.give()
        other = landmark_case.add_ct_list(self.points + 1)
        self.ui.xraysTable.selectRow(1)
        self.choose(CameraSource.LANDMARKS)
        choose_node(self.ui.ctLandmarks, other)
        slicer.mrmlScene.RemoveNode(other)
        self.settle()
        self.assertIsNone(self.source(1).ct_landmarks)
        self.assertIsNone(self.ui.ctLandmarks.currentNode())
        self.assertIsNotNone(self.source(0).ct_landmarks)

    def test_a_removed_xray_leaves_its_points_where_they_are(self) -> None:
        self.give()
        node = self.source().xray_landmarks
        place = list(node.GetNthControlPointPositionWorld(0))
        self.ui.removeXrayButton.click()
        self.settle()
        self.assertEqual(self.ui.xraysTable.rowCount, 1)
        frame = pixel_frames.frame_above(node)
        self.assertEqual(frame.GetAttribute(pixel_frames.FRAME_ATTRIBUTE), "none")
        self.panel._show_views()
        self.assertEqual(list(node.GetNthControlPointPositionWorld(0)), place)
        observed = {each[0] for each in self.host.Observations}
        self.assertNotIn(node, observed)

    def test_frames_follow_the_rows(self) -> None:
        self.give()
        frame = pixel_frames.frame_above(self.source().xray_landmarks)
        sources = parameters.xray_sources(self.panel.parameters)
        parameters.store_xray_sources(self.panel.parameters, sources[::-1])
        self.assertEqual(frame.GetAttribute(pixel_frames.FRAME_ATTRIBUTE), "1")

    def test_another_way_and_back(self) -> None:
        self.give()
        self.choose(CameraSource.SEARCH)
        self.assertFalse(self.ui.landmarksBox.isVisibleTo(self.ui.cameraSection))
        self.assertEqual(self.ui.landmarksTable.rowCount, 0)
        self.assertIsNone(self.shown())
        self.choose(CameraSource.LANDMARKS)
        self.settle()
        np.testing.assert_allclose(self.shown(), self.camera.extrinsic, atol=1e-3)

    def test_leaving_the_module_settles_and_leaves_nothing(self) -> None:
        self.give()
        node = self.source().xray_landmarks
        column, row, _depth = node.GetNthControlPointPosition(0)
        node.SetNthControlPointPosition(0, column + 1.0, row, 0.0)
        self.wait(lambda: self.panel.landmarks._settle_timer.isActive())
        before = self.shown()
        self.panel.exit()
        self.assertEqual({each[0] for each in self.host.Observations}, {slicer.mrmlScene})
        hidden = [
            n for n in slicer.util.getNodesByClass("vtkMRMLMarkupsFiducialNode") if n.GetHideFromEditors()
        ]
        self.assertEqual(hidden, [])
        self.panel.enter()
        self.assertGreater(np.abs(self.shown() - before).max(), 1e-4)

    def test_closing_the_scene_while_points_move(self) -> None:
        self.give()
        node = self.source().xray_landmarks
        node.SetNthControlPointPosition(0, 3.0, 3.0, 0.0)
        slicer.mrmlScene.Clear()
        self.assertEqual(self.ui.landmarksTable.rowCount, 0)
        self.assertFalse(self.ui.ctPlace.enabled)
        for _ in range(3):
            slicer.app.processEvents()

    def test_lists_are_chosen_at_once_in_a_scene_that_follows_another(self) -> None:
        self.give()
        names = [node.GetID() for node in (self.source().ct_landmarks, self.source().xray_landmarks)]
        slicer.mrmlScene.Clear()
        self.begin()
        self.give()
        lists = [self.source().ct_landmarks, self.source().xray_landmarks]
        self.assertEqual([node and node.GetID() for node in lists], names, "IDs begin anew")

    def test_a_saved_scene_comes_back(self) -> None:
        self.give()
        expected = self.shown()
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.util.saveScene(path))
        slicer.mrmlScene.Clear()
        slicer.util.loadScene(path)
        self.wait(lambda: self.ui.xraysTable.rowCount == 2, 5)
        self.ui.xraysTable.selectRow(0)
        self.settle()
        self.assertIs(self.source().camera_source, CameraSource.LANDMARKS)
        self.assertEqual(len(self.rows()), 6)
        np.testing.assert_allclose(self.shown(), expected, atol=1e-6)
        lists = slicer.util.getNodesByClass("vtkMRMLMarkupsFiducialNode")
        self.assertEqual(len([n for n in lists if not n.GetHideFromEditors()]), 2)
        np.testing.assert_allclose(
            landmark_lists.pairs_of(self.source().ct_landmarks, self.source().xray_landmarks).pixels,
            self.pixels,
            atol=1e-4,
        )
        self.panel._show_views()
        plane = xray_views.plane_of(0, self.camera.width)
        np.testing.assert_allclose(
            self.source().xray_landmarks.GetNthControlPointPositionWorld(3),
            (plane @ [*self.pixels[3], 0.0, 1.0])[:3],
            atol=1e-3,
        )

    def test_a_scene_of_an_earlier_version_has_no_landmarks(self) -> None:
        node = self.panel.parameters.parameterNode
        self.panel.parameters.xrayCtLandmarks = []
        self.panel.parameters.xrayLandmarks = []
        node.Modified()
        self.assertEqual(len(parameters.xray_sources(self.panel.parameters)), 2)
        self.assertIsNone(self.source().ct_landmarks)
