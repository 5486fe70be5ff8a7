"""Studies opened in the scene, and the sample data that come as one."""

from __future__ import annotations

import hashlib
import json
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
import scenes
import slicer
from PolyPoseSlicer import samples
from PolyPoseSlicer.scene.nodes import Grid, read_layers, read_volume, region_on
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.reader import open_study
from PolyPoseSlicer.study.writer import read_study, write_study
from PolyPoseSlicer.study.xray_source import XraySource
from slicer_case import INSIDE_SLICER, REPOSITORY, SlicerTestCase

from PolyPoseLib.errors import InputError, PolyPoseError

FIELDS = {"source_to_detector_mm": 1000.0, "intensity": "line_integral", "camera": "initial"}


class StudyCase(SlicerTestCase):
    def setUp(self) -> None:
        super().setUp()
        if not hasattr(slicer.modules, "polypose"):
            from harness import modules

            modules.load(REPOSITORY / "PolyPose" / "PolyPose.py")
        import PolyPose

        self.logic = PolyPose.PolyPoseLogic()

    def write(self) -> str:
        """A study of two structures and two X-rays; returns its path."""
        ct = scenes.add_ct(scenes.affine(True, 20.0))
        _intrinsics, extrinsic = scenes.camera_matrix()
        fields = {**FIELDS, "extrinsic": extrinsic.tolist()}
        xrays = [XraySource(scenes.add_xray(name), fields=fields) for name in ("a", "b")]
        structures = {"hip": ["pelvis"], "leg": ["femur", "plate"]}
        options = {"preset": "fast", "seed": 3}
        data = read_study(ct, scenes.add_segmentation(ct), structures, xrays, "hip", options)
        path = write_study(data, self.folder)
        slicer.mrmlScene.Clear()
        return str(path)


class OpenStudyTest(StudyCase):
    def test_everything_is_in_place_and_nothing_is_missing(self) -> None:
        path = self.write()
        node = self.logic.getParameterNode()
        nodes = open_study(path, node)
        self.assertEqual(len(nodes), 4)
        self.assertEqual(self.logic.missingInput(node), "")
        self.assertEqual(set(parameters.structures_of(node)), {"hip", "leg"})
        self.assertEqual((node.anchor, node.preset), ("hip", parameters.Preset.FAST))
        self.assertEqual(parameters.options_of(node), {"seed": 3, "preset": "fast", "device": "auto"})
        grid = read_volume(node.ct).grid
        np.testing.assert_allclose(grid.affine, scenes.affine(True, 20.0), atol=1e-5)

    def test_a_ct_of_a_tilted_gantry_is_straight_in_the_scene(self) -> None:
        from PolyPoseLib.io.volumes import read_volume as read_file
        from PolyPoseLib.io.volumes import write_volume

        path = self.write()
        file = Path(path).parent / json.loads(Path(path).read_text())["ct"]
        ct = read_file(file)
        ct.affine[:3, 2] += 0.2 * ct.affine[:3, 1]  # in place: the slices drift down their columns
        write_volume(ct, file)
        node = self.logic.getParameterNode()
        with self.assertLogs(level="WARNING") as logged:
            open_study(path, node)
        self.assertIn("gantry tilt", " ".join(logged.output))
        shown = read_volume(node.ct)
        self.assertTrue(shown.grid.is_straight())
        self.assertGreater(shown.values.shape[1], ct.shape[1])
        self.assertEqual(shown.values.shape[0], ct.shape[0])

    def test_written_again_it_is_the_same_study(self) -> None:
        path = self.write()
        first = json.loads(Path(path).read_text())
        node = self.logic.getParameterNode()
        open_study(path, node)
        (self.folder / "again").mkdir()
        data = read_study(
            node.ct,
            node.segmentation,
            parameters.structures_of(node),
            parameters.xray_sources(node),
            node.anchor,
            parameters.options_of(node),
        )
        second = json.loads(write_study(data, self.folder / "again").read_text())
        for before, after in zip(first["xrays"], second["xrays"], strict=True):
            self.assertEqual(before["extrinsic"], after["extrinsic"])
            self.assertEqual(before["pixel_spacing_mm"], after["pixel_spacing_mm"])
        self.assertEqual(second["structures"], first["structures"])
        labels = np.zeros(scenes.SHAPE, np.uint8)
        ids = list(node.segmentation.GetSegmentation().GetSegmentIDs())
        for layer in read_layers(node.segmentation, ids):
            region, values = region_on(layer.voxels, Grid(scenes.affine(True, 20.0), scenes.SHAPE))
            labels[region] = values
        np.testing.assert_array_equal(labels, scenes.labels())

    def test_labels_get_the_names_of_their_table(self) -> None:
        import SimpleITK as sitk

        path = self.write()
        labels = sitk.ReadImage(str(self.folder / "labels.nrrd"))
        for key in labels.GetMetaDataKeys():
            labels.EraseMetaData(key)
        sitk.WriteImage(labels, str(self.folder / "labels.nrrd"))
        self.assertEqual(self.names_opened(path), ["spleen", "kidney_right", "kidney_left"])

    def test_segments_keep_their_own_names(self) -> None:
        self.assertEqual(self.names_opened(self.write()), ["pelvis", "femur", "plate"])

    def names_opened(self, path: Path) -> list[str]:
        """Of the segments of a study that is opened with a table."""
        node = self.logic.getParameterNode()
        open_study(path, node, "totalsegmentator_v2")
        return [node.segmentation.GetSegmentation().GetNthSegment(n).GetName() for n in range(3)]

    def test_a_damaged_study_adds_nothing(self) -> None:
        path = self.write()
        (self.folder / "labels.nrrd").write_bytes(b"NRRD0004\n")
        before = slicer.mrmlScene.GetNumberOfNodes()
        node = self.logic.getParameterNode()
        with self.assertRaises(InputError):
            open_study(path, node)
        self.assertLessEqual(slicer.mrmlScene.GetNumberOfNodes(), before + 1)
        self.assertIsNone(node.ct)


