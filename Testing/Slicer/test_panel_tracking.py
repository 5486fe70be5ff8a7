"""The Motion section: what is missing, settings, runs with real child processes, and frames of interrupted runs."""

from __future__ import annotations

import json
import os
import signal
import time
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
import scenes
import slicer
import track_scene_case
from panel_case import INSIDE_SLICER, child_processes
from PolyPoseSlicer.process.track_folder import frames_kept
from PolyPoseSlicer.scene.motions import MOTIONS_ATTRIBUTE
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.track_request import Start, TrackRequest, TrackSettings
from PolyPoseSlicer.study.xray_source import XraySource
from track_panel_case import FRAMES, TrackPanelCase

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.tracks import WITHOUT

FOREVER = "while True:\n        time.sleep(0.02)\n"


class MissingTest(TrackPanelCase):
    def says(self, short: str, sentence: str) -> None:
        self.assertEqual(self.button, short)
        self.assertFalse(self.ui.trackButton.enabled)
        self.assertIn(sentence, self.ui.trackStage.text)

    def test_the_button_says_what_is_missing_one_thing_after_the_other(self) -> None:
        self.says("Choose the bones first", "Choose the CT.")
        self.fill_sequences(known=False)
        rows = [self.source(name, known=False) for name in self.xrays]
        self.store([XraySource(scenes.add_xray())])
        self.says("Add an X-ray sequence first", "None of the X-rays is a sequence")
        self.store(rows)
        self.says("Find the cameras first", "The camera of 'left' is not known")
        self.store([self.source("left"), rows[1]])
        self.says("Find the cameras first", "The camera of 'right' is not known")
        self.store([self.source(name) for name in self.xrays])
        self.assertEqual(self.button, "Track")
        self.assertTrue(self.ui.trackButton.enabled)
        self.assertEqual(
            self.ui.trackStage.text, "Ready: 2 structures, 2 cameras, frames 0 to 15, 50 a second."
        )

    def test_frame_rates_that_are_missing_or_differ(self) -> None:
        self.fill_sequences()
        self.xrays["left"].SetIndexUnit("")
        self.panel.tracking.show(self.panel.parameters)
        self.assertEqual(self.button, "Track")  # the other sequence states it
        self.xrays["right"].SetIndexName("image")
        self.panel.tracking.show(self.panel.parameters)
        self.says("Enter the frame rate", "do not state how many frames")
        self.ui.trackRate.value = 30
        self.assertEqual(self.button, "Track")
        self.ui.trackRate.value = 0
        for name, unit in (("left", "s"), ("right", "ms")):
            self.xrays[name].SetIndexName("time")
            self.xrays[name].SetIndexUnit(unit)
        self.panel.tracking.show(self.panel.parameters)
        self.says("Enter the frame rate", "(50, 5e+04)")

    def test_offsets_come_from_the_image_that_each_row_shows(self) -> None:
        self.fill_sequences()
        self.assertIn("left: 20 images; frame 0 is image 1.", self.ui.trackState.text)
        self.assertIn("right: 20 images; frame 0 is image 5.", self.ui.trackState.text)
        self.assertIn("different numbers of images", self.ui.trackState.text)
        self.store([self.source(name, frame=7) for name in self.xrays])
        self.assertNotIn("different numbers", self.ui.trackState.text)
        self.assertEqual(self.ui.trackLast.maximum, 19)

    def test_a_range_without_frames_and_names_that_are_the_same(self) -> None:
        self.fill_sequences()
        self.ui.trackFirst.value = 9
        self.ui.trackLast.value = 3
        self.says("Check the frames", "there are 16")
        self.ui.trackFirst.value = 2
        self.assertIn("frames 2 to 3", self.ui.trackStage.text)
        sources = [self.source(name) for name in self.xrays]
        self.store([replace(each, fields={**each.fields, "name": "AP"}) for each in sources])
        self.says("Name the X-rays first", '"AP"')

    def test_bones_that_all_stand_still_and_a_start_without_result(self) -> None:
        self.fill_sequences()
        for row in range(2):
            self.ui.trackStill.item(row).setCheckState(scenes_checked())
        self.says("Let a bone move", "Every structure stands still")
        self.ui.trackStill.item(0).setCheckState(scenes_checked(False))
        self.assertEqual(self.settings.still, ("femur",))
        self.ui.trackStart.currentIndex = 2
        self.says("Register one frame first", "no result to start from")

    def test_cameras_and_poses_of_a_registration_are_kept(self) -> None:
        self.fill_sequences(known=False)
        rows = [self.source(name, known=False) for name in self.xrays]
        nodes = self.panel.logic.loadResult(scenes.save_result(self.folder / "given"))
        nodes.sources = tuple(each.identity for each in rows)
        parameters.store_outputs(self.panel.parameters, nodes)
        self.assertEqual(self.button, "Track")
        self.store(
            [self.source(name, known=False, frame=number) for name, number in (("left", 5), ("right", 9))]
        )
        self.assertEqual(self.button, "Track")  # another image of the same camera
        self.ui.trackStart.currentIndex = 2
        self.assertEqual((self.settings.start, self.ui.trackFirst.value), (Start.RESULT, 0))
        request = TrackRequest.of(self.panel.parameters)
        np.testing.assert_allclose(request.poses["pelvis"], np.eye(4), atol=1e-12)
        self.assertEqual(request.uncertain, ())
        motions = json.loads(nodes.motions.GetAttribute(MOTIONS_ATTRIBUTE))
        motions["femur"]["doubts"] = ["the X-rays determine its pose weakly"]
        nodes.motions.SetAttribute(MOTIONS_ATTRIBUTE, json.dumps(motions))
        self.assertEqual(TrackRequest.of(self.panel.parameters).uncertain, ("femur",))
        slicer.mrmlScene.RemoveNode(nodes.cameras[0])
        self.panel.tracking.show(self.panel.parameters)
        self.assertEqual(self.button, "Find the cameras first")


