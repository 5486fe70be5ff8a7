"""A cohort on two real Dask workers: broken studies, crashes and killed workers cost what they must and no more."""

import csv
import json
import os
import signal
import time

import pytest
from cohort_case import is_alive, program, runs, started_run, write_cohort

from PolyPoseLib.cohort.run import Cohort, run_cohort
from PolyPoseLib.data.cohort.settings import ClusterSettings, StudySettings
from PolyPoseLib.io.cohort.cohort_folder import opened_cohort
from PolyPoseLib.io.cohort.entries import read_entries

pytest.importorskip("distributed")
pytest.importorskip("cryptography")

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="ends processes as POSIX does")

DEEDS = {
    "good": "good",
    "strange": "untrusted",
    "broken": "broken",
    "killer": "kill worker",
    "crash": "crash",
    "crash-once": "crash once",
}
MACHINES = ClusterSettings(workers=2, cores=1, memory_mib=4096, retries=2)


def run(home, output, **study):
    """Register the list in a folder; verdicts by study, the rows of the table, and the steps that were told."""
    steps = []
    with opened_cohort(output, home) as folder:
        settings = StudySettings(program=program(home), cache="usual", **study)
        entries = read_entries(home / "list.csv", False)
        summaries = run_cohort(Cohort(entries, folder, settings, MACHINES), steps.append)
    with (output / "summary.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    return {each.outcome.identity: each.outcome for each in summaries}, rows, steps


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """The first run of a cohort that holds everything that can go wrong."""
    home = tmp_path_factory.mktemp("cohort") / "studies"
    write_cohort(home, DEEDS)
    output = home.parent / "registered"
    return home, output, *run(home, output), runs(home)


def test_every_study_has_its_verdict_whatever_became_of_the_others(first):
    _, _, outcomes, rows, steps, _ = first
    assert {name: each.verdict for name, each in outcomes.items()} == {
        "good": "done",
        "strange": "untrusted",
        "broken": "wrong input",
        "killer": "done",
        "crash": "failed",
        "crash-once": "done",
    }
    assert {row["study"] for row in rows} == set(DEEDS)
    assert [step.iteration for step in steps] == [1, 2, 3, 4, 5, 6] and steps[-1].of == 6
    assert (steps[-1].untrusted, steps[-1].failed) == (1, 2)


def test_what_was_killed_is_tried_again_and_what_was_wrong_is_not(first):
    started = [name for name, _, _ in first[5]]
    counts = {name: started.count(name) for name in DEEDS}
    assert counts == {"good": 1, "strange": 1, "broken": 1, "killer": 2, "crash": 3, "crash-once": 2}


def test_a_study_that_crashed_is_tried_on_another_worker(first):
    workers = [worker for name, _, worker in first[5] if name == "crash-once"]
    assert len(set(workers)) == 2


def test_the_registration_of_a_killed_worker_ends_with_it(first):
    process = next(own for name, own, _ in first[5] if name == "killer")
    assert not is_alive(process)


def test_rows_tell_reasons_and_measurements(first):
    home, output, outcomes, rows, _, _ = first
    by_study = {row["study"]: row for row in rows}
    assert by_study["broken"]["reasons"] == 'study.json: the field "anchor" is missing: add it'
    assert by_study["broken"]["structure"] == "" and by_study["broken"]["exit_status"] == "2"
    assert "SIGSEGV" in by_study["crash"]["reasons"] and by_study["crash"]["attempts"] == "3"
    assert by_study["strange"]["reasons"] == "no X-ray shows <b>the pelvis</b>"
    femur = next(row for row in rows if (row["study"], row["structure"]) == ("good", "femur"))
    stored = json.loads((output / "studies/good/result.json").read_text())["structures"]["femur"]
    assert float(femur["rotation_deg"]) == pytest.approx(stored["motion"]["rotation_deg"], rel=1e-4)
    assert float(femur["across_mm"]) == max(stored["uncertainty"]["across_mm"])
    assert 5 < outcomes["good"].peak_memory_mib < 500 and 0 < outcomes["good"].cpu_seconds < 30
    log = (output / "logs/crash.log").read_text()
    assert log.count("INFO: it began") == 3 and "attempt 3" in log
    assert "scheduler" in (output / "logs/workers/workers.log").read_text()
    assert not list(home.rglob("*.partial"))


def test_the_page_lists_the_worst_first_and_escapes_what_results_say(first):
    page = (first[1] / "index.html").read_text()
    places = [page.index(f">{name}<") for name in ("crash", "broken", "strange", "good")]
    assert places == sorted(places)
    assert "<b>the pelvis" not in page and "&lt;b&gt;the pelvis" in page
    assert 'href="studies/good/report.html"' in page and 'href="logs/crash.log"' in page
    assert 'href="studies/broken' not in page
    assert "<script" not in page and "default-src" in page


def test_the_second_run_starts_what_is_new_changed_or_was_killed_and_nothing_else(first):
    home, output, *_ = first
    before = runs(home)
    study = json.loads((home / "good/study.json").read_text())
    study["xrays"][0]["source_to_detector_mm"] = 1021
    (home / "good/study.json").write_text(json.dumps(study))
    image = home / "killer/ap.nii.gz"
    image.write_bytes(image.read_bytes() + b"\0")
    outcomes, _, steps = run(home, output)
    started = [name for name, _, _ in runs(home)[len(before) :]]
    assert sorted(set(started)) == ["crash", "good", "killer"]
    assert started.count("good") == started.count("killer") == 1
    assert {step.study for step in steps if step.reused} == {"strange", "broken", "crash-once"}
    assert outcomes["strange"].verdict == "untrusted" and outcomes["broken"].verdict == "wrong input"


def test_an_interrupt_ends_the_registrations_and_keeps_what_is_finished(tmp_path):
    home, output = tmp_path / "studies", tmp_path / "registered"
    write_cohort(home, {"quick": "good", "slow": "slow"})

    def interrupt(step):
        assert (step.study, step.verdict) == ("quick", "done")
        wait_until(lambda: "slow" in {name for name, _, _ in runs(home)})
        raise KeyboardInterrupt

    with opened_cohort(output, home) as folder, pytest.raises(KeyboardInterrupt, match="1 of 2 studies have"):
        settings = StudySettings(program=program(home), cache="usual")
        run_cohort(Cohort(read_entries(home / "list.csv", False), folder, settings, MACHINES), interrupt)
    check_interrupted(home, output, {"quick": "done", "slow": "not run"})


@pytest.mark.long
def test_ctrl_c_in_a_terminal_ends_it_in_order(tmp_path):
    home, output = tmp_path / "studies", tmp_path / "registered"
    write_cohort(home, {"quick": "good", "slow-1": "slow", "slow-2": "slow"})
    process = started_run(home, output, workers=2, cores=1, memory_mib=4096)
    try:
        wait_until(lambda: {"slow-1", "slow-2"} <= {name for name, _, _ in runs(home)})
        wait_until((output / "outcomes/quick.json").exists)
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert "1 of 3 studies have a result" in err and "Traceback" not in err, err
    check_interrupted(home, output, {"quick": "done", "slow-1": "not run", "slow-2": "not run"})


@pytest.mark.long
def test_a_coordinator_that_is_killed_takes_its_registrations_along(tmp_path):
    home, output = tmp_path / "studies", tmp_path / "registered"
    write_cohort(home, {"slow-1": "slow", "slow-2": "slow"})
    process = started_run(home, output, workers=2, cores=1, memory_mib=4096)
    try:
        wait_until(lambda: len(runs(home)) == 2)
    finally:
        process.kill()
        process.communicate(timeout=60)
    wait_until(lambda: not any(is_alive(own) for _, own, _ in runs(home)))


def check_interrupted(home, output, verdicts):
    """No registration runs on, and the table tells what is finished."""
    assert not any(is_alive(own) for _, own, _ in runs(home))
    with (output / "summary.csv").open(newline="") as stream:
        assert {row["study"]: row["verdict"] for row in csv.DictReader(stream)} == verdicts
    assert [each.name for each in (output / "outcomes").iterdir()] == ["quick.json"]


def wait_until(condition, seconds=60):
    """Wait for something that other processes do."""
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not happen"
        time.sleep(0.05)
