"""What is run, what is known from earlier runs, and what becomes of systems that fail; all in this process."""

import json
import sys
from dataclasses import replace

import pytest
from benchmark_case import MY_SYSTEMS
from benchmark_home import run

from PolyPoseLib.benchmark import know_cases, processes, run_system
from PolyPoseLib.benchmark.case_reading import read_known
from PolyPoseLib.cohort.child import run_child as run_child_apart
from PolyPoseLib.data.benchmark.job import RunSettings
from PolyPoseLib.io.benchmark import simulated
from PolyPoseLib.io.benchmark.readers import READERS
from PolyPoseLib.io.benchmark.row_files import read_row


def test_what_is_finished_is_not_run_again_until_something_changes(home):
    home, started = home
    steps = []
    first = run(home, "rest", "m=my_systems:Mine", progress=steps.append)
    assert started == ["know_cases", "run_system", "run_system"]
    assert [(each.system, each.status, each.reused, each.iteration, each.of) for each in steps] == [
        ("rest", "running", False, 0, 2),
        ("rest", "done", False, 1, 2),
        ("m", "running", False, 1, 2),
        ("m", "done", False, 2, 2),
    ]
    assert json.loads(steps[3].to_json())["system"] == "m"
    started.clear()
    assert run(home, "rest", "m=my_systems:Mine", progress=steps.append) == first and not started
    assert [each.reused for each in steps] == [False] * 4 + [True, True]
    # A user's own system was changed.
    (home / "my_systems.py").write_text(MY_SYSTEMS + "\n# changed\n")
    run(home, "rest", "m=my_systems:Mine")
    assert started == ["run_system"]
    # Other settings.
    started.clear()
    run(home, "rest", settings=RunSettings(threads=2))
    assert started == ["run_system"]
    # What is asked beside the scores is not there.
    started.clear()
    rows = run(home, "rest", settings=RunSettings(threads=2), keep_fields=True)
    assert started == ["run_system"] and (home / "out/fields/case-1-own-2x60--rest.h5").is_file()
    assert rows[0]["status"] == "done" and not rows[0]["notes"]


def test_a_system_is_told_the_case_for_what_it_draws_at_random(home):
    home, _ = home
    (row,) = run(home, "my_systems:Names")
    assert row["notes"] == [row["case"]]


def test_a_system_that_knows_the_subject_is_told_of_once_and_in_its_row(home, monkeypatch, caplog):
    home, started = home
    (home / "weights").write_text("trained")
    asked = []
    monkeypatch.setattr(run_system, "trained_on", lambda *given: asked.append(given) or "truth")
    given = {"views": ("own", "2x30"), "weights": {"w": home / "weights"}}
    rows = run(home, "rest", "w=my_systems:Weighs", **given)
    assert [row["trained_on"] for row in rows] == ["", "truth", "", "truth"]
    assert [(name, path.name, case.subject) for name, path, case in asked] == [
        ("mine", "weights", "case-1")
    ] * 2
    assert caplog.text.count("w was trained on the true posture of case-1") == 1
    # A row that is kept says so, too.
    started.clear()
    caplog.clear()
    assert run(home, "rest", "w=my_systems:Weighs", **given) == rows and not started
    assert caplog.text.count("w was trained on the true posture of case-1") == 1


REASONS = {
    "Raises": ("failed", "The system failed: ZeroDivisionError: of "),
    "Leaves": ("failed", "The system failed: SystemExit: 0"),
    "NeedsMore": ("skipped", "mine needs no-such-package-4711[extra]>=2, not installed here: pip install"),
    "Refuses": ("skipped", "It takes one view, not 2: give --views 1x0."),
    "Diverges": ("failed", "The system failed: A displacement field holds NaN or infinity"),
    "Swells": ("failed", "The system failed: weights.pt: memory ran out"),
    "Weighs": ("failed", "The system failed: KeyError: 'mine'"),
    "Changes": ("failed", "it changed the study that it was given"),
    "Coarse": ("failed", "nodes 12.00 mm apart"),
    "NoFit": ("skipped", 'a method "fit(study, setting)"'),
    "Absent": ("skipped", "no class of that name"),
    "Unconstructed": ("failed", "The system could not be loaded: TypeError"),
}


