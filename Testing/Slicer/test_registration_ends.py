"""Registrations that fail or are stopped: one sentence, no process, no file, no node left."""

from __future__ import annotations

import sys
import time
import unittest
from pathlib import Path
from unittest import mock

import children
import scenes
import slicer
from PolyPoseSlicer import calls
from PolyPoseSlicer.process import environment, registration
from PolyPoseSlicer.process.registration import State
from PolyPoseSlicer.study.results import OutputNodes
from registration_case import STRUCTURES, RegistrationCase

from PolyPoseLib.errors import CancelledError, InputError, PolyPoseError


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

    def test_a_crash_below_slicers_launcher_is_explained(self) -> None:
        line = "error: [/opt/Slicer/bin/python-real] exit abnormally - Report the problem."
        body = f"print({line!r}, file=sys.stderr)\nsys.exit(1)"
        self.fails(body, registration.RunError, r"ended by the system \(a crash\).*memory")

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
            mock.patch("PolyPoseSlicer.study.writer.shutil.disk_usage", return_value=usage),
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
            inputs = (self.ct, self.segmentation, STRUCTURES, self.xrays, "pelvis", OutputNodes())
            run = calls.start(calls.Request(*inputs), body)
            with self.assertRaisesRegex(registration.RunError, "ct.nrrd could not be written completely"):
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
            ({"anchor": "skull"}, "'skull' is not one of the structures"),
            ({"xrays": []}, "no X-ray"),
            ({"xrays": [self.segmentation]}, "'Bones' is not an image"),
            ({"xrays": [self.ct]}, "choose one of them as its frame"),
        ):
            with self.assertRaisesRegex(InputError, text):
                calls.start(calls.Request(**{**good, **change}, nodes=OutputNodes()))
        with self.assertRaisesRegex(InputError, "both an input and an output"):
            calls.start(calls.Request(**good, nodes=OutputNodes(volume=self.ct)))

    def test_an_old_slicer_is_told_so(self) -> None:
        with (
            mock.patch.object(environment, "slicer_version", return_value=(5, 8)),
            self.assertRaisesRegex(InputError, r"needs 3D Slicer 5.12 or newer, and this is 5.8"),
        ):
            self.start("pass")


class CancelTest(RegistrationCase):
    def test_cancel_mid_run(self) -> None:
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
            self.assertLess(time.monotonic() - started, 20.0)  # two on an idle machine
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
            started = time.thread_time()
            ended = run.poll().ended
            longest = max(longest, time.thread_time() - started)
            if ended:
                break
            time.sleep(0.005)
        self.assertIs(run.state, State.DONE)
        self.assertLess(longest, 0.3)  # its own work, reading a small result included

    def test_closing_the_scene_while_it_runs_does_no_harm(self) -> None:
        run = self.start(children.SLEEP_FOREVER, preview=True)
        self.wait_for(run, State.RUNNING)
        slicer.mrmlScene.Clear()
        run.cancel()
        while not run.poll().ended:
            time.sleep(0.01)
        self.assertIs(run.state, State.CANCELLED)


if __name__ == "__main__":
    unittest.main()
