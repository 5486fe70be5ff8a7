"""What the module writes is what PolyPoseLib reads: the study of nodes, loaded back."""

from __future__ import annotations

import unittest
from types import SimpleNamespace
from unittest import mock

import numpy as np
import scenes
import slicer
from PolyPoseSlicer.scene import frames, motions
from PolyPoseSlicer.scene.cameras import camera_of, set_camera
from PolyPoseSlicer.study.loading import structure_centroids
from PolyPoseSlicer.study.writer import read_study, write_study
from PolyPoseSlicer.study.xray_source import XraySource
from slicer_case import SlicerTestCase

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera

GEOMETRY = {"source_to_detector_mm": 1000.0, "intensity": "line_integral"}


class StudyTest(SlicerTestCase):
    def load(self, ct, segmentation, xrays, structures=None, options=None):
        """Write a study of nodes and read it as the core does."""
        from PolyPoseLib.data.study import Study

        structures = structures or {"pelvis": ["pelvis"], "femur": ["femur", "plate"]}
        self.data = read_study(ct, segmentation, structures, xrays, "pelvis", options)
        return Study.load(write_study(self.data, self.folder), allow_outside=True)

    def test_ct_and_structures_in_the_world(self) -> None:
        for left_handed, tilt in ((False, 0.0), (True, 20.0)):
            matrix = scenes.affine(left_handed, tilt)
            ct = scenes.add_ct(matrix)
            placed = scenes.rotation((1, 2, -1), 35.0)
            placed[:3, 3] = (20, -5, 7)
            ct.SetAndObserveTransformNodeID(scenes.add_transform(placed).GetID())
            study = self.load(
                ct, scenes.add_segmentation(ct), [XraySource(scenes.add_xray(), fields=GEOMETRY)]
            )
            np.testing.assert_allclose(study.ct.affine, frames.flip_map(placed) @ matrix, atol=1e-5)
            np.testing.assert_array_equal(study.ct.voxels, scenes.voxels())
            self.assertEqual(study.structures.names, ("pelvis", "femur"))
            np.testing.assert_array_equal(study.structures.mask("pelvis"), scenes.labels() == 1)
            np.testing.assert_array_equal(study.structures.mask("femur"), scenes.labels() >= 2)
            np.testing.assert_array_equal(study.source_segmentation.voxels, scenes.labels())
            self.assertEqual(study.anchor, "pelvis")

    def test_messages_know_the_segments_by_name(self) -> None:
        ct = scenes.add_ct()
        segmentation = scenes.add_segmentation(ct)
        content = segmentation.GetSegmentation()
        wanted = {}
        for number, identifier in enumerate(content.GetSegmentIDs(), start=1):
            content.GetSegment(identifier).SetName(f"Knochen {number}:=\n\u00e4\u9aa8")
            wanted[number] = f"Knochen {number}:= \u00e4\u9aa8"
        structures = {"pelvis": [content.GetNthSegmentID(0)], "femur": [content.GetNthSegmentID(1)]}
        study = self.load(
            ct, segmentation, [XraySource(scenes.add_xray(), fields=GEOMETRY)], structures=structures
        )
        self.assertEqual(study.label_names, wanted)

    def test_centroids_agree_with_the_cores(self) -> None:
        ct = scenes.add_ct(scenes.affine(True, 20.0))
        study = self.load(ct, scenes.add_segmentation(ct), [XraySource(scenes.add_xray(), fields=GEOMETRY)])
        ours = structure_centroids(self.data)
        theirs = study.structures.centroids(study.ct.affine)
        for name, centroid in zip(study.structures.names, theirs, strict=True):
            np.testing.assert_allclose(ours[name], centroid, atol=1e-6)

    def test_typed_geometry_and_pixels_arrive(self) -> None:
        ct = scenes.add_ct()
        intrinsics, extrinsic = scenes.camera_matrix()
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode")
        set_camera(node, Camera(intrinsics, extrinsic, 40, 30))
        fields = {"intrinsics": intrinsics.tolist(), "camera": "known", "intensity": "line_integral"}
        study = self.load(
            ct,
            scenes.add_segmentation(ct),
            [
                XraySource(scenes.add_xray(), fields=fields, camera_transform=node),
                XraySource(scenes.add_xray("second"), fields={**GEOMETRY, "name": "lateral"}),
            ],
        )
        known, typed = study.xrays
        self.assertEqual((known.name, known.camera, typed.name), ("X-ray 1", "known", "lateral"))
        np.testing.assert_allclose(known.extrinsic, extrinsic, atol=1e-9)
        np.testing.assert_allclose(known.image, np.arange(1200).reshape(40, 30) / 400, atol=1e-6)
        self.assertEqual(tuple(typed.pixel_spacing_mm), (2.0, 2.0))
        np.testing.assert_allclose(typed.intrinsics[0, 0], 500.0)

    def test_a_camera_under_a_parent_is_where_it_is_shown(self) -> None:
        intrinsics, extrinsic = scenes.camera_matrix()
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode")
        set_camera(node, Camera(intrinsics, extrinsic, 40, 30))
        placed = scenes.rotation((0, 0, 1), 90.0)
        node.SetAndObserveTransformNodeID(scenes.add_transform(placed).GetID())
        expected = extrinsic @ np.linalg.inv(frames.flip_map(placed))
        np.testing.assert_allclose(camera_of(node).extrinsic, expected, atol=1e-9)

    def test_overlapping_structures_warn_and_the_first_keeps_the_voxels(self) -> None:
        ct = scenes.add_ct()
        segmentation = scenes.add_segmentation(ct)
        content = segmentation.GetSegmentation()
        content.AddEmptySegment("again", "again", (1, 1, 0))
        slicer.util.updateSegmentBinaryLabelmapFromArray(
            (scenes.labels() == 1).astype(np.uint8), segmentation, "again", ct
        )
        structures = {"pelvis": ["pelvis"], "femur": ["femur", "again"]}
        study = self.load(ct, segmentation, [XraySource(scenes.add_xray(), fields=GEOMETRY)], structures)
        np.testing.assert_array_equal(study.structures.mask("pelvis"), scenes.labels() == 1)
        np.testing.assert_array_equal(study.structures.mask("femur"), scenes.labels() == 2)
        self.assertEqual(self.data.overlapped, ["again"])
        self.assertIn("100 %", self.data.warnings[0])
        with self.assertRaisesRegex(InputError, "'femur' has no voxels of its own"):
            self.load(ct, segmentation, [scenes.add_xray()], {"pelvis": ["pelvis"], "femur": ["again"]})


