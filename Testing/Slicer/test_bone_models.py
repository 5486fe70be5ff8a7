"""Bones in 3D: where they are in either posture, and nothing of them left."""

from __future__ import annotations

import json
import unittest

import numpy as np
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer.scene.frames import flip_vectors
from PolyPoseSlicer.scene.motions import motions_of
from PolyPoseSlicer.study.result_origin import remember_segments


def middle(node: slicer.vtkMRMLModelNode) -> np.ndarray:
    """Middle of a model's box in the world, LPS mm."""
    bounds = [0.0] * 6
    node.GetRASBounds(bounds)
    return flip_vectors(np.array(bounds).reshape(3, 2).mean(axis=1))


class BoneModelsTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.nodes = slicer.mrmlScene.GetNumberOfNodes()
        folder = scenes.save_result(self.folder / "given")
        remember_segments(folder, self.segmentation)
        self.panel.review.load_result(str(folder))
        self.bones = self.panel.review.bones
        self.wait(lambda: not self.bones.busy)

    def models(self) -> dict[str, slicer.vtkMRMLModelNode]:
        found = slicer.util.getNodesByClass("vtkMRMLModelNode")
        return {
            each.GetName().removesuffix(" in 3D"): each for each in found if each.GetName().endswith(" in 3D")
        }

    def test_bones_move_with_before_and_after(self) -> None:
        self.assertEqual(set(self.models()), {"pelvis", "femur"})
        motion = motions_of(self.panel.parameters.outputMotions)["femur"].matrix
        after = middle(self.models()["femur"])
        self.ui.showBefore.checked = True
        before = middle(self.models()["femur"])
        # The box of a turned bone is not the turned box: its middle moves by a little more or less.
        np.testing.assert_allclose(after, (motion @ np.r_[before, 1.0])[:3], atol=2.0)
        self.assertGreater(np.linalg.norm(after - before), 3.0)
        self.assertLess(np.linalg.norm(middle(self.models()["pelvis"]) - self.center(1)), 0.1)
        self.assertLess(np.linalg.norm(before - self.center(2)), 0.1)

    def center(self, label: int) -> np.ndarray:
        """Middle of a bone's voxels, LPS mm."""
        voxels = np.argwhere(scenes.labels() == label)[:, ::-1]
        return (scenes.affine() @ np.r_[(voxels.min(axis=0) + voxels.max(axis=0)) / 2, 1.0])[:3]

    def test_the_box_takes_them_away_and_brings_them_back(self) -> None:
        self.ui.bones3D.checked = False
        self.assertEqual(self.models(), {})
        self.ui.bones3D.checked = True
        self.wait(lambda: not self.bones.busy)
        self.assertEqual(set(self.models()), {"pelvis", "femur"})

    def test_bones_that_a_person_deletes_come_back_with_the_layout(self) -> None:
        slicer.mrmlScene.RemoveNode(self.models()["femur"])
        self.ui.layoutButton.click()
        self.wait(lambda: not self.bones.busy)
        self.assertEqual(set(self.models()), {"pelvis", "femur"})

    def test_a_segmentation_that_goes_takes_its_bones_with_it(self) -> None:
        slicer.mrmlScene.RemoveNode(self.segmentation)
        self.wait(lambda: self.models() == {})
        self.ui.layoutButton.click()
        slicer.app.processEvents()
        self.assertEqual(self.models(), {})

    def test_other_structures_have_other_bones(self) -> None:
        identifier = self.segmentation.GetSegmentation().GetSegmentIdBySegmentName("pelvis")
        self.panel.parameters.structures = json.dumps({identifier: "pelvis"})
        self.wait(lambda: not self.bones.busy and set(self.models()) == {"pelvis"})
        self.assertEqual(self.bones._models.names, ["pelvis"])

    def test_they_are_neither_saved_nor_listed(self) -> None:
        for model in self.models().values():
            self.assertFalse(model.GetSaveWithScene())
            self.assertTrue(model.GetHideFromEditors())
            self.assertFalse(model.GetDisplayNode().GetVisibility2D())
            self.assertFalse(model.GetParentTransformNode().GetSaveWithScene())


if __name__ == "__main__":
    unittest.main()
