"""Undo and Redo of registrations and of loaded results, and the result as a scene of its own."""

from __future__ import annotations

import unittest
import zipfile

import numpy as np
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer.scene import layouts
from PolyPoseSlicer.scene.motions import motions_of
from PolyPoseSlicer.study.parameters import PolyPoseParameterNode
from PolyPoseSlicer.study.snapshot import Snapshot


def described(parameters: PolyPoseParameterNode) -> dict:
    """All numbers and texts of a result."""
    if parameters.outputTransform is None:
        return {}
    grid = parameters.outputTransform.GetTransformFromParent().GetDisplacementGrid()
    content = parameters.outputSegmentation.GetSegmentation()
    segment = content.GetNthSegment(0)
    label = slicer.util.arrayFromSegmentBinaryLabelmap(
        parameters.outputSegmentation, content.GetSegmentIDs()[0]
    )
    return {
        "grid": grid.GetPointData().GetScalars().GetTuple(70),
        "ct": slicer.util.arrayFromVolume(parameters.outputVolume).tobytes(),
        "segments": [content.GetSegment(each).GetName() for each in content.GetSegmentIDs()],
        "colour": segment.GetColor(),
        "label": label.tobytes(),
        "motions": {
            name: each.matrix.tolist() for name, each in motions_of(parameters.outputMotions).items()
        },
        "rows": parameters.outputMotions.GetTable().GetNumberOfRows(),
        "curve": parameters.outputSimilarity.GetTable().GetNumberOfRows(),
        "cameras": [each.GetAttribute("PolyPose.Camera") for each in parameters.outputCameras],
        "renderings": [slicer.util.arrayFromVolume(each).tobytes() for each in parameters.outputRenderings],
        "xrays": len(parameters.outputXrays),
        "messages": parameters.outputMessages,
    }


class UndoTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.node = self.panel.parameters

    def register(self, **changes) -> dict:
        self.give_result(**changes)
        self.ui.registerButton.click()
        self.wait(lambda: not self.panel.register.running)
        return described(self.node)

    def test_undo_and_redo_of_the_first_result(self) -> None:
        self.assertFalse(self.ui.undoButton.enabled)
        count = slicer.mrmlScene.GetNumberOfNodes()
        first = self.register()
        self.assertTrue(self.ui.undoButton.enabled)
        for _turn in range(2):
            self.assertEqual(self.ui.undoButton.text, "Undo")
            self.ui.undoButton.click()
            self.assertIsNone(self.node.outputTransform)
            self.assertEqual(described(self.node), {})
            self.assertIsNone(self.ct.GetParentTransformNode())
            self.assertIn("No result yet", self.ui.reviewState.text)
            names = [each.GetName() for each in slicer.util.getNodesByClass("vtkMRMLDisplayableNode")]
            self.assertFalse([name for name in names if name.startswith("PolyPose ")], names)
            self.assertEqual(self.ui.undoButton.text, "Redo")
            self.ui.undoButton.click()
            self.assertEqual(described(self.node), first)
            self.assertTrue(self.ui.showAfter.checked)
        self.assertGreater(slicer.mrmlScene.GetNumberOfNodes(), count)

    def test_undo_of_a_second_result_brings_the_first_one_back_in_its_own_nodes(self) -> None:
        first = self.register()
        volume = self.node.outputVolume
        warped = scenes.labels()[:, :, ::-1].copy()
        second = self.register(warped=warped, distrust=("nothing fits",))
        self.assertNotEqual(first["label"], second["label"])
        self.assertIn("DO NOT TRUST", self.ui.verdictLabel.text)
        self.ui.undoButton.click()
        self.assertEqual(described(self.node), first)
        self.assertIs(self.node.outputVolume, volume)
        self.assertNotIn("DO NOT TRUST", self.ui.verdictLabel.text)
        self.ui.undoButton.click()
        self.assertEqual(described(self.node), second)

    def test_a_loaded_result_is_undone_as_well(self) -> None:
        first = self.register()
        folder = scenes.save_result(self.folder / "other", distrust=("it is another",))
        self.panel.review.load_result(str(folder))
        self.assertNotEqual(described(self.node), first)
        self.ui.undoButton.click()
        self.assertEqual(described(self.node), first)

    def test_nodes_that_were_deleted_meanwhile_are_made_again(self) -> None:
        first = self.register()
        self.register(distrust=("nothing fits",))
        for node in (self.node.outputVolume, self.node.outputMotions, self.node.outputCameras[1]):
            slicer.mrmlScene.RemoveNode(node)
        self.wait(lambda: self.node.outputVolume is None)
        self.ui.undoButton.click()
        self.assertEqual(described(self.node), first)

    def test_a_cancelled_run_leaves_what_undo_brings_back(self) -> None:
        first = self.register()
        second = self.register(distrust=("nothing fits",))
        self.child("tell(1)\nwhile True:\n    time.sleep(0.05)\n")
        self.ui.registerButton.click()
        self.assertFalse(self.ui.undoButton.enabled)
        self.wait(lambda: "1 of 10" in self.ui.stageLabel.text)
        self.ui.registerButton.click()
        self.wait(lambda: not self.panel.register.running)
        self.assertEqual(described(self.node), second)
        self.ui.undoButton.click()
        self.assertEqual(described(self.node), first)

    def test_a_closed_scene_has_nothing_to_undo(self) -> None:
        self.register()
        slicer.mrmlScene.Clear()
        self.assertFalse(self.ui.undoButton.enabled)

    def test_maps_of_a_result_that_is_undone_go_with_it(self) -> None:
        self.register()
        self.ui.showGrid.checked = True
        self.ui.undoButton.click()
        self.assertFalse(self.ui.showGrid.checked)
        for composite in layouts.anatomy_views():
            self.assertIsNone(composite.GetForegroundVolumeID())

    def test_a_snapshot_copies_no_voxels(self) -> None:
        self.register()
        image = self.node.outputVolume.GetImageData()
        held = Snapshot.of(self.node).nodes["outputVolume"]
        assert held is not None
        self.assertIs(held.held[0], image)


class SceneFileTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.panel.review.load_result(str(scenes.save_result(self.folder / "given")))

    def test_the_scene_holds_the_result_and_nothing_else(self) -> None:
        other = slicer.util.addVolumeFromArray(np.zeros((2, 2, 2)), name="someone else")
        path = self.folder / "result.mrb"
        self.panel.saving.save_scene(str(path))
        self.assertEqual(self.ui.reviewState.text.count("cannot"), 0)
        self.assertTrue(other.GetSaveWithScene())
        with zipfile.ZipFile(path) as packed:
            names = " ".join(packed.namelist())
        self.assertNotIn("someone", names)
        slicer.mrmlScene.Clear()
        read = slicer.mrmlScene.ReadFromMRB(str(path))
        self.assertTrue(read)
        names = {each.GetName() for each in slicer.util.getNodesByClass("vtkMRMLStorableNode")}
        for wanted in ("CT", "PolyPose warped CT", "PolyPose transform", "PolyPose motions"):
            self.assertIn(wanted, names)
        self.assertNotIn("someone else", names)
        volume = slicer.util.getNode("PolyPose warped CT")
        np.testing.assert_array_equal(slicer.util.arrayFromVolume(volume), scenes.voxels())

    def test_a_folder_that_is_not_there_gives_one_sentence(self) -> None:
        self.panel.saving.save_scene(str(self.folder / "no" / "where.mrb"))
        self.assertIn("cannot be written", self.ui.reviewState.text)
        self._take_errors()  # VTK tells the same in its own words


if __name__ == "__main__":
    unittest.main()