class SourceTest(SlicerTestCase):
    def test_a_sequence_gives_its_frame(self) -> None:
        sequence = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", "run")
        for number in range(3):
            node = slicer.util.addVolumeFromArray(np.full((1, 5, 6), number, np.float32))
            sequence.SetDataNodeAtValue(node, str(number))
        source = XraySource(sequence, frame=2)
        pixels, _spacing = source.pixels()
        self.assertTrue((pixels == 2).all())
        self.assertEqual(source.name, "run [2]")
        with self.assertRaisesRegex(InputError, "3 images: choose one of them"):
            XraySource(sequence, frame=7).pixels()

    def test_the_dicom_file_is_preferred_to_the_node(self) -> None:
        path = self.folder / "image.dcm"
        path.write_bytes(b"")
        database = SimpleNamespace(isOpen=True, fileForInstance={"1.2": str(path)}.get)
        node = scenes.add_xray()
        node.SetAttribute("DICOM.instanceUIDs", "1.2")
        self.assertEqual(XraySource(node).file(), ("", None))
        with mock.patch.object(slicer, "dicomDatabase", database, create=True):
            self.assertEqual(XraySource(node, frame=4).file(), (str(path), 4))
            node.SetAttribute("DICOM.instanceUIDs", "9.9")
            self.assertEqual(XraySource(node).file(), ("", None))

    def test_one_of_several_images_of_a_volume(self) -> None:
        node = slicer.util.addVolumeFromArray(np.arange(24, dtype=np.float32).reshape(2, 3, 4))
        self.assertEqual(float(XraySource(node, frame=1).pixels()[0][0, 0]), 12.0)

    def test_a_spacing_that_nobody_measured_is_not_passed_on(self) -> None:
        node = scenes.add_xray()
        node.SetSpacing(1.0, 1.0, 1.0)
        ct = scenes.add_ct()
        data = read_study(ct, scenes.add_segmentation(ct), {"pelvis": ["pelvis"]}, [node], "pelvis")
        write_study(data, self.folder)
        self.assertNotIn("pixel_spacing_mm", (self.folder / "STUDY.json").read_text())

    def test_nothing_is_no_xray(self) -> None:
        with self.assertRaisesRegex(InputError, "choose one"):
            XraySource()


class MotionTest(SlicerTestCase):
    def motion(self, seed: int, degrees: float) -> motions.Motion:
        random = np.random.default_rng(seed)
        matrix = scenes.rotation(tuple(random.normal(size=3)), degrees)
        matrix[:3, 3] = random.normal(size=3) * 20
        return motions.Motion(matrix, random.normal(size=3) * 50, {"level": 0.9, "along_mm": 0.5})

    def test_angles_from_nothing_to_half_a_turn(self) -> None:
        for degrees in (0.0, 1e-5, 0.1, 45.0, 179.999, 180.0):
            row = motions.motion_rows({"a": self.motion(3, degrees)})[0]
            self.assertAlmostEqual(row.rotation_deg, degrees, places=4)
            self.assertAlmostEqual(float(np.linalg.norm(row.axis)), 1.0, places=6)

    def test_relative_motions(self) -> None:
        given = {name: self.motion(seed, 20.0 + seed) for seed, name in enumerate("abc")}
        rows = {row.name: row for row in motions.motion_rows(given, relative_to="b")}
        self.assertAlmostEqual(rows["b"].rotation_deg, 0.0, places=4)
        np.testing.assert_allclose(rows["b"].translation_mm, 0, atol=1e-9)
        self.assertEqual(rows["a"].uncertainty, {})
        back = np.linalg.inv(given["b"].matrix) @ given["a"].matrix
        centroid = given["a"].centroid
        shift = back[:3, :3] @ centroid + back[:3, 3] - centroid
        np.testing.assert_allclose(frames.flip_vectors(rows["a"].translation_mm), shift)

    def test_they_outlive_the_table(self) -> None:
        given = {name: self.motion(seed, 20.0) for seed, name in enumerate(("a", 'b,"c"'))}
        table = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLTableNode")
        motions.fill_motion_table(table, given)
        for name, motion in motions.motions_of(table).items():
            np.testing.assert_array_equal(motion.matrix, given[name].matrix)
        self.assertEqual(table.GetNumberOfRows(), 2)
        self.assertEqual([table.GetCellText(1, column) for column in range(2)], ['b,"c"', "20"])
        self.assertEqual(motions.motions_of(None), {})


if __name__ == "__main__":
    unittest.main()