def scenes_checked(on: bool = True):
    """A check mark, or none."""
    import qt

    return qt.Qt.Checked if on else qt.Qt.Unchecked


class RunTest(TrackPanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill_sequences()

    def test_a_track_comes_into_the_scene_with_its_verdict(self) -> None:
        self.give_track(self.tell)
        self.ui.trackButton.click()
        self.assertEqual(self.button, "Cancel")
        self.assertFalse(self.ui.trackRate.enabled)
        self.end()
        self.assertIn(f"{FRAMES} frames are tracked", self.ui.trackMessage.text)
        self.assertIn("Check the doubtful frames", self.ui.trackVerdict.text)
        self.assertIn("femur: 2 doubtful frames, lost in 1 of them.", self.ui.trackVerdict.text)
        self.assertEqual(self.button, "Track")
        self.assertTrue(self.ui.motionSection.text.startswith("\u2713"))
        nodes = self.panel.track_review.nodes
        self.assertEqual(set(nodes.transforms), {"pelvis", "femur"})
        self.assertEqual(nodes.settings.first, {"left": 0, "right": 4})
        arguments, given = self.told()
        self.assertIn("--overwrite", arguments)
        self.assertEqual((given["reference"], given["frames_per_second"]), ("pelvis", 50.0))
        self.assertEqual([each["first"] for each in given["cameras"]], [0, 4])
        self.assertEqual(
            given["options"], {"first": 0, "last": 15, "start": "rest", "backward": True, "smooth": False}
        )

    def test_progress_says_the_frame_and_how_long_it_takes(self) -> None:
        flag = self.folder / "go"
        self.tracker(
            "def at(n, seconds, stage='tracking'):\n"
            "    step = dict(stage=stage, iteration=n, of=8, similarity=None, seconds=seconds)\n"
            "    print(json.dumps(step), flush=True)\n"
            "at(0, 1.0); at(1, 100.0); at(2, 140.0); at(3, 180.0)\n"
            f"while not Path({str(flag)!r}).exists():\n    time.sleep(0.02)\n"
            "at(0, 400.0, 'tracking back')\ntime.sleep(60)\n"
        )
        self.ui.trackButton.click()
        self.wait(lambda: "4 of 8 frames" in self.ui.trackStage.text)
        self.assertRegex(self.ui.trackStage.text, r"^Tracking: 4 of 8 frames, about 3 min left in this pass$")
        self.assertEqual((self.ui.trackProgress.value, self.ui.trackProgress.maximum), (3, 8))
        flag.touch()
        self.wait(lambda: self.ui.trackStage.text == "Back: 1 of 8 frames")

    def test_a_track_that_must_not_be_trusted_is_shown_and_said(self) -> None:
        found = replace(track_scene_case.track(), distrust=("most frames are lost.",))
        self.give_track(
            found=found,
            after="print('polypose: The track must not be trusted', file=sys.stderr)\nsys.exit(3)\n",
        )
        self.ui.trackButton.click()
        self.end()
        self.assertIn("must not be trusted", self.ui.trackMessage.text)
        self.assertIn("DO NOT TRUST THIS TRACK", self.ui.trackVerdict.text)
        self.assertIn("most frames are lost", self.ui.trackVerdict.text)

    def test_what_a_tracks_folder_lacks_is_said(self) -> None:
        sentence = f"{WITHOUT} The video needs PyAV, which is not installed: pip install av."
        self.give_track(f"print({('WARNING: ' + sentence)!r}, file=sys.stderr)\n")
        self.ui.trackButton.click()
        self.end()
        first, *others = self.ui.trackMessage.text.splitlines()
        self.assertIn("frames are tracked", first)
        self.assertEqual(others, [sentence])

    def test_the_childs_sentence_is_shown_and_nothing_changes(self) -> None:
        before = slicer.mrmlScene.GetNumberOfNodes()
        self.tracker("print('polypose: the film is torn', file=sys.stderr)\nsys.exit(2)")
        self.ui.trackButton.click()
        self.end()
        self.assertEqual(self.ui.trackMessage.text, "the film is torn")
        self.assertTrue(self.ui.trackGoOn.isHidden())
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), before)

    def test_cancel_keeps_frames_and_go_on_resumes(self) -> None:
        self.keep_frames("tell(3, of=8, stage='tracking')\n    " + FOREVER)
        self.ui.trackButton.click()
        self.wait(lambda: "4 of 8 frames" in self.ui.trackStage.text)
        self.ui.trackButton.click()
        self.assertEqual(self.button, "Cancelling...")
        self.assertFalse(self.ui.trackButton.enabled)
        self.end()
        self.assertIn("Cancelled.", self.ui.trackMessage.text)
        self.assertIn("3 frames are kept", self.ui.trackMessage.text)
        self.assertFalse(self.ui.trackGoOn.isHidden())
        self.keep_frames("sys.exit(1)")
        self.ui.trackGoOn.click()
        self.end()
        self.assertIn("6 frames are kept", self.ui.trackMessage.text)
        self.give_track(self.tell)
        self.ui.trackGoOn.click()
        self.end()
        self.assertIn("--resume", self.told()[0])
        self.assertIn("frames are tracked", self.ui.trackMessage.text)
        self.assertTrue(self.ui.trackGoOn.isHidden())

    def test_other_inputs_begin_anew_and_the_same_ones_go_on(self) -> None:
        self.keep_frames("sys.exit(1)")
        self.ui.trackButton.click()
        self.end()
        self.assertFalse(self.ui.trackGoOn.isHidden())
        self.ui.trackRate.value = 25
        self.assertTrue(self.ui.trackGoOn.isHidden())
        self.ui.trackRate.value = 0
        self.assertFalse(self.ui.trackGoOn.isHidden())
        array = slicer.util.arrayFromVolume(self.ct)
        array[0] += 1
        slicer.util.arrayFromVolumeModified(self.ct)
        self.panel.tracking.show(self.panel.parameters)
        self.assertTrue(self.ui.trackGoOn.isHidden())
        kept = self.panel.tracking._kept.output
        self.give_track(self.tell)
        self.ui.trackButton.click()
        self.assertEqual(frames_kept(kept), 3)
        self.end()
        self.assertEqual(frames_kept(kept), 0)
        self.assertNotIn("--resume", self.told()[0])

    @unittest.skipIf(os.name == "nt", "signals of POSIX")
    def test_a_process_that_is_killed_keeps_its_frames(self) -> None:
        self.keep_frames(f"Path({str(self.folder)!r}, 'pid').write_text(str(os.getpid()))\n    " + FOREVER)
        self.ui.trackButton.click()
        self.wait(lambda: (self.folder / "pid").exists() and (self.folder / "pid").read_text())
        os.kill(int((self.folder / "pid").read_text()), signal.SIGKILL)
        self.end()
        self.assertIn("ended by the system (signal 9)", self.ui.trackMessage.text)
        self.assertIn("3 frames are kept", self.ui.trackMessage.text)
        self.assertFalse(self.ui.trackGoOn.isHidden())

    def test_cancelling_while_images_are_written_starts_no_process(self) -> None:
        self.tracker("Path('started').touch()\ntime.sleep(60)")
        self.ui.trackButton.click()
        self.ui.trackButton.click()
        self.end()
        self.assertEqual(self.ui.trackMessage.text, "Cancelled; nothing was changed.")

    def test_closing_the_scene_ends_it_and_leaves_nothing(self) -> None:
        self.keep_frames(FOREVER)
        self.ui.trackButton.click()
        self.wait(lambda: "4 of 8 frames" in self.ui.trackStage.text)
        slicer.mrmlScene.Clear()
        self.assertFalse(self.panel.tracking.running)
        self.assertEqual([each for each in child_processes() if each not in self.before], [])
        self.assertEqual(self.button, "Choose the bones first")
        self.assertTrue(self.ui.trackGoOn.isHidden())

    def test_a_tracking_goes_on_while_another_module_is_open(self) -> None:
        self.give_track("time.sleep(0.5)\n")
        self.ui.trackButton.click()
        self.leave()
        self.wait(lambda: not self.panel.tracking.running)
        self.open()
        self.assertIsNotNone(self.panel.track_review.nodes)
        self.assertIn("Frame 3", self.ui.trackFrameText.text)

    def test_a_poll_does_not_hold_up_the_application(self) -> None:
        self.tracker(
            "".join(f"tell({n}, of=1000, stage='tracking')\n" for n in range(500)) + "time.sleep(60)"
        )
        self.ui.trackButton.click()
        longest = 0.0
        deadline = time.monotonic() + 20
        while "500 of 1000 frames" not in self.ui.trackStage.text and time.monotonic() < deadline:
            began = time.thread_time()  # its own work: machines are busy
            self.panel.tracking._poll()
            longest = max(longest, time.thread_time() - began)
            time.sleep(0.01)
        self.assertIn("500 of 1000", self.ui.trackStage.text)
        self.assertLess(longest, 0.06)


