"""Studies on a scheduler that is running already, whose workers stay: what they offer is kept to, and they are left."""

import errno
import json
import os
import threading
import time
from types import SimpleNamespace

import pytest
from cohort_case import is_alive, program, runs, write_cohort

from PolyPoseLib.cohort import dispatch
from PolyPoseLib.cohort.clusters import Machines, machines
from PolyPoseLib.cohort.dispatch import Dispatcher
from PolyPoseLib.data.cohort.job import StudyJob
from PolyPoseLib.data.cohort.outcome import Outcome
from PolyPoseLib.data.cohort.settings import MEMORY, THREADS, ClusterSettings, StudySettings
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.cohort_folder import opened_cohort
from PolyPoseLib.io.cohort.entries import read_entries

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="ends processes as POSIX does")


@pytest.fixture(scope="module")
def scheduler():
    """A running scheduler with one worker of two threads, whose memory is enough for one small study at a time."""
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=2,
        processes=False,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address=None,
        resources={THREADS: 2, MEMORY: 1500},
    ) as cluster:
        yield cluster.scheduler_address


@pytest.fixture
def home(tmp_path):
    return tmp_path / "studies"


def jobs_of(home, folder, memory=1000, **settings):
    """The studies of a list, as they are sent to workers."""
    study = StudySettings(program=program(home), cache="usual", **settings)
    return [
        StudyJob(each.identity, str(each.study), str(folder), str(each.place), memory, study)
        for each in read_entries(home / "list.csv", False)
    ]


def test_no_more_runs_at_a_time_than_the_memory_allows(scheduler, home, tmp_path):
    write_cohort(home, {"one": "brief", "two": "brief"})
    with opened_cohort(tmp_path / "out", home) as folder, machines(ClusterSettings(scheduler), folder) as at:
        assert at.resources == {THREADS: 2, MEMORY: 1500}
        outcomes = list(Dispatcher(at, "run", 0).outcomes(jobs_of(home, folder)))
    assert [each.verdict for each in outcomes] == ["done", "done"]
    (began, ended), later = sorted(json.loads(path.read_text()) for path in home.glob("*.times"))
    assert began < ended <= later[0]


def test_a_study_that_no_worker_could_hold_is_refused_and_not_waited_for(scheduler, home, tmp_path):
    write_cohort(home, {"one": "good"})
    with opened_cohort(tmp_path / "out", home) as folder, machines(ClusterSettings(scheduler), folder) as at:
        (large,) = Dispatcher(at, "run", 0).outcomes(jobs_of(home, folder, memory=2000))
        (wide,) = Dispatcher(at, "run", 0).outcomes(jobs_of(home, folder, threads=3))
    assert large.exit_status == wide.exit_status == 2
    assert "2000 MiB" in large.reason and "3 threads" in wide.reason
    assert not runs(home)


def test_the_end_of_a_run_ends_its_registrations_on_workers_that_stay(scheduler, home, tmp_path):
    write_cohort(home, {"one": "slow", "two": "good"})
    with opened_cohort(tmp_path / "out", home) as folder, machines(ClusterSettings(scheduler), folder) as at:
        dispatcher = Dispatcher(at, "ended early", 0)
        waiting = dispatcher.outcomes(jobs_of(home, folder, memory=700))
        first = next(waiting)
        assert first.identity == "two", first
        wait_until(lambda: len(runs(home)) == 2)
        dispatcher.end()
        wait_until(lambda: not any(is_alive(own) for _, own, _ in runs(home)))
        assert list(waiting) == []
        assert [path.name for path in (folder / "outcomes").iterdir()] == ["two.json"]
        (again,) = Dispatcher(at, "begun later", 0).outcomes(jobs_of(home, folder, memory=700)[1:])
        assert again.reused


