"""Carry along: markups, models, segmentations and volumes follow Before and After, and are put back."""

from __future__ import annotations

import unittest
from typing import Any

import numpy as np
import scenes
import slicer
import vtk
from panel_case import PanelCase
from PolyPoseSlicer.scene.carried_points import defined_points
from PolyPoseSlicer.scene.frames import flip_vectors
from vtkmodules.util.numpy_support import vtk_to_numpy

# isort: split
import qt

FEMUR_VOXELS = ((18, 10, 8), (20, 14, 11), (19, 12, 9))
"""(i, j, k) within the block that scenes.labels calls femur."""

SOFT_VOXELS = ((13, 11, 10), (14, 4, 12))


def world(voxels: Any) -> np.ndarray:
    """(N, 3) LPS mm of voxels (i, j, k) of the CT."""
    matrix = scenes.affine()
    return np.array(voxels, float) @ matrix[:3, :3].T + matrix[:3, 3]


def add_points(points: np.ndarray, kind: str = "vtkMRMLMarkupsFiducialNode", name: str = "plan") -> Any:
    """Markups at points (N, 3) LPS mm."""
    node = slicer.mrmlScene.AddNewNodeByClass(kind, name)
    node.CreateDefaultDisplayNodes()
    for number, point in enumerate(flip_vectors(points).tolist()):
        node.AddControlPoint(vtk.vtkVector3d(point), f"target {number}")
    return node


def add_model(name: str = "implant") -> Any:
    """A ball as a model."""
    ball = vtk.vtkSphereSource()
    ball.Update()
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", name)
    node.SetAndObservePolyData(ball.GetOutput())
    node.CreateDefaultDisplayNodes()
    return node


