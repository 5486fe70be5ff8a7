"""A registration as a process: measured by the system, ended in time, and never left behind."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from cohort_case import is_alive

from PolyPoseLib.cohort import child
from PolyPoseLib.cohort.study_task import environment_of, worker_cache
from PolyPoseLib.data.cohort.job import StudyJob
from PolyPoseLib.data.cohort.settings import StudySettings

pytestmark = pytest.mark.skipif(not hasattr(os, "wait4"), reason="processes are measured by POSIX")

GUARDED = "from PolyPoseLib.cohort.guarded import watch_stdin; watch_stdin()\n"


def run(tmp_path, script, run="run", limit=None):
    """How a script ended, and what it said."""
    log = tmp_path / "log"
    end = child.run_child([sys.executable, "-c", script], dict(os.environ), log, run, limit)
    return end, log.read_text()


def test_memory_and_processor_time_are_those_of_the_process(tmp_path):
    script = "import time\nx = bytearray(300 << 20)\nx[::4096] = b'x' * len(x[::4096])\n"
    script += "while time.process_time() < 0.5: pass\nprint('done')"
    end, said = run(tmp_path, script)
    assert (end.status, said) == (0, "done\n")
    assert 300 < end.peak_memory_mib < 450 and 0.4 < end.cpu_seconds <= end.seconds + 0.5


@pytest.mark.parametrize(
    ("script", "status"), [("import sys; sys.exit(3)", 3), ("import os; os.abort()", -6)]
)
def test_its_status_is_told(tmp_path, script, status):
    end, _ = run(tmp_path, script)
    assert end.status == status and not end.late and not end.asked


def test_one_that_takes_too_long_is_ended_as_by_ctrl_c(tmp_path):
    script = GUARDED + "import signal, sys, time\nsignal.signal(signal.SIGTERM, lambda *_: sys.exit(130))\n"
    end, _ = run(tmp_path, script + "time.sleep(60)", limit=0.5)
    assert (end.status, end.late) == (130, True) and end.seconds < 20


def test_one_that_does_not_listen_is_killed_with_all_that_it_started(tmp_path, monkeypatch):
    monkeypatch.setattr(child, "_GRACE_SECONDS", 0.3)
    script = "import signal, subprocess, sys, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    script += "other = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
    script += "print(other.pid, flush=True)\ntime.sleep(60)"
    end, said = run(tmp_path, script, limit=1.0)
    assert end.status == -signal.SIGKILL and end.late
    until = time.monotonic() + 10
    while is_alive(int(said)):
        assert time.monotonic() < until
        time.sleep(0.05)


def test_the_run_that_was_ended_starts_nothing_more(tmp_path):
    threading.Timer(0.5, child.end_children, ["ended"]).start()
    end, _ = run(tmp_path, GUARDED + "import time; time.sleep(60)", run="ended")
    assert end.asked and end.seconds < 20
    assert child.run_child([sys.executable], {}, tmp_path / "log", "ended") is None
    assert child.end_children("other") == 0


def test_it_ends_when_its_starter_is_gone(tmp_path):
    script = GUARDED + "import time; time.sleep(60)"
    process = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE)
    assert process.poll() is None
    process.stdin.close()
    assert process.wait(20) == -signal.SIGTERM


def test_each_worker_has_loops_and_each_study_threads_of_its_own(monkeypatch):
    job = StudyJob("a", "/s/study.json", "/c", "studies/a", 1000, StudySettings(threads=3))
    environment = environment_of(job)
    assert environment["NUMBA_CACHE_DIR"] == worker_cache() and os.stat(worker_cache()).st_mode & 0o077 == 0
    assert {environment[name] for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS")} == {"3"}
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    usual = StudyJob("a", "/s/study.json", "/c", "studies/a", 1000, StudySettings(cache="usual"))
    assert "NUMBA_CACHE_DIR" not in environment_of(usual)
