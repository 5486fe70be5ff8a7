"""The snapshot of sequences: which images are written and how, whose cameras, and what holds up nothing."""

from __future__ import annotations

import json
import time
import unittest
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np
import scenes
import slicer
import track_scene_case
from PolyPoseSlicer.study.track_plan import plan_of
from PolyPoseSlicer.study.track_request import FoundView, Start, TrackRequest, TrackSettings
from PolyPoseSlicer.study.track_writer import inputs_digest, read_track, write_track
from PolyPoseSlicer.study.xray_reading import XrayReader
from PolyPoseSlicer.study.xray_series import image_count, series_of, stated_rate
from PolyPoseSlicer.study.xray_source import XraySource
from slicer_case import SlicerTestCase

from PolyPoseLib.data.progress import CancelQuery
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.io.tracking.schema import check
from PolyPoseLib.io.tracking.sequences import load_sequence


class WriterTest(SlicerTestCase):
    def setUp(self) -> None:
        super().setUp()
        self.ct = scenes.add_ct()
        self.segmentation = scenes.add_segmentation(self.ct)
        self.xrays = {name: track_scene_case.add_sequence(name, 9) for name in track_scene_case.OFFSETS}
        rng = np.random.default_rng(0)
        for sequence in self.xrays.values():
            for number in range(sequence.GetNumberOfDataNodes()):
                image = slicer.util.arrayFromVolume(sequence.GetNthDataNode(number))
                image[:] = rng.random(image.shape, np.float32)

    def row(self, camera_name: str, **fields) -> XraySource:
        camera = track_scene_case.camera(list(self.xrays).index(camera_name))
        given = {
            "name": camera_name, "camera": "known", "intensity": "line_integral",
            "intrinsics": camera.intrinsics.tolist(), "extrinsic": camera.extrinsic.tolist(), **fields,
        }  # fmt: skip
        frame = track_scene_case.OFFSETS[camera_name]
        return XraySource(self.xrays[camera_name], frame=frame, fields=given)

    def request(
        self, rows: list | None = None, settings: TrackSettings | None = None, **more
    ) -> TrackRequest:
        rows = [self.row(name) for name in self.xrays] if rows is None else rows
        return TrackRequest(
            self.ct, self.segmentation, ["pelvis", "femur"], rows, settings or TrackSettings(), **more
        )

    def write(self, request: TrackRequest, cancel: CancelQuery | None = None) -> Path:
        data = read_track(request, plan_of(request, XrayReader()))
        folder = self.folder / f"out{len(list(self.folder.iterdir()))}"
        folder.mkdir()
        path = write_track(data, folder, cancel)
        check(json.loads(path.read_text()), "TRACK.json")
        return path

    def test_pixels_are_written_as_they_are_and_the_core_reads_the_same_cameras(self) -> None:
        sequence = load_sequence(self.write(self.request()), allow_outside=True)
        self.assertEqual([view.name for view in sequence.views], ["left", "right"])
        self.assertEqual([view.first for view in sequence.views], [0, 4])
        self.assertEqual((sequence.available, sequence.frames_per_second), (5, 50.0))
        for number, view in enumerate(sequence.views):
            expected = track_scene_case.camera(number)
            np.testing.assert_allclose(view.camera.intrinsics, expected.intrinsics)
            np.testing.assert_allclose(view.camera.extrinsic, expected.extrinsic)
            image, mask = view.images.read(7)
            node = slicer.util.arrayFromVolume(self.xrays[view.name].GetNthDataNode(7))[0]
            np.testing.assert_array_equal(image[mask], node[mask])
        np.testing.assert_array_equal(sequence.structures.mask("femur"), scenes.labels() == 2)

    def test_a_mirrored_row_is_turned_round_as_in_a_registration(self) -> None:
        rows = [self.row("left", mirrored=True), self.row("right")]
        sequence = load_sequence(self.write(self.request(rows)), allow_outside=True)
        xray = XrayReader().report(rows[0]).xray
        np.testing.assert_allclose(sequence.views[0].camera.intrinsics, xray.intrinsics)
        image, mask = sequence.views[0].images.read(0)
        np.testing.assert_array_equal(image[mask], xray.image[mask])

    def test_cameras_of_a_registration_win_and_its_poses_start_the_first_frame(self) -> None:
        rows = [self.row("left", camera="initial"), self.row("right")]
        moved = scenes.rotation((0, 0, 1), 3.0)
        found = {}
        for number, row in enumerate(rows):
            camera = track_scene_case.camera(number)
            found[row.series] = FoundView(camera.with_extrinsic(camera.extrinsic @ moved), row.frame)
        settings = TrackSettings(start=Start.RESULT, first=1)
        request = self.request(rows, settings, found=found, poses={"femur": moved})
        path = self.write(request)
        sequence = load_sequence(path, allow_outside=True)
        for number, view in enumerate(sequence.views):
            extrinsic = track_scene_case.camera(number).extrinsic @ moved
            np.testing.assert_allclose(view.camera.extrinsic, extrinsic, atol=1e-12)
        np.testing.assert_allclose(sequence.initial_poses["femur"], moved)
        self.assertEqual((sequence.frames, sequence.options.start), (range(1, 5), "rest"))
        self.assertIn("another frame than 1", " ".join(plan_of(request, XrayReader()).notes))

    def test_a_structure_that_is_to_stand_still_where_it_was_doubtful_is_named(self) -> None:
        poses = dict.fromkeys(("pelvis", "femur"), np.eye(4))
        for still, start, uncertain, told in (
            (("femur",), Start.RESULT, ("femur",), True),
            (("femur",), Start.RESULT, ("pelvis",), False),
            ((), Start.RESULT, ("femur",), False),
            (("femur",), Start.REST, ("femur",), False),
        ):
            settings = TrackSettings(start=start, still=still)
            request = self.request(settings=settings, poses=poses, uncertain=uncertain)
            notes = [each for each in plan_of(request, XrayReader()).notes if "stand still" in each]
            self.assertEqual(len(notes), told)
            self.assertTrue(all("(femur)" in each for each in notes))

    def test_no_name_of_a_node_reaches_a_file(self) -> None:
        for each in self.xrays.values():
            each.SetName("Doe^Jane")
        path = self.write(self.request([self.row("left", name=""), self.row("right", name="")]))
        self.assertNotIn("Doe", path.read_text())
        self.assertEqual([e["name"] for e in json.loads(path.read_text())["cameras"]], ["X-ray 1", "X-ray 2"])

    def test_images_of_other_sizes_are_refused(self) -> None:
        slicer.util.updateVolumeFromArray(
            self.xrays["left"].GetNthDataNode(4), np.zeros((1, 9, 9), np.float32)
        )
        with self.assertRaisesRegex(InputError, "Image 5 of the sequence 'XA left' has another size"):
            read_track(self.request(), plan_of(self.request(), XrayReader()))

    def test_writing_ends_when_it_is_cancelled(self) -> None:
        with self.assertRaises(CancelledError):
            self.write(self.request(), lambda: True)

    def timed(self, times: list[float], name: str) -> XraySource:
        """A row whose images have these times."""
        sequence = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode")
        image = self.xrays[name].GetNthDataNode(0)
        for each in times:
            sequence.SetDataNodeAtValue(image, f"{each:.4f}")
        return replace(self.row(name), image=sequence, frame=0)

    def test_times_may_jitter_and_missing_images_are_noted(self) -> None:
        rng = np.random.default_rng(1)
        jittering = np.arange(40) / 50 + rng.uniform(-0.003, 0.003, 40)
        rows = [
            self.timed(jittering.tolist(), "left"),
            self.timed(np.delete(np.arange(40) / 50, [11, 30, 31]).tolist(), "right"),
        ]
        plan = plan_of(self.request(rows), XrayReader())
        for each in plan.cameras:
            self.assertAlmostEqual(each.rate, 50, delta=0.5)  # a gap makes no sequence slower
        notes = [note for note in plan.notes if "missing" in note]
        self.assertEqual(len(notes), 1)
        self.assertIn("right: by their times, images are missing after image 11", notes[0])

    def test_the_digest_changes_with_every_input_and_not_without(self) -> None:
        def digest(request: TrackRequest) -> str:
            return inputs_digest(request, plan_of(request, XrayReader()))

        first = digest(self.request())
        self.assertEqual(digest(self.request()), first)
        others = [
            self.request(settings=TrackSettings(smooth=True)),
            self.request([self.row("left"), self.row("right", source_to_detector_mm=900.0)]),
            self.request([replace(self.row("left"), frame=1), self.row("right")]),
        ]
        found = [digest(each) for each in others]
        camera = scenes.add_transform(scenes.rotation((0, 0, 1), 5.0))
        self.ct.SetAndObserveTransformNodeID(camera.GetID())
        found.append(digest(self.request()))
        slicer.util.arrayFromVolumeModified(self.xrays["left"].GetNthDataNode(3))
        found.append(digest(self.request()))
        self.assertEqual(len({first, *found}), 6)

    def test_the_snapshot_copies_no_pixel(self) -> None:
        big = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", "big")
        volume = slicer.util.addVolumeFromArray(np.zeros((1, 500, 500), np.uint16))
        for number in range(100):
            big.SetDataNodeAtValue(volume, str(number))
        began = time.thread_time()
        series = series_of(XraySource(big, frame=0))
        self.assertLess(time.thread_time() - began, 0.3)
        self.assertEqual((series.count, series.bytes), (100, 100 * 500 * 500 * 2))
        last = slicer.util.arrayFromVolume(big.GetNthDataNode(99))
        self.assertTrue(np.shares_memory(series.images[99], last))
        slicer.mrmlScene.RemoveNode(big)
        self.assertEqual(int(series.images[0].sum()), 0)  # the pixels outlive their node


