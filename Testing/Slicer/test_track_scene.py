"""A track in the scene: bones and X-rays follow the browser, all of it goes, and all of it is found again."""

from __future__ import annotations

import gc
import unittest
import weakref
import zipfile
from collections.abc import Sequence

import numpy as np
import slicer
import track_scene_case as case
import vtk
from panel_case import views
from PolyPoseSlicer.scene import layouts, track_layout
from PolyPoseSlicer.scene.frames import flip_map, flip_vectors, from_vtk
from PolyPoseSlicer.scene.track_outlines import PoseState
from PolyPoseSlicer.study.track_nodes import TrackNodes
from PolyPoseSlicer.study.track_scene import show_track
from vtkmodules.util.numpy_support import vtk_to_numpy

from PolyPoseLib.errors import InputError


def matrix_of(node: slicer.vtkMRMLTransformNode) -> np.ndarray:
    matrix = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToParent(matrix)
    return from_vtk(matrix)


def value_of(volume: slicer.vtkMRMLVolumeNode) -> float:
    """The number of the image that a volume shows."""
    return float(slicer.util.arrayFromVolume(volume)[0, 3, 9])


class TrackSceneTest(case.TrackCase):
    def test_bones_are_where_the_poses_have_them(self) -> None:
        """The core's poses lead from the patient to the CT, in LPS; Slicer's transforms back, in RAS."""
        shown = self.show()
        for frame in (3, 6, 10):
            shown.go_to(frame)
            self.assertEqual(shown.frame, frame)
            for bone, name in enumerate(case.NAMES):
                wanted = flip_map(np.linalg.inv(case.pose(bone, frame)))
                np.testing.assert_allclose(matrix_of(shown.transforms[name]), wanted, atol=1e-9)
                np.testing.assert_allclose(shown.pose_at_current(name), case.pose(bone, frame), atol=1e-12)
                self.assertIs(shown.models[name].GetParentTransformNode(), shown.transforms[name])
        box = [0.0] * 6
        shown.models["femur"].GetRASBounds(box)
        middle = flip_vectors(np.array(box).reshape(3, 2).mean(axis=1))
        inside = (case.pose(1, 10) @ np.r_[middle, 1])[:3]
        np.testing.assert_allclose(
            inside, case.track().centroids[1], atol=8.0
        )  # a turned box is a larger one

    def test_playing_is_slicers_own(self) -> None:
        """Its logic moves bones and X-rays on, and its rate is no faster than people see."""
        shown = self.show()
        self.assertEqual(shown.browser.GetPlaybackRateFps(), 30.0)
        self.assertEqual(shown.browser.GetNumberOfItems(), case.FRAMES)
        shown.browser.SelectNextItem(2)
        self.assertEqual((shown.frame, value_of(shown.images.volumes["left"])), (5, 5))
        shown.browser.SelectLastItem()
        self.assertEqual((shown.frame, value_of(shown.images.volumes["right"])), (10, 14))
        shown.go_to(999)
        self.assertEqual(shown.frame, 10)

    def test_xrays_share_their_pixels_and_their_own_browsers_stay(self) -> None:
        logic = slicer.modules.sequences.logic()
        own = [logic.GetFirstBrowserNodeForSequenceNode(each) for each in self.xrays.values()]
        states = [
            (each.GetSelectedItemNumber(), each.GetNumberOfSynchronizedSequenceNodes(True)) for each in own
        ]
        shown = self.show()
        shown.go_to(8)
        for name, first in case.OFFSETS.items():
            held = self.xrays[name].GetNthDataNode(8 + first).GetImageData()
            self.assertIs(shown.images.volumes[name].GetImageData(), held)
            self.assertEqual(self.xrays[name].GetNthIndexValue(8), "0.160")
        now = [
            (each.GetSelectedItemNumber(), each.GetNumberOfSynchronizedSequenceNodes(True)) for each in own
        ]
        self.assertEqual(now, states)

    def test_a_frame_without_an_xray_shows_none(self) -> None:
        self.xrays["right"] = case.add_sequence("short", 4 + 6)
        shown = self.show()
        shown.go_to(9)
        self.assertIsNone(shown.images.volumes["right"].GetImageData())
        shown.go_to(5)
        self.assertEqual(value_of(shown.images.volumes["right"]), 9)

    def test_a_stack_of_slices_serves_as_well_on_its_own_memory(self) -> None:
        values = np.arange(20, dtype=np.uint16)[:, None, None] * np.ones(case.SHAPE, np.uint16)
        stack = slicer.util.addVolumeFromArray(values, name="stack")
        self.xrays["left"] = stack
        shown = self.show()
        shown.go_to(7)
        self.assertEqual(value_of(shown.images.volumes["left"]), 7)
        slicer.util.arrayFromVolume(stack)[7] = 99
        self.assertEqual(value_of(shown.images.volumes["left"]), 99)

    def test_xrays_lie_where_their_cameras_project(self) -> None:
        """A point of the patient, its pixel, and the voxel at that pixel lie on one ray; mirrored files too."""
        shown = show_track(
            self.saved, case.TrackInputs(**{**self.inputs().__dict__, "mirrored": {"right": True}})
        )
        self.addCleanup(shown.release)
        for number, name in enumerate(case.OFFSETS):
            camera, matrix = case.camera(number), vtk.vtkMatrix4x4()
            shown.images.volumes[name].GetIJKToRASMatrix(matrix)
            point = case.CENTRE + np.array([12.0, -7.0, 20.0])
            column, row = camera.project(point[None])[0][:2]
            stored = column if name == "left" else case.SHAPE[1] - 1 - column
            place = flip_vectors((from_vtk(matrix) @ [stored, row, 0, 1])[:3])
            one, other = place - camera.source, point - camera.source
            self.assertLess(
                np.linalg.norm(np.cross(one, other)) / np.linalg.norm(one) / np.linalg.norm(other), 1e-6
            )
            self.assertGreater(camera.depth(place[None])[0], camera.depth(point[None])[0])

    def test_outlines_follow_the_bones_on_the_xrays_alone(self) -> None:
        views()
        shown = self.show()
        self.assertTrue(shown.show_layout())
        outlines = shown._outlines["femur"].nodes
        self.assertEqual(len(outlines), 2)
        for number, node in enumerate(outlines):
            display = node.GetDisplayNode()
            self.assertEqual(display.GetNumberOfViewNodeIDs(), 1)
            view = slicer.mrmlScene.GetNodeByID(display.GetNthViewNodeID(0))
            self.assertEqual(view.GetLayoutName(), track_layout.view_name(number))
        for frame in (4, 9):
            shown.go_to(frame)
            for number, node in enumerate(outlines):
                camera = case.camera(number)
                drawn = flip_vectors(vtk_to_numpy(node.GetPolyData().GetPoints().GetData()).astype(float))
                pixels = camera.project(drawn)[..., :2]
                surface = vtk_to_numpy(shown.models["femur"].GetPolyData().GetPoints().GetData()).astype(
                    float
                )
                moved = np.c_[surface, np.ones(len(surface))] @ matrix_of(shown.transforms["femur"]).T
                projected = camera.project(flip_vectors(moved[:, :3]))[..., :2]
                np.testing.assert_allclose(pixels.min(axis=0), projected.min(axis=0), atol=0.02)
                np.testing.assert_allclose(pixels.max(axis=0), projected.max(axis=0), atol=0.02)

    def test_a_lost_bone_is_pale_and_a_flagged_one_has_another_color(self) -> None:
        shown = self.show()
        self.assertEqual(shown.doubtful_frames(), [case.DOUBTFUL, case.LOST])
        display = shown._outlines["femur"].nodes[0].GetDisplayNode()
        colors, opacities = {}, {}
        for frame in (4, case.DOUBTFUL, case.LOST, 8):
            shown.go_to(frame)
            colors[frame] = display.GetColor()
            opacities[frame] = shown.models["femur"].GetDisplayNode().GetOpacity()
            self.assertEqual(display.GetSliceIntersectionOpacity(), opacities[frame])
        self.assertEqual(colors[4], (0.0, 1.0, 0.0))
        self.assertEqual(colors[4], colors[8])
        self.assertEqual(len(set(colors.values())), 3)
        self.assertEqual([opacities[frame] < 1 for frame in (4, case.DOUBTFUL, case.LOST, 8)], [0, 0, 1, 0])
        self.assertEqual(shown.models["pelvis"].GetDisplayNode().GetOpacity(), 1.0)
        self.assertEqual(shown.record.states(case.LOST)["femur"], PoseState.LOST)
        shown.go_to(case.LOST)
        near = min(np.abs(shown.pose_at_current("femur") - case.pose(1, frame)).max() for frame in (6, 8))
        self.assertEqual(near, 0.0)  # where a frame beside it has the bone

    def test_the_layout_shows_xrays_whole_with_plots(self) -> None:
        views()
        shown = self.show()
        shown.show_layout()
        charts = [node.GetPlotChartNodeID() for node in slicer.util.getNodesByClass("vtkMRMLPlotViewNode")]
        self.assertLessEqual({each.GetID() for each in shown.charts}, set(charts))
        for number, name in enumerate(case.OFFSETS):
            logic = track_layout.slice_logic(number)
            shown_id = logic.GetSliceCompositeNode().GetBackgroundVolumeID()
            self.assertEqual(shown_id, shown.images.volumes[name].GetID())
            self.assertNotIn(logic.GetSliceNode().GetID(), layouts.patient_views())
        self.assertFalse(layouts.shown())
        self.assertTrue(track_layout.shown())

    def test_nodes_have_names_and_a_folder(self) -> None:
        shown = self.show()
        tree = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(slicer.mrmlScene)
        self.assertNotEqual(shown.folder, 0)
        for node in (
            *shown.transforms.values(),
            *shown.models.values(),
            *shown.charts,
            *shown.sequences.values(),
        ):
            self.assertEqual(tree.GetItemParent(tree.GetItemByDataNode(node)), shown.folder)
        names = [node.GetName() for node in self.made()]
        self.assertEqual(len(set(names)), len(names))
        self.assertIn("femur in motion", names)
        self.assertIn("hip angles", names)

    def made(self) -> list:
        """Nodes that the track brought, without those that display and store them."""
        nodes = [slicer.mrmlScene.GetNodeByID(each) for each in self.nodes() - self.before]
        return [
            each
            for each in nodes
            if not each.IsA("vtkMRMLDisplayNode") and not each.IsA("vtkMRMLStorageNode")
        ]

    def test_removing_takes_all_of_it_and_nothing_else(self) -> None:
        shown = self.show()
        mine = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "implant")
        mine.SetAndObserveTransformNodeID(shown.transforms["femur"].GetID())
        tree = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(slicer.mrmlScene)
        items = tree.GetNumberOfItems()
        self.assertGreater(len(self.nodes()), len(self.before) + 20)
        shown.remove()
        self.assertEqual(self.nodes() - self.before, {mine.GetID()})
        self.assertEqual(self.before - self.nodes(), set())
        self.assertLess(tree.GetNumberOfItems(), items)
        self.assertIsNone(TrackNodes.of_scene())
        shown.remove()  # once more does no harm

    def test_a_second_track_replaces_the_first_and_shows_the_same_frame(self) -> None:
        first = self.show()
        first.go_to(6)
        count, names = len(self.nodes()), {node.GetName() for node in self.made()}
        second = self.show(replaced=first)
        self.assertEqual(second.frame, 6)
        self.assertEqual(len(self.nodes()), count)
        self.assertEqual({node.GetName() for node in self.made()}, names)
        self.assertIs(TrackNodes.of_scene(), second)

    def test_what_does_not_fit_is_refused_and_changes_nothing(self) -> None:
        first = self.show()
        self.before = self.nodes()
        fields = self.inputs().__dict__
        flat = slicer.util.addVolumeFromArray(np.zeros((1, 8, 8), np.float32), name="small")
        self.before.update(self.nodes())
        wrong: Sequence[tuple[dict, str]] = (
            ({"structures": {"pelvis": fields["structures"]["pelvis"]}}, "femur"),
            ({"images": {"left": flat}}, "8 x 8"),
            ({"images": {"left": self.segmentation}}, "Bones"),
            ({"images": {"left": slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", "none")}}, "none"),
        )
        self.before.update(self.nodes())
        for change, told in wrong:
            with self.assertRaisesRegex(InputError, told):
                show_track(self.saved, case.TrackInputs(**{**fields, **change}), first)
        (self.saved / "joints.json").write_text("{")
        with self.assertRaisesRegex(InputError, "joints.json"):
            show_track(self.saved, self.inputs(), first)
        (self.saved / "track.json").unlink()
        with self.assertRaises(InputError):
            show_track(self.saved, self.inputs(), first)
        self.assertEqual(self.nodes(), self.before)
        first.go_to(9)
        self.assertEqual(first.frame, 9)

    def test_bones_that_lie_elsewhere_than_when_they_were_tracked_are_refused(self) -> None:
        transform = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode")
        matrix = np.eye(4)
        matrix[:3, 3] = (0, 0, 60)
        transform.SetMatrixTransformToParent(case.scenes.to_vtk(matrix))
        self.segmentation.SetAndObserveTransformNodeID(transform.GetID())
        with self.assertRaisesRegex(InputError, "'pelvis' are not where they were"):
            self.show()

    def test_closing_the_scene_leaves_no_observer(self) -> None:
        shown = show_track(self.saved, self.inputs())
        browser, known = shown.browser, weakref.ref(shown)
        del shown
        gc.collect()
        self.assertIsNotNone(known())  # it follows the browser although nobody holds it
        slicer.mrmlScene.Clear(0)
        gc.collect()
        self.assertIsNone(known())
        browser.Modified()
        self.assertIsNone(TrackNodes.of_scene())

    def test_parts_that_a_person_deletes_leave_the_others_at_work(self) -> None:
        shown = self.show()
        for node in (
            shown.models["femur"],
            shown.charts[0],
            shown.images.volumes["left"],
            shown.transforms["pelvis"],
            self.ct,
            self.segmentation,
            self.xrays["left"],
        ):
            slicer.mrmlScene.RemoveNode(node)
        shown.go_to(8)
        self.assertEqual(shown.frame, 8)
        self.assertEqual(list(shown.models), ["pelvis"])
        slicer.mrmlScene.RemoveNode(shown.browser)
        self.assertEqual(shown._observed, [])
        self.assertIsNone(TrackNodes.of_scene())

    def test_what_is_recorded_besides_does_no_harm(self) -> None:
        """A person may record more items; they belong to the frame before them."""
        shown = self.show()
        for sequence in shown.sequences.values():
            shown.browser.SetRecording(sequence, True)
        shown.browser.SaveProxyNodesState()
        self.assertEqual(shown.browser.GetNumberOfItems(), case.FRAMES + 1)
        self.assertEqual(shown.frame, 10)
        shown.browser.SetSelectedItemNumber(2)
        self.assertEqual(shown.frame, 5)


class SavedTrackTest(case.TrackCase):
    def test_a_saved_scene_has_its_track_again(self) -> None:
        shown = self.show()
        shown.go_to(6)
        shown.start_correcting("femur")
        moved = matrix_of(shown.transforms["femur"]) @ case.scenes.rotation((0, 0, 1), 5.0)
        shown.transforms["femur"].SetMatrixTransformToParent(case.scenes.to_vtk(moved))
        kept = shown.pose_at_current("femur")
        shown.stop_correcting(keep=True)
        path = self.folder / "scene.mrb"
        self.assertTrue(slicer.mrmlScene.WriteToMRB(str(path)))
        for _time in range(2):  # a loaded scene can be saved and loaded again
            slicer.mrmlScene.Clear(0)
            self.assertTrue(slicer.mrmlScene.ReadFromMRB(str(path)))
            self.take_complaints_about_slices()
            found = TrackNodes.of_scene()
            self.addCleanup(found.release)
            self.assertIs(TrackNodes.of_scene(), found)
            self.check(found, kept)
            self.assertTrue(slicer.mrmlScene.WriteToMRB(str(path)))
        before = {node.GetID() for node in slicer.util.getNodesByClass("vtkMRMLSequenceNode")}
        found.remove()
        left = {node.GetID() for node in slicer.util.getNodesByClass("vtkMRMLSequenceNode")}
        self.assertEqual(len(before - left), 4)
        self.assertEqual(len(slicer.util.getNodesByClass("vtkMRMLPlotChartNode")), 0)
        self.assertEqual(len(slicer.util.getNodesByClass("vtkMRMLTextNode")), 0)

    def take_complaints_about_slices(self) -> None:
        """Slicer itself complains about every oblique slice view of a scene that it reads."""
        self.assertEqual([each for each in self._take_errors() if "preset name: Reformat" not in each], [])

    def check(self, found: TrackNodes, kept: np.ndarray) -> None:
        """Poses to the last digit, although Slicer's file of a sequence holds six; X-rays, plots and names."""
        self.assertEqual(found.names, case.NAMES)
        self.assertEqual(found.browser.GetNumberOfSynchronizedSequenceNodes(True), 4)
        for frame in (4, 9):
            found.go_to(frame)
            self.assertEqual(found.poses_changed(), {})
            self.assertEqual(
                matrix_of(found.transforms["femur"]).tolist(), found.record.to_patient[frame - 3, 1].tolist()
            )
            self.assertEqual(value_of(found.images.volumes["right"]), frame + 4)
        found.go_to(6)
        self.assertEqual(found.corrected_frames("femur"), [6])
        np.testing.assert_allclose(found.poses_changed()["femur"], kept, atol=1e-12)
        self.assertEqual(found.browser.GetMasterSequenceNode().GetIndexName(), "frame")
        self.assertEqual(len(found.charts), 2)
        self.assertNotEqual(found.folder, 0)
        self.assertEqual(set(found.models), set(case.NAMES))

    def test_a_scene_whose_xrays_are_gone_has_its_bones(self) -> None:
        """As where the file of a sequence was moved elsewhere: Slicer opens the scene with an empty one."""
        shown = self.show()
        shown.release()
        for number, camera in enumerate(case.OFFSETS):
            slicer.mrmlScene.RemoveNode(shown.images.volumes[camera])
            slicer.mrmlScene.RemoveNode(shown.parts.get("frames", number))
        self.xrays["left"].RemoveAllDataNodes()
        found = TrackNodes.of_scene()
        self.addCleanup(found.release)
        self.assertEqual(list(found.images.volumes), ["right"])
        found.go_to(8)
        np.testing.assert_allclose(found.pose_at_current("femur"), case.pose(1, 8), atol=1e-9)

    def test_a_damaged_track_says_so(self) -> None:
        shown = self.show()
        shown.release()
        for text in ("{", "[]", "{}", '{"first": 3, "mirrored": {}, "detectors": {}}'):
            shown.browser.SetAttribute("PolyPose.Track", text)
            with self.assertRaisesRegex(InputError, "The track 'Track' of the scene is damaged"):
                TrackNodes.of_scene()
        shown.settings.store(shown.browser)
        for text in ("{", "[]", '{"a": 1}', '{"3": [1]}'):
            shown.sequences["femur"].SetAttribute("PolyPose.Kept", text)
            with self.assertRaisesRegex(InputError, "The track 'femur poses' of the scene is damaged"):
                TrackNodes.of_scene()

    def test_xrays_are_not_written_twice(self) -> None:
        self.show()
        alone = self.folder / "scene.mrb"
        slicer.mrmlScene.WriteToMRB(str(alone))
        written = [name for name in zipfile.ZipFile(alone).namelist() if name.endswith(".nrrd")]
        self.assertTrue(any("XA left" in name for name in written))
        self.assertEqual([name for name in written if "left frames" in name or "left X-ray" in name], [])


if __name__ == "__main__":
    unittest.main()