class SettingsTest(TrackPanelCase):
    def test_settings_reach_the_track_and_come_back_with_the_scene(self) -> None:
        self.fill_sequences()
        ui = self.ui
        ui.trackRate.value = 60
        ui.trackFirst.value, ui.trackLast.value = 3, 10
        ui.trackReference.currentIndex = 1
        ui.trackStart.currentIndex = 1
        ui.trackStill.item(0).setCheckState(scenes_checked())
        ui.trackBackward.checked = False
        ui.trackSmooth.checked = True
        expected = TrackSettings(60.0, 3, 10, "femur", ("pelvis",), Start.REGISTRATION, False, True)
        self.assertEqual(self.settings, expected)
        self.give_track(self.tell)
        ui.trackButton.click()
        self.end()
        given = self.told()[1]
        self.assertEqual((given["reference"], given["still"]), ("femur", ["pelvis"]))
        options = {"first": 3, "last": 10, "start": "registration", "backward": False, "smooth": True}
        self.assertEqual((given["options"], given["frames_per_second"]), (options, 60.0))
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.util.saveScene(path))
        slicer.mrmlScene.Clear()
        self.assertEqual(self.settings, TrackSettings())
        self.assertEqual(self._take_errors(), [])
        slicer.util.loadScene(path)
        # Slicer itself says so of every scene with a slice view that is not axial, sagittal or coronal.
        errors = [each for each in self._take_errors() if "preset name: Reformat" not in each]
        self.assertEqual(errors, [])
        self.assertEqual(self.settings, expected)
        self.assertEqual((ui.trackFirst.value, ui.trackLast.value, ui.trackRate.value), (3, 10, 60))
        self.assertEqual(ui.trackReference.currentText, "femur")
        self.assertIsNotNone(self.panel.track_review.nodes)

    def test_an_untouched_range_follows_the_images(self) -> None:
        self.fill_sequences()
        self.ui.trackRate.value = 60
        self.assertEqual((self.settings.first, self.settings.last), (None, None))
        self.ui.trackLast.value = 5
        self.ui.trackLast.value = 15
        self.assertIsNone(self.settings.last)

    def test_damaged_settings_are_the_defaults(self) -> None:
        for text in ("", "[]", "no JSON", '{"first": "x"}', '{"still": 3}', '{"start": "never"}'):
            self.assertEqual(TrackSettings.of(text), TrackSettings(), text)
        given = TrackSettings(25.0, 1, 2, "a", ("b", "c"), Start.RESULT, False, True)
        self.assertEqual(TrackSettings.of(given.text()), given)
        self.assertEqual(json.loads(TrackSettings().text()), {})


