"""Bones that are moved by hand in one frame: known as such, kept only when asked, and undone."""

from __future__ import annotations

import unittest

import numpy as np
import scenes
import slicer
import track_scene_case as case
from PolyPoseSlicer.scene.frames import to_vtk
from PolyPoseSlicer.study.track_nodes import TrackNodes
from PolyPoseSlicer.study.track_record import to_patient


class CorrectingTest(case.TrackCase):
    def setUp(self) -> None:
        super().setUp()
        self.shown = self.show()
        self.shown.go_to(6)
        self.tracked = case.pose(1, 6)

    def move(self, name: str = "femur", degrees: float = 4.0) -> np.ndarray:
        """Turn a bone as a person does with its handles; returns its pose then."""
        shown: TrackNodes = self.shown
        turn = scenes.rotation((1, 1, 0), degrees)
        moved = to_patient(shown.pose_at_current(name)) @ turn
        shown.transforms[name].SetMatrixTransformToParent(to_vtk(moved))
        return to_patient(moved)

    def in_sequence(self, frame: int = 6) -> np.ndarray:
        """What the femur's sequence holds of a frame, as a pose."""
        node = self.shown.sequences["femur"].GetDataNodeAtValue(str(frame))
        matrix = node.GetTransformToParent().GetMatrix()
        return to_patient(np.array([[matrix.GetElement(r, c) for c in range(4)] for r in range(4)]))

    def test_handles_are_on_the_chosen_bone_about_its_middle(self) -> None:
        shown = self.shown
        shown.start_correcting("femur")
        self.assertEqual(shown.correcting, "femur")
        display = shown.transforms["femur"].GetDisplayNode()
        self.assertTrue(display.GetEditorVisibility() and display.GetEditorVisibility3D())
        self.assertFalse(display.GetEditorScalingEnabled())
        center = np.array(shown.transforms["femur"].GetCenterOfTransformation())
        box = np.array(shown.models["femur"].GetPolyData().GetBounds()).reshape(3, 2)
        np.testing.assert_allclose(center, box.mean(axis=1))
        shown.start_correcting("pelvis")
        self.assertFalse(display.GetEditorVisibility())
        self.assertTrue(shown.transforms["pelvis"].GetDisplayNode().GetEditorVisibility())
        shown.stop_correcting(keep=False)
        self.assertIsNone(shown.correcting)
        self.assertFalse(shown.transforms["pelvis"].GetDisplayNode().GetEditorVisibility())

    def test_handles_stay_on_the_bone_in_every_frame(self) -> None:
        """What a browser shows takes over the centre of each frame's node, too."""
        shown = self.shown
        shown.start_correcting("femur")
        centre = shown.transforms["femur"].GetCenterOfTransformation()
        self.assertGreater(np.linalg.norm(centre), 10.0)
        shown.go_to(8)
        self.assertEqual(shown.transforms["femur"].GetCenterOfTransformation(), centre)
        self.move()
        shown.stop_correcting(keep=True)
        self.assertEqual(shown.transforms["femur"].GetCenterOfTransformation(), centre)

    def test_a_bone_whose_nodes_were_deleted_is_left_alone(self) -> None:
        for part in ("transforms", "sequences"):
            with self.subTest(part):
                shown = self.shown = self.show(self.shown)
                shown.start_correcting("femur")
                slicer.mrmlScene.RemoveNode(getattr(shown, part)["femur"])
                shown.keep_pose("femur", 6, np.eye(4))
                shown.undo("femur")
                shown.start_correcting("femur")
                self.assertEqual(shown.pose_at_current("femur").shape, (4, 4))
                shown.stop_correcting(keep=True)
                self.assertEqual(shown.corrected_frames("pelvis"), [])

    def test_a_moved_bone_is_known_and_its_outline_follows(self) -> None:
        from panel_case import views

        views()
        self.shown.show_layout()
        outline = self.shown._outlines["femur"].nodes[0]
        before = outline.GetPolyData().GetBounds()
        self.assertEqual(self.shown.poses_changed(), {})
        wanted = self.move()
        changed = self.shown.poses_changed()
        self.assertEqual(list(changed), ["femur"])
        np.testing.assert_allclose(changed["femur"], wanted, atol=1e-9)
        np.testing.assert_allclose(self.shown.pose_at_current("femur"), wanted, atol=1e-9)
        self.assertNotEqual(outline.GetPolyData().GetBounds(), before)

    def test_another_frame_and_back_has_the_tracked_pose_again(self) -> None:
        """What nobody keeps is not in the sequence."""
        self.move()
        np.testing.assert_allclose(self.in_sequence(), self.tracked, atol=1e-9)
        self.shown.go_to(8)
        self.shown.go_to(6)
        self.assertEqual(self.shown.poses_changed(), {})

    def test_not_keeping_puts_the_bone_back_at_once(self) -> None:
        self.shown.start_correcting("femur")
        self.move()
        self.shown.stop_correcting(keep=False)
        self.assertEqual(self.shown.poses_changed(), {})
        np.testing.assert_array_equal(self.shown.pose_at_current("femur"), case.track().poses[3, 1])
        self.assertEqual(self.shown.corrected_frames("femur"), [])

    def test_keeping_writes_this_bone_and_frame_alone(self) -> None:
        self.shown.start_correcting("femur")
        wanted = self.move()
        self.shown.stop_correcting(keep=True)
        np.testing.assert_allclose(self.in_sequence(), wanted, atol=1e-9)
        np.testing.assert_allclose(self.shown.pose_at_current("femur"), wanted, atol=1e-9)
        for frame in (5, 8):
            np.testing.assert_allclose(self.in_sequence(frame), case.pose(1, frame), atol=1e-9)
            self.shown.go_to(frame)
            self.assertEqual(self.shown.poses_changed(), {})
        self.shown.go_to(6)
        self.assertEqual(list(self.shown.poses_changed()), ["femur"])
        self.assertEqual(self.shown.corrected_frames("femur"), [6])
        self.assertEqual(self.shown.corrected_frames("pelvis"), [])

    def test_two_bones_are_kept_together(self) -> None:
        wanted = {name: self.move(name) for name in case.NAMES}
        self.shown.stop_correcting(keep=True)
        self.shown.go_to(9)
        self.shown.go_to(6)
        for name in case.NAMES:
            np.testing.assert_allclose(self.shown.pose_at_current(name), wanted[name], atol=1e-9)

    def test_undo_returns_the_tracked_pose_of_a_kept_change(self) -> None:
        self.move()
        self.shown.stop_correcting(keep=True)
        self.shown.undo("femur")
        self.assertEqual(self.shown.poses_changed(), {})
        np.testing.assert_array_equal(self.shown.pose_at_current("femur"), case.track().poses[3, 1])
        np.testing.assert_allclose(self.in_sequence(), self.tracked, atol=1e-9)
        self.assertEqual(self.shown.corrected_frames("femur"), [])

    def test_a_kept_change_can_be_changed_again_or_left(self) -> None:
        self.move(degrees=3.0)
        self.shown.stop_correcting(keep=True)
        kept = self.shown.pose_at_current("femur")
        self.move(degrees=9.0)
        self.shown.stop_correcting(keep=False)
        np.testing.assert_allclose(self.shown.pose_at_current("femur"), kept, atol=1e-9)
        again = self.move(degrees=9.0)
        self.shown.stop_correcting(keep=True)
        np.testing.assert_allclose(self.in_sequence(), again, atol=1e-9)
        self.assertEqual(self.shown.corrected_frames("femur"), [6])

    def test_moving_a_bone_back_by_hand_is_no_change(self) -> None:
        self.move()
        self.shown.stop_correcting(keep=True)
        self.shown.transforms["femur"].SetMatrixTransformToParent(to_vtk(to_patient(self.tracked)))
        self.shown.stop_correcting(keep=True)
        self.assertEqual(self.shown.corrected_frames("femur"), [])
        np.testing.assert_allclose(self.in_sequence(), self.tracked, atol=1e-9)

    def test_a_lost_bone_that_was_placed_is_lost_no_more(self) -> None:
        self.shown.go_to(case.LOST)
        display = self.shown.models["femur"].GetDisplayNode()
        self.assertLess(display.GetOpacity(), 1.0)
        self.move()
        self.shown.stop_correcting(keep=True)
        self.assertEqual(display.GetOpacity(), 1.0)
        self.assertEqual(self.shown.doubtful_frames(), [case.DOUBTFUL])
        self.shown.undo("femur")
        self.assertLess(display.GetOpacity(), 1.0)
        self.assertEqual(self.shown.doubtful_frames(), [case.DOUBTFUL, case.LOST])

    def test_what_lies_under_a_bones_transform_moves_with_it(self) -> None:
        implant = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "implant")
        implant.SetAndObserveTransformNodeID(self.shown.transforms["femur"].GetID())
        self.shown.go_to(9)
        self.assertIs(implant.GetParentTransformNode(), self.shown.transforms["femur"])


if __name__ == "__main__":
    unittest.main()
