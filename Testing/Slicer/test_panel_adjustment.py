"""A bone moved by hand: its outline follows, the study starts from there, and a real registration ends at the truth."""

from __future__ import annotations

import json
import unittest
from pathlib import Path

import numpy as np
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer import self_test
from PolyPoseSlicer.calls import start_refinement
from PolyPoseSlicer.scene import layouts
from PolyPoseSlicer.scene.frames import flip_map, from_vtk, to_vtk
from PolyPoseSlicer.scene.motions import motions_of
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.refinement import with_found_cameras

from PolyPoseLib.errors import InputError

KEEP_STUDY = """
import shutil
shutil.copy(next(each for each in arguments if each.endswith("STUDY.json")), {kept!r})
"""


def motion(degrees: float, shift: tuple[float, float, float]) -> np.ndarray:
    """A rigid motion (4, 4)."""
    out = scenes.rotation((1, 2, 3), degrees)
    out[:3, 3] = shift
    return out


class AdjustmentTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.node = self.panel.parameters
        self.nodes_before = slicer.mrmlScene.GetNumberOfNodes()
        self.kept = self.folder / "STUDY.json"
        self.give_result(KEEP_STUDY.format(kept=str(self.kept)))
        self.register()

    def register(self) -> dict:
        self.ui.registerButton.click()
        self.end()
        return json.loads(Path(self.kept).read_text())

    def end(self) -> None:
        self.wait(lambda: not self.panel.register.running)

    def move(self, matrix: np.ndarray) -> None:
        """As the handles do; matrix: LPS mm."""
        handles = self.panel.adjustment._handles[self.ui.adjustBone.currentText]
        handles.transform.SetMatrixTransformToParent(to_vtk(flip_map(matrix)))

    def outlines(self) -> list[np.ndarray]:
        models = slicer.util.getNodesByClass("vtkMRMLModelNode")
        found = [each for each in models if each.GetName().startswith("Outline of")]
        return [slicer.util.arrayFromModelPoints(each).copy() for each in found]

    def test_the_anchor_stays_and_the_others_may_be_moved(self) -> None:
        names = [self.ui.adjustBone.itemText(n) for n in range(self.ui.adjustBone.count)]
        self.assertEqual(names, ["femur"])
        self.assertTrue(self.ui.adjustToggle.enabled)

    def test_outlines_on_every_xray_follow_the_handles(self) -> None:
        self.ui.adjustToggle.checked = True
        self.assertTrue(self.ui.showAfter.checked)
        before = self.outlines()
        self.assertEqual(len(before), 2)
        self.move(motion(0.0, (0.0, 0.0, 5.0)))
        for old, new in zip(before, self.outlines(), strict=True):
            self.assertGreater(len(new), 10)
            # Both cameras are frontal: 5 mm up is 5 mm times the magnification on the detector.
            self.assertGreater(new[:, 2].max() - old[:, 2].max(), 5.0)
        handles = self.panel.adjustment._handles["femur"].transform.GetDisplayNode()
        self.assertTrue(handles.GetEditorVisibility())
        self.assertFalse(handles.GetEditorScalingEnabled(), "a bone was offered to be scaled")

    def test_slices_and_3d_show_the_bone_that_is_to_be_moved(self) -> None:
        self.ui.adjustToggle.checked = True
        bounds = [0.0] * 6
        self.panel.adjustment._handles["femur"].model.GetRASBounds(bounds)
        centre = np.array(bounds).reshape(3, 2).mean(axis=1)
        for composite in layouts.anatomy_views():
            logic = slicer.app.applicationLogic().GetSliceLogicByLayoutName(composite.GetLayoutName())
            if logic is None:
                continue
            matrix = from_vtk(logic.GetSliceNode().GetSliceToRAS())
            self.assertLess(abs((centre - matrix[:3, 3]) @ matrix[:3, 2]), 2.0)
        cameras = slicer.util.getNodesByClass("vtkMRMLCameraNode")
        camera = next(each for each in cameras if each.GetLayoutName() == layouts.THREE_D_VIEW)
        np.testing.assert_allclose(camera.GetFocalPoint(), centre, atol=1e-6)

    def test_hidden_handles_leave_nothing_in_the_views_and_forget_nothing(self) -> None:
        self.ui.adjustToggle.checked = True
        wanted = motion(4.0, (1.0, 2.0, 3.0))
        self.move(wanted)
        self.ui.adjustToggle.checked = False
        self.assertEqual(self.outlines(), [])
        np.testing.assert_allclose(self.panel.adjustment.adjustments["femur"], wanted, atol=1e-9)
        self.ui.adjustReset.click()
        self.assertEqual(self.panel.adjustment.adjustments, {})

    def test_the_study_starts_where_the_bone_was_put_with_the_cameras_that_were_found(self) -> None:
        first = json.loads(Path(self.kept).read_text())
        self.assertNotIn("initial_poses", first)
        found = motions_of(self.node.outputMotions)["femur"].matrix
        moved = motion(6.0, (3.0, -2.0, 1.0))
        self.ui.adjustToggle.checked = True
        self.move(moved)
        self.ui.refineButton.click()
        self.assertTrue(self.panel.register.running)
        self.assertFalse(self.ui.refineButton.enabled)
        self.end()
        study = json.loads(Path(self.kept).read_text())
        self.assertEqual(list(study["initial_poses"]), ["femur"])
        pose = np.array(study["initial_poses"]["femur"])
        point = np.array([20.0, -10.0, 5.0, 1.0])
        np.testing.assert_allclose(np.linalg.inv(pose) @ point, moved @ found @ point, atol=1e-9)
        result = scenes.result()
        for entry, camera in zip(study["xrays"], result.cameras, strict=True):
            np.testing.assert_allclose(entry["extrinsic"], camera.extrinsic, atol=1e-9)
            self.assertEqual(entry["camera"], "initial")
        # The hand's place belongs to the result that was; it is forgotten with it, and Undo brings that back.
        self.assertEqual(self.panel.adjustment.adjustments, {})
        self.assertTrue(self.ui.undoButton.enabled)

    def test_cameras_of_other_xrays_are_not_taken(self) -> None:
        sources = parameters.xray_sources(self.node)
        outputs = parameters.outputs_of(self.node)
        self.assertEqual(
            [each.camera_transform for each in with_found_cameras(sources, outputs)], outputs.cameras
        )
        exchanged = with_found_cameras(sources[::-1], outputs)
        self.assertEqual([each.camera_transform for each in exchanged], [None, None])

    def test_a_camera_that_is_known_stays(self) -> None:
        sources = parameters.xray_sources(self.node)
        known = [
            parameters.XraySource(each.image, fields={**each.fields, "camera": "known"}) for each in sources
        ]
        kept = with_found_cameras(known, parameters.outputs_of(self.node))
        self.assertEqual([each.fields for each in kept], [each.fields for each in known])

    def test_a_handle_that_a_person_deletes_is_made_again(self) -> None:
        self.ui.adjustToggle.checked = True
        slicer.mrmlScene.RemoveNode(self.panel.adjustment._handles["femur"].transform)
        self.assertEqual(self.panel.adjustment.adjustments, {})
        self.ui.adjustToggle.checked = False
        self.ui.adjustToggle.checked = True
        self.assertTrue(self.panel.adjustment._handles["femur"].present)

    def test_nothing_is_left_when_the_result_goes(self) -> None:
        self.ui.adjustToggle.checked = True
        self.move(motion(4.0, (1.0, 2.0, 3.0)))
        self.ui.undoButton.click()
        self.assertFalse(self.ui.adjustToggle.checked)
        self.assertFalse(self.ui.adjustToggle.enabled)
        names = [each.GetName() for each in slicer.util.getNodesByClass("vtkMRMLNode")]
        self.assertFalse([name for name in names if "femur" in name and "adjust" in name.lower()], names)

    def test_without_a_result_one_sentence_says_what_to_do(self) -> None:
        self.ui.undoButton.click()
        with self.assertRaisesRegex(InputError, "register first"):
            start_refinement(self.node, {})