def test_one_that_takes_too_long_is_a_row_and_is_not_tried_again(scheduler, home, tmp_path):
    write_cohort(home, {"one": "slow"})
    with opened_cohort(tmp_path / "out", home) as folder, machines(ClusterSettings(scheduler), folder) as at:
        (late,) = Dispatcher(at, "late", 2).outcomes(jobs_of(home, folder, limit_seconds=1.0))
    assert late.verdict == "failed" and "longer than the limit of 1 s" in late.reason and len(runs(home)) == 1


def test_workers_that_do_not_see_the_folder_or_have_another_version_are_refused(
    scheduler, tmp_path, monkeypatch
):
    (tmp_path / "logs/workers").mkdir(parents=True)
    for answer, said in (((0, True), "has PolyPose 0"), ((dispatch_version(), False), "does not see")):
        monkeypatch.setattr("PolyPoseLib.cohort.clusters.worker_view", lambda folder, answer=answer: answer)
        with pytest.raises(InputError, match=said), machines(ClusterSettings(scheduler), tmp_path):
            pass


def dispatch_version():
    from PolyPoseLib import __version__

    return __version__


class Client:
    """A scheduler's client whose workers come and go as a test wants."""

    def __init__(self, *workers):
        self.workers = {each: {"resources": {THREADS: 1, MEMORY: 4000}} for each in workers}
        self.submitted = []

    def scheduler_info(self, n_workers):
        return {"workers": self.workers}

    def who_has(self, futures):
        return {"key": (futures[0].worker,)}

    def submit(self, function, job, run, **settings):
        future = SimpleNamespace(settings=settings, status="pending", cancelled=False, told=[], worker=None)
        future.cancel = lambda force: setattr(future, "cancelled", True)
        future.add_done_callback = future.told.append
        future.exception = lambda: None
        self.submitted.append(future)
        return future


def finish(future, worker, outcome):
    """Let a worker have ended a study."""
    future.worker, future.status, future.result = worker, "finished", lambda: outcome
    future.told[0](future)


def test_a_study_waits_for_no_worker_that_is_gone(monkeypatch):
    monkeypatch.setattr(dispatch, "_TICK_SECONDS", 0.02)
    client, found = Client("a", "b"), []
    dispatcher = Dispatcher(Machines(client, "", {THREADS: 1, MEMORY: 4000}), "run", 2)
    job = StudyJob("one", "/s/study.json", "/c", "studies/one", 1000, StudySettings())
    thread = threading.Thread(target=lambda: found.extend(dispatcher.outcomes([job])), daemon=True)
    thread.start()
    wait_until(lambda: len(client.submitted) == 1)
    assert client.submitted[0].settings["workers"] is None
    assert client.submitted[0].settings["resources"] == {THREADS: 1, MEMORY: 1000}
    finish(client.submitted[0], "a", Outcome("one", -9, "It was killed.", transient=True))
    wait_until(lambda: len(client.submitted) == 2)
    assert client.submitted[1].settings["workers"] == ["b"]
    assert client.submitted[1].settings["resources"] == {THREADS: 1, MEMORY: 1500}, (
        "it may have lacked memory"
    )
    del client.workers["b"]
    wait_until(lambda: len(client.submitted) == 3)
    assert len({each.settings["key"] for each in client.submitted}) == 3
    assert client.submitted[1].cancelled and client.submitted[2].settings["workers"] is None
    finish(client.submitted[2], "a", Outcome("one", 0))
    thread.join(10)
    assert [each.verdict for each in found] == ["done"]


def test_a_full_disk_is_told_in_plain_words():
    client, job = Client("a"), StudyJob("one", "/s/study.json", "/c", "studies/one", 1000, StudySettings())
    submit = client.submit

    def failed(*given, **settings):
        future = submit(*given, **settings)
        future.status, future.exception = "error", lambda: OSError(errno.ENOSPC, "No space left on device")
        future.add_done_callback = lambda tell: tell(future)
        return future

    client.submit = failed
    (outcome,) = Dispatcher(Machines(client, "", None), "run", 0).outcomes([job])
    assert outcome.reason.startswith("The disk is full: free some space") and outcome.transient


def wait_until(condition, seconds=30):
    """Wait for something that others do."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not happen"
        time.sleep(0.02)