class CarryCase(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.node = self.panel.parameters
        self.carry = self.panel.review.carry

    def load(self, **changes: Any) -> None:
        """A result, shown before."""
        folder = self.folder / f"given{len(list(self.folder.iterdir()))}"
        self.panel.review.load_result(str(scenes.save_result(folder, **changes)))
        self.ui.showBefore.checked = True
        self.panel.review.set_after(False)

    def rows(self) -> dict[str, Any]:
        """{name: item} of the list."""
        slicer.app.processEvents()
        items = [self.ui.carryList.item(row) for row in range(self.ui.carryList.count)]
        return {item.text(): item for item in items}

    def pick(self, *nodes: Any, on: bool = True) -> None:
        for node in nodes:
            self.rows()[node.GetName()].setCheckState(qt.Qt.Checked if on else qt.Qt.Unchecked)

    def after(self, on: bool = True) -> None:
        (self.ui.showAfter if on else self.ui.showBefore).checked = True
        self.wait(lambda: not self.carry.busy)

    def shown_points(self, source: Any) -> np.ndarray:
        """(N, 3) LPS mm of the copy that is shown."""
        return defined_points(self.carry.markups.copy_of(source))


class ListTest(CarryCase):
    def test_it_lists_what_is_the_users_and_nothing_of_the_module(self) -> None:
        points, model = add_points(world(SOFT_VOXELS)), add_model()
        other = scenes.add_ct(name="dose")
        self.load()
        self.assertEqual(set(self.rows()), {points.GetName(), model.GetName(), other.GetName()})
        self.assertTrue(all(item.checkState() == qt.Qt.Unchecked for item in self.rows().values()))
        late = add_model("later")
        self.wait(lambda: late.GetName() in self.rows())
        slicer.mrmlScene.RemoveNode(late)
        self.wait(lambda: "later" not in self.rows())

    def test_it_says_what_is_missing(self) -> None:
        slicer.app.processEvents()
        self.assertIn("Nothing to carry", self.ui.carryState.text)
        self.assertIn("No result yet", self.ui.exportDicom.toolTip)
        self.assertFalse(self.ui.exportDicom.enabled)
        add_model()
        slicer.app.processEvents()
        self.assertIn("No result yet", self.ui.carryState.text)
        self.load()
        self.assertIn("Check what", self.ui.carryState.text)
        self.assertTrue(self.ui.exportDicom.enabled)
        self.node.segmentation = None
        slicer.app.processEvents()
        self.assertIn("segmentation", self.ui.exportDicom.toolTip)
        self.assertFalse(self.ui.exportDicom.enabled)

    def test_picks_outlive_another_module(self) -> None:
        model = add_model()
        self.pick(model)
        self.leave()
        self.open()
        self.assertEqual(self.rows()["implant"].checkState(), qt.Qt.Checked)


class NodesTest(CarryCase):
    def setUp(self) -> None:
        super().setUp()
        self.model, self.dose = add_model(), scenes.add_ct(name="dose")
        self.plan = scenes.add_segmentation(self.ct)
        self.plan.SetName("organs")
        self.nodes = (self.model, self.dose, self.plan)
        self.load()

    def parents(self) -> list[Any]:
        return [each.GetParentTransformNode() for each in self.nodes]

    @staticmethod
    def is_bone(node: Any) -> bool:
        """Whether a transform is one of the bones' in 3D."""
        return node.GetName().startswith("Motion of ")

    def test_models_segmentations_and_volumes_follow_after_and_before(self) -> None:
        self.pick(*self.nodes)
        self.assertEqual(self.parents(), [None] * 3)
        for _turn in range(2):
            self.after()
            self.assertEqual(self.parents(), [self.node.outputTransform] * 3)
            self.after(False)
            self.assertEqual(self.parents(), [None] * 3)
        self.assertIsNone(self.ct.GetParentTransformNode())

    def test_picked_while_after_is_shown_and_unpicked(self) -> None:
        self.after()
        self.pick(self.model)
        self.assertIs(self.model.GetParentTransformNode(), self.node.outputTransform)
        self.assertIsNone(self.dose.GetParentTransformNode())
        self.pick(self.model, on=False)
        self.assertIsNone(self.model.GetParentTransformNode())

    def test_a_transform_of_its_own_is_kept_and_comes_first(self) -> None:
        matrix = scenes.rotation((1, 2, 3), 20.0)
        matrix[:3, 3] = (5.0, -7.0, 3.0)
        own = scenes.add_transform(matrix)
        self.model.SetAndObserveTransformNodeID(own.GetID())
        before = slicer.util.getNodesByClass("vtkMRMLTransformNode")
        self.pick(self.model)
        self.after()
        moved = vtk.vtkGeneralTransform()
        self.model.GetParentTransformNode().GetTransformToWorld(moved)
        alone = vtk.vtkGeneralTransform()
        self.node.outputTransform.GetTransformToWorld(alone)
        for point in np.random.default_rng(3).uniform(-15, 15, (20, 3)):
            placed = matrix[:3, :3] @ point + matrix[:3, 3]
            np.testing.assert_allclose(moved.TransformPoint(point), alone.TransformPoint(placed), atol=1e-3)
        self.after(False)
        self.assertIs(self.model.GetParentTransformNode(), own)
        own_matrix = slicer.util.arrayFromTransformMatrix(own)
        np.testing.assert_array_equal(own_matrix, matrix)
        after = [
            each for each in slicer.util.getNodesByClass("vtkMRMLTransformNode") if not self.is_bone(each)
        ]
        self.assertEqual(after, before)

    def test_where_somebody_has_put_it_meanwhile_it_stays(self) -> None:
        self.pick(self.model)
        self.after()
        own = scenes.add_transform(np.eye(4))
        self.model.SetAndObserveTransformNodeID(own.GetID())
        self.after(False)
        self.assertIs(self.model.GetParentTransformNode(), own)

    def test_without_the_result_everything_is_back(self) -> None:
        own = scenes.add_transform(np.eye(4))
        self.model.SetAndObserveTransformNodeID(own.GetID())
        self.pick(*self.nodes)
        self.after()
        slicer.mrmlScene.RemoveNode(self.node.outputTransform)
        self.wait(lambda: self.node.outputTransform is None)
        slicer.app.processEvents()
        self.assertEqual(self.parents(), [own, None, None])

    def test_undo_puts_everything_back_and_redo_carries_again(self) -> None:
        self.pick(*self.nodes)
        self.after()
        self.ui.undoButton.click()
        self.assertIsNone(self.node.outputTransform)
        self.assertEqual(self.parents(), [None] * 3)
        self.ui.undoButton.click()
        self.wait(lambda: not self.carry.busy)
        self.assertEqual(self.parents(), [self.node.outputTransform] * 3)

    def test_an_unloaded_panel_leaves_nothing_moved(self) -> None:
        points = add_points(world(FEMUR_VOXELS))
        self.pick(*self.nodes, points)
        self.after()
        self.renew()
        self.assertEqual(self.parents(), [None] * 3)
        self.assertTrue(points.GetDisplayNode().GetVisibility())
        names = [each.GetName() for each in slicer.util.getNodesByClass("vtkMRMLMarkupsNode")]
        self.assertEqual(names, ["plan"])

    def test_a_scene_saved_with_after_opens_with_everything_back(self) -> None:
        points = add_points(world(FEMUR_VOXELS))
        self.pick(*self.nodes, points)
        self.after()
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.mrmlScene.WriteToMRB(path))
        slicer.mrmlScene.Clear()
        self.assertTrue(slicer.mrmlScene.ReadFromMRB(path))
        self.open()
        slicer.app.processEvents()
        read = slicer.util.getNode("implant")
        self.ui.showBefore.checked = True
        self.panel.review.set_after(False)
        self.assertIsNone(read.GetParentTransformNode())
        self.assertTrue(slicer.util.getNode("plan").GetDisplayNode().GetVisibility())
        self.assertEqual(self.rows()["implant"].checkState(), qt.Qt.Checked)

    def test_everything_follows_a_registration_while_it_runs(self) -> None:
        points = add_points(world(FEMUR_VOXELS))
        self.pick(self.model, points)
        folder = scenes.save_result(self.folder / "live")
        self.child(
            f"import shutil\nshutil.copyfile('{folder}/transform.h5', preview)\n"
            "tell(1, preview=preview)\nwhile True:\n    time.sleep(0.05)\n"
        )
        self.ui.registerButton.click()
        self.wait(lambda: self.model.GetParentTransformNode() is not None)
        self.assertIs(points.GetParentTransformNode(), self.node.outputTransform)
        self.ui.registerButton.click()
        self.wait(lambda: not self.panel.register.running)
        self.assertIsNone(self.model.GetParentTransformNode())
        self.assertIsNone(points.GetParentTransformNode())

    def test_a_registration_that_starts_from_after_carries_the_markups_by_its_transform(self) -> None:
        points = add_points(world(FEMUR_VOXELS))
        self.pick(self.model, points)
        self.after()
        self.assertIsNotNone(self.carry.markups.copy_of(points))
        self.child("tell(1)\nwhile True:\n    time.sleep(0.05)\n")
        self.ui.registerButton.click()
        self.wait(lambda: "1 of 10" in self.ui.stageLabel.text)
        self.assertIsNone(self.carry.markups.copy_of(points))
        for node in (self.model, points):
            self.assertIs(node.GetParentTransformNode(), self.node.outputTransform)
        self.assertTrue(points.GetDisplayNode().GetVisibility())
        self.ui.registerButton.click()
        self.wait(lambda: not self.panel.register.running and not self.carry.busy)
        self.assertIsNotNone(self.carry.markups.copy_of(points))
        self.assertIsNone(points.GetParentTransformNode())
        self.assertIs(self.model.GetParentTransformNode(), self.node.outputTransform)
        self.after(False)
        self.assertIsNone(self.model.GetParentTransformNode())

    def test_what_becomes_the_ct_is_carried_no_more(self) -> None:
        self.pick(self.dose)
        self.ui.ctSelector.setCurrentNode(self.dose)
        self.after()
        self.assertIsNone(self.dose.GetParentTransformNode())
        self.assertNotIn("dose", self.rows())


