"""Trackings that are interrupted: what they have left is lost neither to a start that fails nor to a late Cancel."""

from __future__ import annotations

import unittest
from dataclasses import replace
from unittest import mock

import slicer
import track_scene_case
from PolyPoseSlicer.panel import tracking
from PolyPoseSlicer.process.study_run import State
from PolyPoseSlicer.process.track_folder import frames_kept
from PolyPoseSlicer.process.track_run import Pace
from PolyPoseSlicer.study.track_request import TrackRequest
from track_panel_case import FRAMES, TrackPanelCase

from PolyPoseLib.data.progress import Progress
from PolyPoseLib.errors import InputError


class InterruptedTest(TrackPanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill_sequences()

    def test_frames_are_kept_until_another_tracking_has_its_own(self) -> None:
        """Whatever hinders it: a package that is missing, a scene that cannot be written, a child that fails."""
        self.ask(True)
        self.keep_frames("sys.exit(1)")
        self.ui.trackButton.click()
        self.end()
        kept = self.panel.tracking._kept.output
        for where, name in ((tracking, "ensure_dependencies"), (self.panel.logic, "startTracking")):
            with mock.patch.object(where, name, side_effect=InputError("no")):
                self.ui.trackButton.click()
            self.assertEqual(self.ui.trackMessage.text, "no")
            self.assertFalse(self.panel.tracking.running)
            self.assertEqual(frames_kept(kept), 3)
        self.tracker("sys.exit(1)")
        self.ui.trackButton.click()
        self.end()
        self.assertEqual(frames_kept(kept), 3)
        self.panel.tracking.show(self.panel.parameters)
        self.assertFalse(self.ui.trackGoOn.isHidden())
        self.keep_frames("sys.exit(1)")
        self.ui.trackButton.click()
        self.end()
        self.assertEqual(frames_kept(kept), 0)
        self.assertEqual(frames_kept(self.panel.tracking._kept.output), 3)

    def test_beginning_anew_is_asked_for_where_frames_can_be_gone_on_with(self) -> None:
        asked = self.ask(False)
        self.keep_frames("sys.exit(1)")
        self.ui.trackButton.click()
        self.end()
        asked.assert_not_called()
        kept = self.panel.tracking._kept.output
        self.ui.trackButton.click()
        self.assertIn("3 frames", asked.call_args[0][0])
        self.assertFalse(self.panel.tracking.running)
        self.assertEqual(frames_kept(kept), 3)
        self.ui.trackRate.value = 25  # another tracking, which the frames are not of
        self.give_track(self.tell)
        self.ui.trackButton.click()
        self.end()
        asked.assert_called_once()
        self.assertNotIn("--resume", self.told()[0])

    def ask(self, answer: bool) -> mock.Mock:
        """What is asked with Ok and Cancel, and answered so."""
        patch = mock.patch.object(slicer.util, "confirmOkCancelDisplay", return_value=answer, create=True)
        self.addCleanup(patch.stop)
        return patch.start()

    def test_a_track_that_is_finished_is_shown_though_cancelled(self) -> None:
        """Its frames are no longer kept beside it: it would be lost."""
        flag = self.folder / "written"
        self.give_track(after=f"Path({str(flag)!r}).touch()\ntime.sleep(60)\n")
        self.ui.trackButton.click()
        self.wait(flag.exists)
        self.ui.trackButton.click()
        self.end()
        self.assertIn(f"{FRAMES} frames are tracked", self.ui.trackMessage.text)
        self.assertIsNotNone(self.panel.track_review.nodes)

    def test_a_track_that_is_being_read_is_shown_though_cancelled(self) -> None:
        distrusted = replace(track_scene_case.track(), distrust=("most frames are lost.",))
        self.give_track(found=distrusted)
        self.ui.trackButton.click()
        run = self.panel.tracking._run
        self.wait(lambda: run.state is State.LOADING or run.state.ended)
        run.cancel()
        self.end()
        self.assertIn("must not be trusted: most frames are lost", self.ui.trackMessage.text)
        self.assertIsNotNone(self.panel.track_review.nodes)

    def test_an_earlier_track_is_not_taken_for_the_one_that_was_cancelled(self) -> None:
        folder = track_scene_case.save(self.folder / "earlier")
        self.tracker("time.sleep(60)")
        run = self.panel.logic.startTracking(TrackRequest.of(self.panel.parameters), folder)
        self.wait(lambda: run.poll() is State.RUNNING)
        run.cancel()
        self.wait(lambda: run.poll().ended)
        self.assertIs(run.state, State.CANCELLED)


class PaceTest(unittest.TestCase):
    def test_every_pass_has_its_own_pace(self) -> None:
        """Tracking on both ways goes back in time twice, one pass right after the other."""
        pace = Pace()
        for iteration in range(1, 6):
            pace.took(Progress("tracking back", iteration, 5, None, 1000.0 * iteration))
        self.assertEqual(round(pace.left), 0)
        pace.took(Progress("tracking back", 0, 9, None, 5000.1))
        self.assertIsNone(pace.left)
        for iteration in range(1, 5):
            pace.took(Progress("tracking back", iteration, 9, None, 5000.1 + 2 * iteration))
        self.assertAlmostEqual(pace.left, 10.0, delta=0.5)