class SampleTest(StudyCase):
    def test_the_sample_is_registered_with_hashes_and_a_thumbnail(self) -> None:
        import SampleData

        samples.register(self.logic.getParameterNode)
        if INSIDE_SLICER:
            self.skipTest("Slicer keeps its sources to itself")
        source = SampleData.SampleDataLogic.sources[-1]
        self.assertEqual((source["category"], source["sampleName"]), ("PolyPose", "PolyPosePelvis"))
        self.assertTrue(all(each.startswith("SHA256:") for each in source["checksums"]))
        self.assertTrue(Path(source["thumbnailFileName"]).is_file(), "the thumbnail is missing")

    def test_the_hashes_are_those_of_the_cores_sample(self) -> None:
        from PolyPoseLib.io.samples import SAMPLES

        members = SAMPLES["pelvis"].members
        self.assertEqual(samples.CT[2], "SHA256:" + members["ct.nii.gz"][1])
        self.assertEqual(samples.LABELS[2], "SHA256:" + members["labels.nii.gz"][1])

    def test_from_an_empty_scene_to_a_study_that_lacks_nothing(self) -> None:
        import SampleData

        path = self.write()
        case = self.folder / samples.CASE_FOLDER

        def simulate(_ct: str, _labels: str, folder) -> None:
            import shutil

            folder.mkdir()
            for name in ("ct.nrrd", "labels.nrrd", "xray_0.nrrd", "xray_1.nrrd"):
                shutil.copy(self.folder / name, folder)
            shutil.copy(path, folder / "study.json")

        with (
            mock.patch.object(
                SampleData.SampleDataLogic,
                "downloadFileIntoCache",
                lambda _self, _uri, name, _checksum: str(self.folder / name),
            ),
            mock.patch.object(samples, "ensure_dependencies"),
            mock.patch.object(samples, "simulate", side_effect=simulate) as simulated,
        ):
            samples.download(self.logic.getParameterNode)
            self.assertEqual(self.logic.missingInput(), "")
            samples.download(self.logic.getParameterNode)
            simulated.assert_called_once()
        self.assertTrue(case.is_dir())

    def test_a_failed_simulation_is_the_cores_sentence(self) -> None:
        with self.assertRaisesRegex(PolyPoseError, "no-such-ct"):
            samples.simulate("/no-such-ct.nii.gz", "/no-labels.nii.gz", self.folder / "case")
        self.assertEqual([each.name for each in self.folder.iterdir()], [])

    def test_the_button_says_what_went_wrong(self) -> None:
        with (
            mock.patch.object(samples, "download", side_effect=ValueError("checksum is wrong")),
            mock.patch.object(slicer.util, "errorDisplay") as said,
        ):
            self.assertEqual(samples.download_or_say(self.logic.getParameterNode), [])
        self.assertEqual(said.call_args.args, ("checksum is wrong",))
        self.assertIn("ValueError", said.call_args.kwargs["detailedText"])

    def test_the_sample_itself_when_it_was_fetched_before(self) -> None:
        from PolyPoseLib.io.samples import cached_sample

        folder = cached_sample("pelvis")
        if folder is None:
            self.skipTest("the pelvis was not fetched: python -m PolyPoseLib sample pelvis")
        found = hashlib.sha256((folder / "ct.nii.gz").read_bytes()).hexdigest()
        self.assertEqual("SHA256:" + found, samples.CT[2])


if __name__ == "__main__":
    unittest.main()