class PointsTest(CarryCase):
    def setUp(self) -> None:
        super().setUp()
        self.load()
        pose = scenes.result().structures["femur"].fixed_to_moving
        self.motion = np.linalg.inv(pose)

    def moved(self, points: np.ndarray) -> np.ndarray:
        """By the femur's own motion."""
        return points @ self.motion[:3, :3].T + self.motion[:3, 3]

    def test_points_in_a_bone_take_its_motion_exactly_and_the_markups_stay(self) -> None:
        inside = world(FEMUR_VOXELS)
        source = add_points(inside)
        self.pick(source)
        self.after()
        np.testing.assert_allclose(self.shown_points(source), self.moved(inside), atol=1e-9)
        np.testing.assert_allclose(defined_points(source), inside, atol=1e-9)
        copy = self.carry.markups.copy_of(source)
        self.assertEqual(copy.GetNthControlPointLabel(1), "target 1")
        self.assertEqual(copy.GetNthControlPointDescription(1), "femur")
        self.assertFalse(source.GetDisplayNode().GetVisibility())
        self.assertTrue(copy.GetDisplayNode().GetVisibility())
        self.assertFalse(copy.GetSaveWithScene())
        self.assertIn("bone in which they lie: 3", self.ui.carryState.text)
        self.after(False)
        self.assertTrue(source.GetDisplayNode().GetVisibility())
        self.assertIsNone(copy.GetScene())

    def test_points_outside_of_bones_take_the_displacement_field(self) -> None:
        points = world(SOFT_VOXELS)
        source = add_points(points)
        self.pick(source)
        self.after()
        back = scenes.result().transform(self.shown_points(source))
        np.testing.assert_allclose(back, points, atol=0.01)
        self.assertGreater(np.abs(self.shown_points(source) - points).max(), 1)
        self.assertIn("displacement field: 2", self.ui.carryState.text)

    def test_a_screw_that_a_bone_holds_keeps_its_length(self) -> None:
        ends = world([(18, 10, 9), (23, 12, 9)])  # the second end is outside
        source = add_points(ends, "vtkMRMLMarkupsLineNode", "screw")
        self.pick(source)
        self.after()
        np.testing.assert_allclose(self.shown_points(source), self.moved(ends), atol=1e-9)

    def test_a_markup_under_a_transform_counts_where_it_is_shown(self) -> None:
        inside = world(FEMUR_VOXELS)
        shift = np.eye(4)
        shift[:3, 3] = (-4.0, 6.0, 8.0)
        source = add_points(inside - flip_vectors(shift[:3, 3]))
        source.SetAndObserveTransformNodeID(scenes.add_transform(shift).GetID())
        self.pick(source)
        self.after()
        np.testing.assert_allclose(self.shown_points(source), self.moved(inside), atol=1e-6)

    def test_ellipsoids_are_hidden_until_they_are_wanted(self) -> None:
        source = add_points(world(FEMUR_VOXELS))
        self.pick(source)
        self.after()
        model = self.carry.ellipsoids.node
        self.assertFalse(model.GetDisplayNode().GetVisibility())
        self.ui.carryEllipsoids.checked = True
        self.assertTrue(model.GetDisplayNode().GetVisibility())
        vertices = flip_vectors(vtk_to_numpy(model.GetPolyData().GetPoints().GetData()).astype(float))
        count = len(vertices) // len(FEMUR_VOXELS)
        core = scenes.result().structures["femur"]
        self.assertIsNotNone(core.uncertainty)
        for number, centre in enumerate(self.shown_points(source)):
            own = vertices[number * count : (number + 1) * count]
            np.testing.assert_allclose((own.min(axis=0) + own.max(axis=0)) / 2, centre, atol=0.3)
            self.assertGreater(np.ptp(own, axis=0).min(), 2 * 2.7)  # of a variance of 1 mm^2 at least
        self.after(False)
        self.assertIsNone(model.GetScene())
        self.assertIsNone(model.GetDisplayNode())

    def test_points_of_the_anchor_do_not_move(self) -> None:
        inside = world([(7, 10, 9), (8, 12, 12)])
        source = add_points(inside)
        self.pick(source)
        self.after()
        np.testing.assert_allclose(self.shown_points(source), inside, atol=1e-9)

    def test_edited_markups_are_carried_anew(self) -> None:
        source = add_points(world(FEMUR_VOXELS))
        self.pick(source)
        self.after()
        self.after(False)
        source.AddControlPoint(vtk.vtkVector3d(flip_vectors(world([(20, 10, 10)]))[0]), "new")
        self.after()
        self.assertEqual(len(self.shown_points(source)), 4)
        np.testing.assert_allclose(
            self.shown_points(source)[3:], self.moved(world([(20, 10, 10)])), atol=1e-9
        )

    def test_without_bones_points_follow_the_field_and_it_says_so(self) -> None:
        self.node.segmentation = None
        source = add_points(world(FEMUR_VOXELS))
        self.pick(source)
        self.after()
        back = scenes.result().transform(self.shown_points(source))
        np.testing.assert_allclose(back, world(FEMUR_VOXELS), atol=0.01)
        self.assertIn("displacement field alone", self.ui.carryState.text)


if __name__ == "__main__":
    unittest.main()
