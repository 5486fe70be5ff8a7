"""The logic from nodes to nodes, on the real scene, with real child processes."""

from __future__ import annotations

import json
import os
import unittest
from pathlib import Path
from unittest import mock

import children
import numpy as np
import scenes
import slicer
import vtk
from PolyPoseSlicer.process import registration
from PolyPoseSlicer.process.registration import State
from PolyPoseSlicer.scene import frames
from PolyPoseSlicer.scene.cameras import camera_of, similarity_of
from PolyPoseSlicer.scene.motions import motions_of
from PolyPoseSlicer.study.results import OutputNodes
from registration_case import GIVE_RESULT, RegistrationCase

from PolyPoseLib.errors import CancelledError, UntrustedResultError


class OutputTest(RegistrationCase):
    def test_nodes_in_nodes_out(self) -> None:
        nodes = self.start_with_result().wait()
        self.assertEqual(nodes.volume.GetName(), "PolyPose warped CT")
        np.testing.assert_array_equal(slicer.util.arrayFromVolume(nodes.volume), scenes.voxels())
        matrix = vtk.vtkMatrix4x4()
        nodes.volume.GetIJKToRASMatrix(matrix)
        expected = frames.flip_affine(scenes.affine(left_handed=True, tilt_deg=10.0))
        np.testing.assert_allclose(frames.from_vtk(matrix), expected, atol=1e-4)
        self.assertEqual(nodes.volume.GetDisplayNode().GetWindow(), 1500)
        self.assertEqual((nodes.warnings, nodes.device), (scenes.WARNINGS, "cpu"))
        self.assertTrue(nodes.report.startswith(b"\x89PNG"))

    def test_inputs_are_not_changed(self) -> None:
        before = scenes.voxels()
        ids = list(self.segmentation.GetSegmentation().GetSegmentIDs())
        modified = []
        inputs = (self.ct, self.segmentation, *self.xrays)
        for node in inputs:
            node.GetTransformNodeID()
            node.AddObserver(
                vtk.vtkCommand.ModifiedEvent, lambda caller, _event: modified.append(caller.GetName())
            )
        self.start_with_result().wait()
        self.assertEqual(modified, [])
        np.testing.assert_array_equal(slicer.util.arrayFromVolume(self.ct), before)
        self.assertEqual(list(self.segmentation.GetSegmentation().GetSegmentIDs()), ids)

    def test_segments_keep_name_colour_and_terminology(self) -> None:
        nodes = self.start_with_result().wait()
        content = nodes.segmentation.GetSegmentation()
        source = self.segmentation.GetSegmentation()
        self.assertEqual(list(content.GetSegmentIDs()), list(source.GetSegmentIDs()))
        for number in range(3):
            mine, theirs = content.GetNthSegment(number), source.GetNthSegment(number)
            self.assertEqual(mine.GetName(), theirs.GetName())
            self.assertEqual(mine.GetColor(), theirs.GetColor())
            self.assertEqual(mine.GetTerminology(), theirs.GetTerminology())
            mask = slicer.util.arrayFromSegmentBinaryLabelmap(
                nodes.segmentation, content.GetNthSegmentID(number), nodes.volume
            )
            np.testing.assert_array_equal(mask > 0, scenes.labels() == number + 1)
        self.assertEqual(content.GetNthSegment(0).GetTerminology(), scenes.TERMINOLOGY)

    def test_the_transform_is_set_in_the_resampling_direction(self) -> None:
        nodes = self.start_with_result().wait()
        vectors, affine = scenes.field(scenes.affine(left_handed=True, tilt_deg=10.0))
        self.assertIsNotNone(
            nodes.transform.GetTransformFromParentAs("vtkOrientedGridTransform", False, True)
        )
        general = vtk.vtkGeneralTransform()
        nodes.transform.GetTransformFromWorld(general)
        node = affine[:3, :3] @ [3, 4, 5] + affine[:3, 3]
        moved = general.TransformPoint(*frames.flip_vectors(node))
        np.testing.assert_allclose(frames.flip_vectors(np.array(moved)), node + vectors[5, 4, 3], atol=1e-3)

    def test_table_plot_and_cameras(self) -> None:
        nodes = self.start_with_result().wait()
        table = nodes.motions.GetTable()
        self.assertEqual([table.GetValue(n, 0).ToString() for n in range(2)], ["pelvis", "femur"])
        self.assertAlmostEqual(table.GetValueByName(1, "Rotation [deg]").ToDouble(), 10.0, places=4)
        names = [table.GetColumnName(n) for n in range(table.GetNumberOfColumns())]
        self.assertEqual(names[-2:], ["95 % along the beam [mm]", "95 % across the beam [mm]"])
        self.assertAlmostEqual(table.GetValueByName(1, names[-1]).ToDouble(), 0.2)
        self.assertEqual(set(motions_of(nodes.motions)), {"pelvis", "femur"})
        self.assertEqual(nodes.similarity.GetTable().GetNumberOfRows(), 9)
        self.assertIs(nodes.plot.GetNthPlotSeriesNode(0), nodes.series)
        intrinsics, extrinsic = scenes.camera_matrix()
        for number, node in enumerate(nodes.cameras):
            camera = camera_of(node)
            np.testing.assert_allclose(camera.extrinsic, extrinsic, atol=1e-6)
            np.testing.assert_allclose(camera.intrinsics, intrinsics)
            self.assertAlmostEqual(similarity_of(node), 0.9 - number / 10)
        # The source lies in front of the patient: anterior is +y in RAS.
        self.assertGreater(slicer.util.arrayFromTransformMatrix(nodes.cameras[0])[1, 3], 700)

    def test_renderings_lie_on_the_detector(self) -> None:
        nodes = self.start_with_result().wait()
        camera = camera_of(nodes.cameras[0])
        matrix = vtk.vtkMatrix4x4()
        nodes.renderings[0].GetIJKToRASMatrix(matrix)
        for column, row in ((0, 0), (29, 39), (7, 22)):
            ras = frames.from_vtk(matrix) @ [column, row, 0, 1]
            seen = camera.intrinsics @ (camera.extrinsic @ [*frames.flip_vectors(ras[:3]), 1])[:3]
            np.testing.assert_allclose(seen[:2] / seen[2], (column, row), atol=1e-6)

    def test_given_nodes_are_filled_and_lose_their_parent(self) -> None:
        given = OutputNodes(
            transform=slicer.mrmlScene.AddNewNodeByClass("vtkMRMLTransformNode", "mine"),
            volume=slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", "my volume"),
        )
        given.volume.SetAndObserveTransformNodeID(scenes.add_transform(scenes.rotation((0, 0, 1), 9)).GetID())
        folder = scenes.save_result(self.folder / "given")
        nodes = self.start(GIVE_RESULT.format(folder=folder), given).wait()
        self.assertEqual((nodes.transform.GetName(), nodes.volume.GetName()), ("mine", "my volume"))
        self.assertIsNone(nodes.volume.GetParentTransformNode())
        self.assertFalse(nodes.transform.IsLinear())

    def test_an_untrusted_result_is_an_error_with_nodes(self) -> None:
        run = self.start_with_result(distrust=("a structure left every view",))
        with self.assertRaisesRegex(UntrustedResultError, "a structure left every view"):
            run.wait()
        self.assertIs(run.state, State.DONE)
        self.assertIsNotNone(run.nodes.volume.GetScene())

    def test_segments_that_overlap_are_all_warped(self) -> None:
        content = self.segmentation.GetSegmentation()
        whole = content.AddEmptySegment("body", "body", (0.5, 0.5, 0.5))
        slicer.util.updateSegmentBinaryLabelmapFromArray(
            (scenes.voxels() > -500).astype(np.uint8), self.segmentation, whole, self.ct
        )
        nodes = self.start_with_result().wait()
        mask = slicer.util.arrayFromSegmentBinaryLabelmap(nodes.segmentation, "body", nodes.volume)
        from PolyPoseLib.data.displacement_field import DisplacementField

        matrix = scenes.affine(left_handed=True, tilt_deg=10.0)
        warp = DisplacementField(*scenes.field(matrix))
        k, j, i = np.indices(scenes.SHAPE)
        fixed = np.stack([i, j, k], -1) @ matrix[:3, :3].T + matrix[:3, 3]
        index = (warp(fixed) - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
        nearest = np.round(index).astype(int)
        inside = ((nearest >= 0) & (nearest < np.array(scenes.SHAPE[::-1]))).all(axis=-1)
        x, y, z = np.moveaxis(np.clip(nearest, 0, np.array(scenes.SHAPE[::-1]) - 1), -1, 0)
        expected = inside & (scenes.voxels()[z, y, x] > -500)
        self.assertGreater((expected == (mask > 0)).mean(), 0.99)


class PreviewTest(RegistrationCase):
    def body(self) -> str:
        from PolyPoseLib.data.displacement_field import DisplacementField
        from PolyPoseLib.io.transforms import write_transform

        write_transform(DisplacementField(*scenes.field()), self.folder / "field.h5")
        return (
            "import shutil\n"
            f"shutil.copy({str(self.folder / 'field.h5')!r}, preview)\n"
            "tell(1, preview=preview)\ntell(2, preview='/etc/passwd')\n" + children.SLEEP_FOREVER
        )

    def test_the_transform_moves_while_it_runs_and_is_taken_back(self) -> None:
        run = self.start(self.body(), preview=True)
        with self.nothing_added():
            while run.nodes.transform is None:
                self.assertFalse(run.poll().ended, run.error)
            self.assertFalse(run.nodes.transform.IsLinear())
            run.cancel()
            with self.assertRaises(CancelledError):
                run.wait()

    def test_a_given_transform_gets_its_old_map_back(self) -> None:
        mine = scenes.add_transform(scenes.rotation((0, 0, 1), 30.0), "mine")
        general = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLTransformNode", "general")
        general.CopyContent(mine)
        run = self.start(self.body(), OutputNodes(transform=general), preview=True)
        while general.IsLinear():
            self.assertFalse(run.poll().ended, run.error)
        run.close()
        expected = slicer.util.arrayFromTransformMatrix(mine)
        np.testing.assert_allclose(slicer.util.arrayFromTransformMatrix(general), expected, atol=1e-9)


class ArgumentsTest(RegistrationCase):
    def test_the_child_gets_the_contract_and_slicers_environment(self) -> None:
        body = """
        note = {"arguments": sys.argv[1:], "cwd": os.getcwd(), "environment": dict(os.environ)}
        study = Path(sys.argv[2])
        note["files"] = sorted(p.name for p in study.parent.iterdir())
        note["study"] = json.loads(study.read_text())
        import PolyPoseLib
        note["core"] = PolyPoseLib.__file__
        Path(__file__).with_name("note.json").write_text(json.dumps(note))
        """
        with self.assertRaises(registration.RunError), mock.patch.dict(os.environ, {"ONLY_HERE": "1"}):
            self.start(body, options={"preset": "fast"}).wait()
        note = json.loads((self.folder / "note.json").read_text())
        self.assertEqual(note["arguments"][0], "register")
        self.assertEqual(note["arguments"][2], "--output")
        self.assertEqual(note["arguments"][4:6], ["--progress", "json"])
        self.assertEqual(
            note["files"], ["STUDY.json", "ct.nrrd", "labels.nrrd", "xray_0.nrrd", "xray_1.nrrd"]
        )
        self.assertEqual(note["study"]["structures"], {"pelvis": [1], "femur": [2]})
        self.assertEqual(note["study"]["xrays"][0]["pixel_spacing_mm"], [2.0, 2.0])
        self.assertEqual(note["study"]["options"], {"preset": "fast"})
        self.assertEqual(note["environment"].get("ONLY_HERE"), "1")
        self.assertNotIn("STARTED_BEFORE_SLICER", note["environment"])
        self.assertEqual(Path(note["core"]).parent.name, "PolyPoseLib")


if __name__ == "__main__":
    unittest.main()
