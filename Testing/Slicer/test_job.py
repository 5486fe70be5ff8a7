"""The child process: progress, rubbish, death, cancelling its whole tree; all with real processes."""

from __future__ import annotations

import os
import sys
import time
import unittest
from collections.abc import Callable
from pathlib import Path

import children
from PolyPoseSlicer.process.job import Job, Step, step_of
from slicer_case import SlicerTestCase


def alive(pid: int) -> bool:
    """Whether a process exists and is no zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        try:
            os.kill(pid, 0)
        except OSError:
            return False
        return not Path("/proc/self/stat").exists()
    return state != "Z"


class JobTest(SlicerTestCase):
    def start(self, body: str, load_preview: Callable | None = None) -> Job:
        job = Job(children.command(self.folder, body), dict(os.environ), str(self.folder), load_preview)
        self.addCleanup(job.close)
        return job

    def run_to_end(self, job: Job, seconds: float = 20.0) -> list[Step]:
        steps, deadline = [], time.monotonic() + seconds
        while not job.finished:
            started = time.thread_time()
            steps += job.poll()
            self.assertLess(time.thread_time() - started, 0.05)  # its own work: machines are busy
            self.assertLess(time.monotonic(), deadline, "the job did not end")
            time.sleep(0.01)
        return steps

    def wait_for(self, condition: Callable[[], object], seconds: float = 20.0) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)

    def test_progress_lines_become_steps(self) -> None:
        job = self.start("for n in range(5):\n    tell(n)\nprint('bye', file=sys.stderr)\nsys.exit(3)")
        steps = self.run_to_end(job)
        self.assertEqual([step.progress.iteration for step in steps], list(range(5)))
        self.assertEqual(steps[4].progress.fraction, 0.4)
        self.assertEqual((job.exit_status, job.log), (3, ["bye"]))

    def test_rubbish_is_logged_and_does_no_harm(self) -> None:
        steps = self.run_to_end(self.start(children.RUBBISH))
        self.assertEqual(
            [(each.progress.iteration, each.progress.similarity) for each in steps], [(3, None), (4, 0.5)]
        )

    def test_a_flood_of_output_does_not_hold_the_main_thread(self) -> None:
        job = self.start("for n in range(200000):\n    print('noise' * 10)\ntell(1)")
        self.assertEqual(len(self.run_to_end(job)), 1)
        self.assertLessEqual(len(job.log), 400)

    def test_a_flood_of_progress_is_not_lost(self) -> None:
        steps = self.run_to_end(self.start("for n in range(5000):\n    tell(n)"))
        self.assertEqual([step.progress.iteration for step in steps], list(range(5000)))

    @unittest.skipIf(sys.platform == "win32", "signals are those of POSIX")
    def test_cancel_ends_a_tree_that_ignores_it(self) -> None:
        job = self.start(children.IGNORE_TERMINATION)
        note = self.folder / "grandchild.pid"
        self.wait_for(lambda: job.poll())
        grandchild = int(note.read_text())
        self.assertTrue(alive(job.pid) and alive(grandchild))
        started, worked = time.monotonic(), time.thread_time()
        job.cancel()
        self.assertLess(time.thread_time() - worked, 0.05)
        self.run_to_end(job)
        self.assertLess(time.monotonic() - started, 20.0)  # two on an idle machine
        self.assertFalse(alive(grandchild) or alive(job.pid))

    def test_close_ends_it_at_once(self) -> None:
        job = self.start(children.SLEEP_FOREVER)
        self.wait_for(lambda: job.poll())
        started = time.monotonic()
        job.close()
        self.assertLess(time.monotonic() - started, 10.0)
        self.assertTrue(job.finished)
        self.assertFalse(alive(job.pid))

    @unittest.skipIf(sys.platform == "win32", "signals are those of POSIX")
    def test_a_killed_child_is_noticed(self) -> None:
        job = self.start(children.SLEEP_FOREVER)
        self.wait_for(lambda: job.poll())
        os.kill(job.pid, 9)
        self.run_to_end(job)
        self.assertEqual(job.exit_status, -9)

    @unittest.skipIf(sys.platform == "win32", "process groups are those of POSIX")
    def test_a_descendant_that_outlives_the_child_is_ended(self) -> None:
        body = """
        grandchild = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
        Path("grandchild.pid").write_text(str(grandchild.pid))
        """
        job = self.start(body)
        self.run_to_end(job, 5.0)
        self.assertEqual(job.exit_status, 0)
        self.wait_for(lambda: not alive(int((self.folder / "grandchild.pid").read_text())))

    def test_a_program_that_does_not_exist(self) -> None:
        with self.assertRaises(OSError):
            Job(["/no/such/program"], dict(os.environ), str(self.folder))

    def test_a_preview_is_loaded_and_a_broken_one_left_out(self) -> None:
        job = self.start("tell(1, preview='good')\ntell(2, preview='bad')", {"good": 7}.__getitem__)
        self.assertEqual([step.preview for step in self.run_to_end(job)], [7, None])

    def test_only_progress_is_taken_for_progress(self) -> None:
        for line in ("", "5", "{}", '{"stage": 1}', '{"stage": "a", "iteration": 1, "of": NaN}', "[[]]"):
            self.assertIsNone(step_of(line), line)


if __name__ == "__main__":
    unittest.main()