class FilesTest(SlicerTestCase):
    """Sequences that came from DICOM."""

    def sequence(self, uids: list[str]) -> XraySource:
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", "XA")
        for number, uid in enumerate(uids):
            volume = slicer.util.addVolumeFromArray(np.full((1, 20, 20), number, np.int16))
            volume.SetAttribute("DICOM.instanceUIDs", uid)  # as Slicer's DICOMImageSequencePlugin does
            node.SetDataNodeAtValue(volume, str(number))
        return XraySource(node, frame=0)

    def database(self, files: dict[str, Path]) -> None:
        database = SimpleNamespace(
            isOpen=True, fileForInstance=lambda uid: str(files[uid]) if uid in files else ""
        )
        patch = mock.patch.object(slicer, "dicomDatabase", database, create=True)
        patch.start()
        self.addCleanup(patch.stop)

    def dicom(self, name: str, frames: int, number: int = 1) -> Path:
        from pydicom.dataset import Dataset, FileMetaDataset
        from pydicom.uid import ExplicitVRLittleEndian

        dataset = Dataset()
        dataset.file_meta = FileMetaDataset()
        dataset.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        dataset.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.12.1"
        dataset.file_meta.MediaStorageSOPInstanceUID = f"1.2.{number}"
        dataset.SOPClassUID, dataset.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.12.1", f"1.2.{number}"
        dataset.Modality, dataset.InstanceNumber, dataset.SeriesInstanceUID = "XA", number, "1.3"
        dataset.Rows, dataset.Columns, dataset.SamplesPerPixel = 20, 20, 1
        dataset.BitsAllocated = dataset.BitsStored = 16
        dataset.HighBit, dataset.PixelRepresentation = 15, 0
        dataset.PhotometricInterpretation = "MONOCHROME2"
        dataset.NumberOfFrames = frames
        dataset.FrameTime = "40"
        values = np.arange(frames * 400, dtype=np.uint16).reshape(frames, 20, 20) + number
        dataset.PixelData = values.tobytes()
        path = self.folder / name
        dataset.save_as(path, enforce_file_format=True)
        return path

    def test_one_file_of_several_frames_is_read_itself(self) -> None:
        path = self.dicom("run.dcm", 3)
        self.database({"1.2.1": path})
        source = self.sequence(["1.2.1"] * 3)
        self.assertEqual((image_count(source), stated_rate(source)), (3, 25.0))
        self.assertEqual(series_of(source).file, str(path.resolve()))
        self.assertEqual(source.at(2).file(), (str(path), 2))
        with self.assertRaisesRegex(InputError, "has 2 images, but its file has 3"):
            series_of(self.sequence(["1.2.1"] * 2))

    def test_one_file_an_image_keeps_the_order_of_the_sequence(self) -> None:
        from PolyPoseSlicer.study.track_writer import _write_series

        paths = {f"1.2.{n}": self.dicom(f"image{n}.dcm", 1, n) for n in (5, 2, 9)}
        self.database(paths)
        source = self.sequence(list(paths))
        self.assertEqual(source.at(1).file(), (str(paths["1.2.2"]), None))
        series = series_of(source)
        self.assertEqual(series.files, tuple(map(str, paths.values())))
        before = [path.read_bytes() for path in paths.values()]
        _write_series(series, self.folder / "camera", lambda: False)
        from PolyPoseLib.io.tracking.image_run import open_run
        from PolyPoseLib.io.xray.fields import XrayFields

        run = open_run(self.folder / "camera", "camera")
        first = [int(run.values(n, XrayFields.parse({}, "camera"))[0, 0]) for n in range(3)]
        self.assertEqual(first, [5, 2, 9])
        self.assertEqual([path.read_bytes() for path in paths.values()], before)

    def test_pixels_are_taken_where_the_database_has_no_file(self) -> None:
        self.database({})
        series = series_of(self.sequence(["1.2.1"] * 3))
        self.assertEqual((series.file, series.files, len(series.images)), ("", (), 3))


if __name__ == "__main__":
    unittest.main()