class ConsoleTest(TrackPanelCase):
    def test_track_from_the_console(self) -> None:
        self.fill_sequences()
        self.give_track(self.tell)
        seen = []
        request = TrackRequest(
            self.ct, self.segmentation, ["pelvis", "femur"], [self.source(name) for name in self.xrays]
        )
        output = self.folder / "out" / "track"
        output.parent.mkdir()
        nodes = self.panel.logic.track(request, output, seen.append)
        self.assertEqual(set(nodes.models), {"pelvis", "femur"})
        self.assertEqual(seen[-1].stage, "tracking")
        self.assertTrue((output / "track.json").is_file())
        again = self.panel.logic.showTrack(output)
        self.assertIsNot(again, nodes)
        self.assertEqual(len(slicer.util.getNodesByClass("vtkMRMLSequenceBrowserNode")), 3)

    @unittest.skipIf(INSIDE_SLICER, "runs the interpreter of the tests")
    def test_the_true_tracker_says_what_is_wrong_with_the_images(self) -> None:
        self.fill_sequences()
        array = slicer.util.arrayFromVolume(self.xrays["left"].GetNthDataNode(7))
        array[:] = np.nan
        rows = [self.source(name) for name in self.xrays]
        rows = [replace(each, fields={**each.fields, "intensity": "line_integral"}) for each in rows]
        settings = TrackSettings(first=7)
        request = TrackRequest(self.ct, self.segmentation, ["pelvis", "femur"], rows, settings)
        with self.assertRaisesRegex(InputError, "camera_0 holds NaN"):
            self.panel.logic.track(request, Path(self.folder / "out"))
        self.assertFalse((self.folder / "out").exists())


if __name__ == "__main__":
    unittest.main()