class RealRefinementTest(PanelCase):
    LONG = True

    def test_a_bone_moved_by_hand_is_brought_back_by_a_real_registration(self) -> None:
        phantom = self_test.make_phantom()
        self.ui.ctSelector.setCurrentNode(phantom.ct)
        self.ui.segmentationSelector.setCurrentNode(phantom.segmentation)
        node = self.panel.parameters
        node.structures = json.dumps({"fixed": "fixed", "mobile": "mobile"})
        node.anchor = "fixed"
        node.preset = parameters.Preset.FAST
        parameters.store_xray_sources(node, phantom.xrays)
        self.ui.registerButton.click()
        self.wait(lambda: not self.panel.register.running, 300.0)
        first = motions_of(node.outputMotions)["mobile"]
        self.assertIsNotNone(node.outputTransform, self.ui.messageLabel.text)
        self.ui.adjustToggle.checked = True
        handles = self.panel.adjustment._handles["mobile"]
        handles.transform.SetMatrixTransformToParent(to_vtk(flip_map(motion(0.0, (3.0, 2.0, -3.0)))))
        self.ui.refineButton.click()
        self.wait(lambda: not self.panel.register.running, 300.0)
        again = motions_of(node.outputMotions)["mobile"]
        centroid = np.r_[first.centroid, 1.0]
        for found in (first, again):
            miss = np.linalg.norm(((found.matrix - phantom.motion) @ centroid)[:3])
            self.assertLess(miss, self_test.ALLOWED_MM)
        self.assertFalse(np.allclose(first.matrix, again.matrix), "it was not fitted again")


if __name__ == "__main__":
    unittest.main()
