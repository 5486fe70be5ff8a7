"""The logic from nodes to nodes, on the real scene, with real child processes."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
import unittest
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import children
import numpy as np
import scenes
import slicer
import vtk
from PolyPoseSlicer import calls, frames, registration
from PolyPoseSlicer.cameras import camera_of
from PolyPoseSlicer.motions import motions_of
from PolyPoseSlicer.registration import State
from PolyPoseSlicer.results import OutputNodes
from slicer_case import SlicerTestCase

from PolyPoseLib.errors import CancelledError, InputError, PolyPoseError, UntrustedResultError

GIVE_RESULT = "import shutil\ntell(1)\ntell(2, similarity=0.8)\nshutil.copytree('{folder}', output)\n"
STRUCTURES = {"pelvis": ["pelvis"], "femur": ["femur"]}


class RegistrationCase(SlicerTestCase):
    """A scene with inputs, and a way to run a child of our own on them."""

    def setUp(self) -> None:
        super().setUp()
        self.ct = scenes.add_ct(scenes.affine(left_handed=True, tilt_deg=10.0))
        self.segmentation = scenes.add_segmentation(self.ct)
        self.xrays = [scenes.add_xray("AP"), scenes.add_xray("lateral")]

    def tearDown(self) -> None:
        self.assertEqual(registration.leftover_folders(), [], "temporary folders were left")
        super().tearDown()

    def start(self, body: str, nodes: OutputNodes | None = None, **options) -> registration.Registration:
        run = calls.start(
            self.ct,
            self.segmentation,
            STRUCTURES,
            self.xrays,
            "pelvis",
            nodes or OutputNodes(),
            command=children.command(self.folder, body),
            **options,
        )
        self.addCleanup(run.close)
        return run

    def start_with_result(self, **changes) -> registration.Registration:
        folder = scenes.save_result(
            self.folder / "given", ct_affine=scenes.affine(left_handed=True, tilt_deg=10.0), **changes
        )
        return self.start(GIVE_RESULT.format(folder=folder))

    def wait_for(self, run: registration.Registration, state: State, seconds: float = 10.0) -> None:
        deadline = time.monotonic() + seconds
        while run.poll() is not state:
            self.assertFalse(run.state.ended, f"ended as {run.state}: {run.error}")
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)

    @contextlib.contextmanager
    def nothing_added(self) -> Iterator[None]:
        before = slicer.mrmlScene.GetNumberOfNodes()
        yield
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), before)


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
        self.assertEqual((nodes.warnings, nodes.device), (("something was odd",), "cpu"))
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
        self.assertEqual(names[-2:], ["95 % along the rays [mm]", "95 % across the rays [mm]"])
        self.assertAlmostEqual(table.GetValueByName(1, names[-1]).ToDouble(), 0.2)
        self.assertEqual(set(motions_of(nodes.motions)), {"pelvis", "femur"})
        self.assertEqual(nodes.similarity.GetTable().GetNumberOfRows(), 9)
        self.assertIs(nodes.plot.GetNthPlotSeriesNode(0), nodes.series)
        intrinsics, extrinsic = scenes.camera_matrix()
        for number, node in enumerate(nodes.cameras):
            camera = camera_of(node)
            np.testing.assert_allclose(camera.extrinsic, extrinsic, atol=1e-6)
            np.testing.assert_allclose(camera.intrinsics, intrinsics)
            self.assertAlmostEqual(camera.similarity, 0.9 - number / 10)
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
        from PolyPoseLib.warp.field import DisplacementField

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


class FailureTest(RegistrationCase):
    def fails(self, body: str, kind: type[PolyPoseError], text: str) -> None:
        with self.nothing_added(), self.assertRaisesRegex(kind, text):
            self.start(body).wait()

    def test_the_childs_sentence_becomes_the_error(self) -> None:
        body = "print('WARNING: odd', file=sys.stderr)\nprint('polypose: {}', file=sys.stderr)\nsys.exit({})"
        self.fails(body.format("STUDY.json: no.", 2), InputError, "^STUDY.json: no.$")
        self.fails(body.format("memory ran out", 1), registration.RunError, "^memory ran out$")
        self.fails(body.format("interrupted", 130), CancelledError, "interrupted from outside")
        self.fails("raise ImportError('x')", registration.RunError, "x")
        self.fails("import no_such_package", registration.RunError, "'no_such_package' is missing")

    def test_success_without_a_result_is_a_failure(self) -> None:
        self.fails("pass", registration.RunError, "without a result")

    def test_a_damaged_result_is_a_failure(self) -> None:
        body = "output.mkdir()\n(output / 'result.json').write_text('{')"
        self.fails(body, InputError, "result.json")

    @unittest.skipIf(sys.platform == "win32", "signals are those of POSIX")
    def test_a_killed_child_is_explained(self) -> None:
        self.fails("os.kill(os.getpid(), signal.SIGKILL)", registration.RunError, r"signal 9\)")

    def test_rubbish_and_then_a_result(self) -> None:
        folder = scenes.save_result(self.folder / "given")
        body = children.RUBBISH + f"import shutil\nshutil.copytree({str(folder)!r}, output)\n"
        run = self.start(body)
        run.wait()
        self.assertEqual(run.similarities, [0.5])

    def test_a_program_that_cannot_be_started(self) -> None:
        run = self.start("pass")
        run._command = ["/no/such/PythonSlicer"]
        with self.assertRaisesRegex(registration.RunError, "PythonSlicer could not be started"):
            run.wait()

    def test_a_full_disk_before_the_start(self) -> None:
        usage = mock.Mock(free=1000)
        with (
            mock.patch("PolyPoseSlicer.study_writer.shutil.disk_usage", return_value=usage),
            self.assertRaisesRegex(registration.RunError, "free some space"),
        ):
            self.start("pass").wait()

    @unittest.skipIf(sys.platform == "win32", "limits are those of POSIX")
    def test_a_disk_that_fills_up_while_writing(self) -> None:
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        body = children.command(self.folder, "pass")
        self.assertTrue(Path(body[1]).is_file())
        resource.setrlimit(resource.RLIMIT_FSIZE, (8192, hard))
        try:
            run = calls.start(
                self.ct, self.segmentation, STRUCTURES, self.xrays, "pelvis", OutputNodes(), command=body
            )
            with self.assertRaisesRegex(registration.RunError, "ct.nrrd could not be written whole"):
                run.wait()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))

    def test_wrong_inputs_are_refused_before_anything_starts(self) -> None:
        good = {
            "ct": self.ct,
            "segmentation": self.segmentation,
            "structures": STRUCTURES,
            "xrays": self.xrays,
            "anchor": "pelvis",
        }
        for change, text in (
            ({"ct": None}, "No CT"),
            ({"segmentation": None}, "No segmentation"),
            ({"structures": {}}, "No structure"),
            ({"structures": {"pelvis": ["tail"]}}, "no segment named 'tail'"),
            ({"anchor": "skull"}, "'skull' is none"),
            ({"xrays": []}, "no X-ray"),
            ({"xrays": [self.segmentation]}, "'Bones' is no image"),
            ({"xrays": [self.ct]}, "choose one of them as its frame"),
        ):
            with self.assertRaisesRegex(InputError, text):
                calls.start(**{**good, **change}, nodes=OutputNodes())
        with self.assertRaisesRegex(InputError, "input and output at once"):
            calls.start(**good, nodes=OutputNodes(volume=self.ct))

    def test_an_old_slicer_is_told_so(self) -> None:
        with (
            mock.patch.object(slicer.app, "minorVersion", 8, create=True),
            self.assertRaisesRegex(InputError, r"needs 3D Slicer 5.12 or newer, and this is 5.8"),
        ):
            self.start("pass")


class CancelTest(RegistrationCase):
    def test_cancel_mid_run_within_two_seconds(self) -> None:
        run = self.start(children.IGNORE_TERMINATION)
        with self.nothing_added():
            self.wait_for(run, State.RUNNING)
            while run.progress is None:
                run.poll()
            started = time.monotonic()
            run.cancel()
            self.assertTrue(run.cancelling)
            while not run.poll().ended:
                time.sleep(0.01)
            self.assertLess(time.monotonic() - started, 2.0)
        self.assertIs(run.state, State.CANCELLED)
        self.assertIsInstance(run.error, CancelledError)
        self.assertFalse(run.cancelling)

    def test_cancel_before_the_child_starts(self) -> None:
        run = self.start("raise SystemExit('must not start')")
        run.cancel()
        with self.assertRaises(CancelledError):
            run.wait()

    def test_close_at_any_time(self) -> None:
        self.start(children.SLEEP_FOREVER).close()
        run = self.start(children.SLEEP_FOREVER)
        self.wait_for(run, State.RUNNING)
        run.close()
        self.assertIs(run.state, State.CANCELLED)
        run.close()
        deadline = time.monotonic() + 5.0
        while registration.leftover_folders() and time.monotonic() < deadline:
            time.sleep(0.01)

    def test_an_exception_in_the_progress_callback_stops_the_run(self) -> None:
        def interrupt(_event: object) -> None:
            raise KeyboardInterrupt

        run = self.start(children.SLEEP_FOREVER)
        with self.assertRaises(KeyboardInterrupt):
            run.wait(interrupt)
        self.assertIs(run.state, State.CANCELLED)

    def test_polls_are_short(self) -> None:
        run = self.start_with_result()
        longest = 0.0
        while True:
            started = time.monotonic()
            ended = run.poll().ended
            longest = max(longest, time.monotonic() - started)
            if ended:
                break
            time.sleep(0.005)
        self.assertIs(run.state, State.DONE)
        self.assertLess(longest, 0.3)  # of a small case on a busy machine; the budget is 0.05 s

    def test_closing_the_scene_while_it_runs_does_no_harm(self) -> None:
        run = self.start(children.SLEEP_FOREVER, preview=True)
        self.wait_for(run, State.RUNNING)
        slicer.mrmlScene.Clear()
        run.cancel()
        while not run.poll().ended:
            time.sleep(0.01)
        self.assertIs(run.state, State.CANCELLED)


class PreviewTest(RegistrationCase):
    def body(self) -> str:
        from PolyPoseLib.warp.field import DisplacementField

        DisplacementField(*scenes.field()).write_transform(self.folder / "field.h5")
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