def test_a_system_without_scores_has_a_row_that_says_why_and_the_others_go_on(home):
    home, started = home
    rows = run(home, *(f"my_systems:{name}" for name in REASONS), "rest")
    assert len(started) == len(REASONS) + 2 and rows[-1]["status"] == "done"
    for (name, (status, said)), row in zip(REASONS.items(), rows, strict=False):
        assert row["status"] == status and said in row["reason"] and row["reason"].isprintable()
        assert str(home / "out") not in row["reason"]
        assert row["scores"] == {}
        assert row == read_row(home / f"out/rows/case-1-own-2x60--my_systems.{name}.json")


@pytest.mark.skipif(sys.platform == "win32", reason="a crash is a signal")
def test_a_system_that_brings_its_process_down_has_a_row(home, monkeypatch):
    home, started = home
    here = processes.run_child

    def run_child(command, *more):
        return (run_child_apart if command[2].endswith("run_system") else here)(command, *more)

    monkeypatch.setattr(processes, "run_child", run_child)
    monkeypatch.setitem(
        READERS, "simulated", replace(READERS["simulated"], cases=simulated.cases)
    )  # as it reads them
    (row,) = run(home, "my_systems:Crashes")
    assert started == ["know_cases"] and row["status"] == "failed"
    assert row["reason"].startswith(
        "It was killed by the system (SIGSEGV); see logs/case-1-own-2x60--my_systems.Crashes.log"
    )
    assert row["cpu_seconds"] > 0.2 and 50 < row["peak_memory_mib"] < 2000
    log = home / "out/logs/case-1-own-2x60--my_systems.Crashes.log"
    assert "extrinsic from study.json" in log.read_text()


def test_what_has_no_scores_is_run_again_since_what_it_lacked_may_be_there_now(home):
    home, started = home
    for _ in range(2):
        run(home, "my_systems:NeedsMore")
    assert started == ["know_cases", "run_system", "run_system"]


def test_a_case_that_cannot_be_read_gives_every_system_a_row_without_a_patients_name(home, caplog):
    home, started = home
    (home / "data/case-1").rename(home / "data/Doe, John")
    (home / "data/Doe, John/truth/truth.json").write_text("{")
    (subject,) = READERS["simulated"].subjects(home / "data")
    rows = run(home, "rest", "polypose", subject=subject, views=("own", "2x30"))
    assert started == ["know_cases"] * 2
    assert [row["status"] for row in rows] == ["failed"] * 4
    assert caplog.text.count("could not be read") == 1  # the same for all systems and views
    assert all(
        row["reason"].startswith(f"The case could not be read: {subject}/truth/truth.json: ") for row in rows
    )
    texts = [path.read_text() for path in (home / "out").rglob("*") if path.is_file()]
    names = [path.name for path in (home / "out").rglob("*")]
    assert not any("Doe" in text for text in (*texts, *names, caplog.text))


def test_two_sets_of_views_that_make_cases_of_one_name_do_not_replace_each_other(home, monkeypatch):
    home, _ = home
    known = know_cases.known_cases

    def of_one_name(source):
        return tuple(replace(case, source=source) for case in known(replace(source, views="own")))

    monkeypatch.setattr(know_cases, "known_cases", of_one_name)
    monkeypatch.setattr(
        run_system,
        "read_known",
        lambda case: read_known(replace(case, source=replace(case.source, views="own"))),
    )
    rows = run(home, "rest", views=("own", "2x60"))
    assert [row["status"] for row in rows] == ["done", "failed"]
    assert "into another --output" in rows[1]["reason"] and len({row["case"] for row in rows}) == 2


def test_logs_and_rows_name_no_folder_below_the_data(home):
    """A series' folder and a file may be called after the patient as well, and a system may print paths."""
    home, _ = home
    (home / "data/case-1").rename(home / "data/Doe, John")
    (home / "my_systems.py").write_text(
        MY_SYSTEMS
        + """

class Prints(Mine):
    def fit(self, study, setting):
        import sys
        place = "DATA/Doe, John/scan of John Doe/doe.dcm"
        print("and Doe, John", place, file=sys.stderr)
        raise ValueError(place + ": it is odd")
""".replace("DATA", str(home / "data"))
    )
    (subject,) = READERS["simulated"].subjects(home / "data")
    (row,) = run(home, "my_systems:Prints", subject=subject)
    assert (
        row["reason"].startswith(f"The system failed: ValueError: {subject}/s")
        and "it is odd" in row["reason"]
    )
    texts = [path.read_text() for path in (home / "out").rglob("*") if path.is_file()]
    assert not any("doe" in text.lower() for text in texts)
    assert any(f"and {subject}" in text for text in texts)
