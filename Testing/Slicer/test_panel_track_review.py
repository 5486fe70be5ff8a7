"""The Motion section once there is a track: doubtful frames, corrections by hand, tracking on, and saving."""

from __future__ import annotations

import json
import unittest
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import scenes
import slicer
import track_scene_case
from PolyPoseSlicer.process.track_folder import TRACKS
from PolyPoseSlicer.scene.frames import flip_map
from track_panel_case import TrackPanelCase
from track_scene_case import DOUBTFUL, FIRST, LOST

from PolyPoseLib.io.tracking.corrected_poses import read_corrected_poses
from PolyPoseLib.io.tracking.tracks import load_track

KEEP_CONTINUATION = """
import shutil
given = dict(zip(arguments, arguments[1:]))
shutil.copytree(given["--continue"], {folder!r} + "/earlier")
if "--poses" in given:
    shutil.copy(given["--poses"], {folder!r} + "/poses.json")
"""


class ReviewCase(TrackPanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill_sequences()
        self.given = self.give_track()
        self.ui.trackButton.click()
        self.end()
        self.review = self.panel.track_review
        self.nodes = self.review.nodes

    def choose(self, name: str) -> None:
        self.ui.trackBone.currentIndex = self.ui.trackBone.findText(name)

    def correct(self, name: str, degrees: float = 5.0) -> np.ndarray:
        """Drag a bone by its handles; returns how, (4, 4) RAS mm."""
        self.choose(name)
        self.ui.trackCorrect.checked = True
        motion = scenes.rotation((0, 0, 1), degrees)
        motion[:3, 3] = (1, 2, 3)
        self.move(name, motion)
        return motion

    def tracked(self, name: str) -> np.ndarray:
        """Where the track has a bone in the frame that is shown."""
        return track_scene_case.pose(list(track_scene_case.NAMES).index(name), self.nodes.frame)


class FramesTest(ReviewCase):
    def test_doubtful_frames_are_gone_to_in_both_directions_and_explained(self) -> None:
        self.assertIn(f"Frame {FIRST}", self.ui.trackFrameText.text)
        self.ui.trackNext.click()
        self.assertEqual(self.nodes.frame, DOUBTFUL)
        self.assertIn("femur is doubtful: the X-rays contradict it.", self.ui.trackFrameText.text)
        self.ui.trackNext.click()
        self.assertEqual(self.nodes.frame, LOST)
        self.assertIn("femur was lost.", self.ui.trackFrameText.text)
        self.assertTrue(self.ui.trackNext.toolTip.startswith("0 "))
        self.ui.trackNext.click()
        self.assertEqual(self.nodes.frame, LOST)
        self.ui.trackPrevious.click()
        self.assertEqual(self.nodes.frame, DOUBTFUL)

    def test_leaving_the_module_follows_nothing_and_the_track_is_there_again(self) -> None:
        self.leave()
        self.assertEqual({each[0] for each in self.host.Observations}, {slicer.mrmlScene})
        self.open()
        self.assertIs(self.panel.track_review.nodes, self.nodes)
        self.nodes.go_to(DOUBTFUL)
        self.assertIn(f"Frame {DOUBTFUL}", self.ui.trackFrameText.text)

    def test_a_track_that_is_deleted_leaves_the_section(self) -> None:
        self.nodes.remove()
        self.panel._changed()
        self.assertIsNone(self.review.nodes)
        self.assertTrue(self.ui.trackBox.isHidden())


class CorrectionTest(ReviewCase):
    def test_a_correction_is_kept_when_another_frame_is_shown_and_undone(self) -> None:
        motion = self.correct("femur")
        expected = self.tracked("femur") @ np.linalg.inv(flip_map(motion))
        np.testing.assert_allclose(self.nodes.pose_at_current("femur"), expected, atol=1e-9)
        self.nodes.go_to(FIRST + 1)
        self.assertEqual(self.nodes.poses_changed(), {})
        np.testing.assert_allclose(self.nodes.pose_at_current("femur"), self.tracked("femur"), atol=1e-9)
        self.assertNotIn("Corrected", self.ui.trackFrameText.text)
        self.nodes.go_to(FIRST)
        self.assertEqual(list(self.nodes.poses_changed()), ["femur"])
        np.testing.assert_allclose(self.nodes.pose_at_current("femur"), expected, atol=1e-9)
        self.assertIn("Corrected by hand: femur.", self.ui.trackFrameText.text)
        self.ui.trackUndo.click()
        np.testing.assert_allclose(self.nodes.pose_at_current("femur"), self.tracked("femur"), atol=1e-9)
        self.assertNotIn("Corrected", self.ui.trackFrameText.text)

    def test_corrections_of_two_bones_and_of_several_frames_are_kept(self) -> None:
        self.correct("femur")
        self.correct("pelvis")
        self.nodes.go_to(DOUBTFUL)
        self.move("pelvis", scenes.rotation((1, 0, 0), 3.0))
        self.ui.trackCorrect.checked = False
        self.assertIsNone(self.nodes.correcting)
        self.nodes.go_to(FIRST)
        self.assertEqual(set(self.nodes.poses_changed()), {"femur", "pelvis"})
        self.assertEqual(self.nodes.corrected_frames("pelvis"), [FIRST, DOUBTFUL])
        self.assertEqual(self.nodes.corrected_frames("femur"), [FIRST])

    def test_a_doubtful_frame_that_was_corrected_is_not_gone_to_any_more(self) -> None:
        self.nodes.go_to(DOUBTFUL)
        self.correct("femur")
        self.nodes.go_to(FIRST)
        self.ui.trackNext.click()
        self.assertEqual(self.nodes.frame, LOST)
        self.nodes.go_to(DOUBTFUL)
        self.ui.trackUndo.click()
        self.nodes.go_to(FIRST)
        self.ui.trackNext.click()
        self.assertEqual(self.nodes.frame, DOUBTFUL)

    def test_playing_corrects_nothing(self) -> None:
        self.ui.trackCorrect.checked = True
        for frame in [*range(FIRST, FIRST + track_scene_case.FRAMES), *range(FIRST, LOST)]:
            self.nodes.go_to(frame)
        self.assertEqual([self.nodes.corrected_frames(name) for name in self.nodes.names], [[], []])

    def test_tracking_on_hands_over_the_track_and_the_corrected_poses(self) -> None:
        self.nodes.go_to(DOUBTFUL)
        motion = self.correct("femur")
        expected = self.tracked("femur") @ np.linalg.inv(flip_map(motion))
        self.ui.trackDirection.currentIndex = 1
        self.give_track(self.tell + KEEP_CONTINUATION.format(folder=str(self.folder)))
        self.ui.trackOn.click()
        self.assertFalse(self.ui.trackOn.enabled)
        self.end()
        arguments = self.told()[0]
        given = dict(pairwise(arguments))
        self.assertEqual((given["--at"], given["--direction"]), (str(DOUBTFUL), "forward"))
        poses = read_corrected_poses(self.folder / "poses.json", track_scene_case.NAMES)
        self.assertEqual(list(poses), ["femur"])
        np.testing.assert_allclose(poses["femur"], expected, atol=1e-9)
        earlier = load_track(self.folder / "earlier")
        np.testing.assert_array_equal(earlier.poses, load_track(self.given).poses)
        self.assertEqual(self.panel.track_review.nodes.frame, DOUBTFUL)
        self.assertEqual(self.panel.track_review.nodes.poses_changed(), {})
        self.assertEqual(len(slicer.util.getNodesByClass("vtkMRMLSequenceBrowserNode")), 3)

    def test_tracking_on_leaves_corrections_of_other_frames(self) -> None:
        self.nodes.go_to(LOST)
        self.correct("femur")
        placed = self.nodes.pose_at_current("femur")
        self.nodes.go_to(DOUBTFUL)
        self.correct("pelvis")
        self.give_track()
        self.ui.trackOn.click()
        self.end()
        after = self.panel.track_review.nodes
        self.assertIsNot(after, self.nodes)
        self.assertEqual([after.corrected_frames(name) for name in ("pelvis", "femur")], [[], [LOST]])
        after.go_to(LOST)
        np.testing.assert_allclose(after.pose_at_current("femur"), placed, atol=1e-9)
        self.assertIn("Corrected by hand: femur.", self.ui.trackFrameText.text)

    def test_tracking_anew_leaves_no_correction(self) -> None:
        self.correct("femur")
        self.ui.trackCorrect.checked = False
        self.ui.trackButton.click()
        self.end()
        self.assertEqual(self.panel.track_review.nodes.corrected_frames("femur"), [])

    def test_a_track_that_cannot_be_shown_is_not_lost(self) -> None:
        self.nodes.remove()
        self.give_track()
        self.ui.trackButton.click()
        content = self.segmentation.GetSegmentation()
        content.RemoveSegment(content.GetSegmentIdBySegmentName("femur"))
        self.end()
        folder = self.ui.trackMessage.text.rpartition(" is in ")[2].partition(" until ")[0]
        self.assertEqual(load_track(folder).names, track_scene_case.NAMES)

    def test_tracking_on_without_a_correction_starts_from_the_tracked_poses(self) -> None:
        self.give_track(self.tell)
        self.ui.trackOn.click()
        self.end()
        self.assertIn("--continue", self.told()[0])
        self.assertNotIn("--poses", self.told()[0])

    def test_an_interrupted_continuation_is_gone_on_with(self) -> None:
        self.correct("femur")
        self.keep_frames("sys.exit(1)")
        self.ui.trackOn.click()
        self.end()
        self.assertIn("3 frames are kept", self.ui.trackMessage.text)
        self.give_track(self.tell)
        self.ui.trackGoOn.click()
        self.end()
        arguments = self.told()[0]
        self.assertTrue({"--continue", "--poses", "--resume"} <= set(arguments))

    def test_a_smoothed_track_says_why_it_cannot_be_gone_on_with(self) -> None:
        self.give_track(found=replace(track_scene_case.track(), smoothed=True))
        self.ui.trackButton.click()
        self.end()
        self.assertFalse(self.ui.trackOn.enabled)
        self.assertIn("smoothed", self.ui.trackOn.toolTip)


class SavingTest(ReviewCase):
    def save(self, folder: Path) -> None:
        self.review.save(str(folder))
        self.wait(lambda: self.ui.trackSave.enabled)

    def test_the_whole_folder_is_saved(self) -> None:
        target = self.folder / "saved"
        target.mkdir()
        self.save(target)
        names = {each.relative_to(self.given).as_posix() for each in self.given.rglob("*")}
        self.assertEqual({each.relative_to(target).as_posix() for each in target.rglob("*")}, names)
        self.assertIn("poses.csv", names)
        self.save(target)
        self.assertTrue((target / "PolyPose-track" / "track.json").is_file())
        self.assertEqual(self.ui.trackMessage.text, f"Written to {target / 'PolyPose-track'}.")

    def test_a_scene_that_was_opened_again_saves_the_poses_and_tracks_on(self) -> None:
        self.nodes.go_to(DOUBTFUL)
        self.correct("femur")
        self.ui.trackCorrect.checked = False
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.util.saveScene(path))
        slicer.mrmlScene.Clear()
        TRACKS.remove()
        slicer.util.loadScene(path)
        self._take_errors()  # of slice views, see test_panel_tracking
        nodes = self.panel.track_review.nodes
        self.assertIsNotNone(nodes)
        nodes.go_to(DOUBTFUL)
        self.assertEqual(list(nodes.poses_changed()), ["femur"])
        self.review = self.panel.track_review
        self.save(self.folder / "saved")
        self.assertIn("poses alone", self.ui.trackMessage.text)
        self.assertIn("Corrections are not in it", self.ui.trackMessage.text)
        found, expected = load_track(self.folder / "saved"), load_track(self.given)
        np.testing.assert_array_equal(found.poses, expected.poses)
        self.give_track(self.tell + KEEP_CONTINUATION.format(folder=str(self.folder)))
        self.assertTrue(self.ui.trackOn.enabled, self.ui.trackOn.toolTip)
        self.ui.trackOn.click()
        self.end()
        self.assertTrue((self.folder / "poses.json").is_file())
        self.assertEqual(json.loads((self.folder / "poses.json").read_text())["version"], 1)


if __name__ == "__main__":
    unittest.main()
