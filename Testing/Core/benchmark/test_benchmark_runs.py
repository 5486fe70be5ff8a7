"""What is run, what is known from earlier runs, and what becomes of systems that fail; all in this process."""

import json
import os
import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest
import SimpleITK as sitk
from benchmark_case import MY_SYSTEMS, write_benchmark_data

from PolyPoseLib import benchmark
from PolyPoseLib.benchmark import know_cases, processes, run_system
from PolyPoseLib.benchmark import run as benchmark_run
from PolyPoseLib.benchmark.case_reading import read_known
from PolyPoseLib.benchmark.run import Benchmark, comparable_rows, run_benchmark
from PolyPoseLib.benchmark.systems import named_systems
from PolyPoseLib.cohort.child import ChildEnd
from PolyPoseLib.cohort.child import run_child as run_child_apart
from PolyPoseLib.data.benchmark.job import CaseSource, RunSettings
from PolyPoseLib.evaluation.benchmark.statistics import tables_of
from PolyPoseLib.io.benchmark import simulated, two_scans
from PolyPoseLib.io.benchmark.benchmark_folder import opened_benchmark
from PolyPoseLib.io.benchmark.readers import READERS
from PolyPoseLib.io.benchmark.row_files import read_row, write_row

MAINS = {f"{benchmark.__name__}.{each}": globals()[each].main for each in ("know_cases", "run_system")}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_benchmark_data(tmp_path_factory.mktemp("simulated") / "data")


@pytest.fixture
def home(tmp_path, written, monkeypatch):
    """A folder with data and systems, in which processes are calls within this one, one after another."""
    shutil.copytree(written, tmp_path / "data")
    (tmp_path / "my_systems.py").write_text(MY_SYSTEMS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    started = []

    def run_child(command, environment, log, run, limit):
        started.append(command[2].rpartition(".")[2])
        sys.modules.pop("my_systems", None)
        said = sys.stderr
        with log.open("a") as sys.stderr:
            try:
                status = MAINS[command[2]](command[3:])
            finally:
                sys.stderr = said
        return ChildEnd(status, 1.0, 1.0, 1.0, False, False)

    def cases(root, subject, views):
        for case in reader.cases(root, subject, views):
            # Their silhouettes take most of the time, and are of no matter here.
            yield replace(case, truth=replace(case.truth, held_out=()))

    reader = READERS["simulated"]
    monkeypatch.setitem(READERS, "simulated", replace(reader, cases=cases))
    for module in (know_cases, run_system):
        monkeypatch.setattr(module, "begin", lambda: None)
    monkeypatch.setattr(processes, "run_child", run_child)
    yield tmp_path, started
    sys.modules.pop("my_systems", None)


def run(home, *methods, views=("own",), subject="case-1", progress=lambda step: None, **more):
    """The rows of a run of these systems."""
    data = home / "data"
    more = {"settings": RunSettings(), **more}
    with opened_benchmark(home / "out", "simulated", data, True) as folder:
        sources = tuple(CaseSource("simulated", str(data), subject, each) for each in views)
        return run_benchmark(Benchmark(sources, named_systems(methods), folder, **more), progress)


def change_one_voxel(home):
    """Of the CT, by 1 HU."""
    path = str(home / "data/case-1/ct.nii.gz")
    image = sitk.ReadImage(path)
    image[3, 4, 5] += 1
    sitk.WriteImage(image, path)


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


def test_changed_data_are_read_and_run_again_and_touched_ones_only_read(home):
    home, started = home
    first = run(home, "rest")
    started.clear()
    ct = home / "data/case-1/ct.nii.gz"
    os.utime(ct, (1, 1))
    assert run(home, "rest") == first and started == ["know_cases"]
    started.clear()
    change_one_voxel(home)
    (row,) = run(home, "rest")
    assert started == ["know_cases", "run_system"] and row["case_digest"] != first[0]["case_digest"]


def test_data_that_change_between_reading_and_running_give_no_scores(home, monkeypatch):
    home, _ = home
    known = know_cases.known_cases

    def changed_afterwards(source):
        cases = known(source)
        change_one_voxel(home)
        return cases

    monkeypatch.setattr(know_cases, "known_cases", changed_afterwards)
    (row,) = run(home, "rest")
    assert row["status"] == "failed" and "have changed meanwhile" in row["reason"]


@pytest.fixture
def projector(monkeypatch):
    """Sets the projector's name and by how much its pictures are off."""

    def is_now(name, off=0.0):
        def project(attenuation, camera):
            drawn = np.random.default_rng(0).random((camera.height, camera.width)) + off
            return drawn.astype(np.float32)

        monkeypatch.setattr(two_scans, "project", project)
        for module in (two_scans, benchmark_run):
            monkeypatch.setattr(module, "projector_name", lambda: name)

    return is_now


def test_the_last_bits_of_what_is_computed_are_no_change_of_the_data(home, projector):
    """Processors and versions of libraries differ in them: the benchmark would never end."""
    home, started = home
    projector("rtk 1")
    first = run(home, "rest", views=("2x30",))
    projector("rtk 1", 1e-6)
    rows = run(home, "rest", "m=my_systems:Mine", views=("2x30",))
    assert rows[0] == first[0] and [row["status"] for row in rows] == ["done", "done"]
    assert started == ["know_cases", "run_system", "run_system"]
    os.utime(home / "data/case-1/ct.nii.gz", (1, 1))  # read again, it is still the same case
    assert run(home, "rest", views=("2x30",)) == first


def test_cases_are_run_again_with_another_projector_but_not_those_whose_x_rays_are_given(home, projector):
    home, started = home
    projector("rtk 1")
    first = run(home, "rest", views=("own", "2x30"))
    projector("sum", 1e-2)
    started.clear()
    rows = run(home, "rest", views=("own", "2x30"))
    assert rows[0] == first[0] and [row["status"] for row in rows] == ["done", "done"]
    assert rows[1]["case_digest"] != first[1]["case_digest"]
    assert started == ["know_cases", "know_cases", "run_system"]
    started.clear()
    assert run(home, "rest", views=("own", "2x30")) == rows and not started


def test_a_projector_that_changes_between_reading_and_running_gives_no_scores(home, projector, monkeypatch):
    home, _ = home
    projector("rtk 1")
    known = know_cases.known_cases

    def changed_afterwards(source):
        cases = known(source)
        projector("sum")
        return cases

    monkeypatch.setattr(know_cases, "known_cases", changed_afterwards)
    (row,) = run(home, "rest", views=("2x30",))
    assert row["status"] == "failed" and "run the command again with --resume" in row["reason"]
    (row,) = run(home, "rest", views=("2x30",))
    assert row["status"] == "done"


def test_a_result_beside_the_x_rays_is_no_part_of_the_case(home):
    home, started = home
    first = run(home, "rest")
    (home / "data/case-1/result").mkdir()
    (home / "data/case-1/result/result.json").write_text("{}")
    (home / "data/case-1/result/transform.h5").write_text("")
    assert run(home, "rest") == first and started == ["know_cases", "run_system", "know_cases"]


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


def test_weights_reach_the_system_under_its_own_name_and_count_by_their_content(home):
    home, started = home
    weights = home / "weights.txt"
    weights.write_text("first")
    given = {"weights": {"w": weights}}
    (row,) = run(home, "w=my_systems:Weighs", **given)
    assert row["status"] == "done" and row["notes"] == ["first"] and row["system"] == "w"
    started.clear()
    os.utime(weights, (1, 1))
    run(home, "w=my_systems:Weighs", **given)
    assert not started
    weights.write_text("second")
    (row,) = run(home, "w=my_systems:Weighs", **given)
    assert row["notes"] == ["second"]


def test_networks_with_instance_optimisation_take_the_file_of_those_without(home):
    home, _ = home
    (home / "first").write_text("first")
    (home / "second").write_text("second")
    files = {"a": home / "first", "b-io": home / "second"}
    systems = ["a-io=my_systems:Weighs", "b=my_systems:Weighs", "b-io=my_systems:Weighs"]
    rows = run(home, *systems, weights=files)
    assert [row["notes"] for row in rows] == [["first"], [], ["second"]]


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


def test_what_could_not_be_read_counts_in_the_tables_until_it_is_read(home):
    home, _ = home
    shutil.copytree(home / "data/case-1", home / "data/case-2")
    truth = (home / "data/case-2/truth/truth.json").read_text()
    (home / "data/case-2/truth/truth.json").write_text("{")
    for subject in ("case-2", "case-1"):
        rows = run(home, "rest", subject=subject)
    (table,) = tables_of(comparable_rows(rows, home / "out"))
    assert (table.views, table.subjects) == ("own-2x60", 2)
    assert (table.lines[0].done, table.lines[0].cases) == (1, 2)
    assert "could not be read" in str(table.lines[0].reasons)
    (home / "data/case-2/truth/truth.json").write_text(truth)
    run(home, "m=my_systems:Mine", subject="case-2")
    (table,) = tables_of(comparable_rows(rows, home / "out"))
    assert {line.system: (line.done, line.cases) for line in table.lines} == {"rest": (1, 2), "m": (1, 2)}
    assert not list((home / "out/rows").glob("*unread*"))


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


def test_only_rows_that_are_comparable_share_a_table(home, caplog):
    home, _ = home
    (row,) = run(home, "rest")
    rows = home / "out/rows"
    others = {
        "earlier system": {"system": "a"},
        "other case": {"system": "b", "case": "case-2-2x60", "case_digest": "other"},
        "other data": {"system": "c", "case_digest": "other"},
        "other version": {"system": "d", "polypose": "0.0.1"},
        "other threads": {"system": "e", "settings": row["settings"] | {"threads": 4}},
        "other weights": {
            "system": "rest",
            "case": "case-4-2x60",
            "case_digest": "more",
            "system_digest": "other",
        },
        "unread": {"system": "f", "case": "case-3-own-unread", "case_digest": "unread"},
    }
    for name, change in others.items():
        write_row(rows / f"{name}.json", row | change)
    (rows / "damaged.json").write_text("{")
    found = comparable_rows([row], home / "out")
    assert [each["system"] for each in found] == ["rest", "a", "b", "f"]
    assert "4 rows of earlier runs are left out" in caplog.text


def test_a_line_of_a_table_is_one_system_on_one_set_of_data(home):
    """Neither systems nor cases of this call: what is newest holds, and what differs from it is left out."""
    home, _ = home
    (row,) = run(home, "rest")
    others = [
        {"system": "a", "case": "old", "case_digest": "1", "system_digest": "first weights"},
        {"system": "a", "case": "new", "case_digest": "2", "system_digest": "second weights"},
        {"system": "b", "case": "new", "case_digest": "data before a change"},
        {"system": "b", "case": "other", "case_digest": "3"},
    ]
    for number, change in enumerate(others):
        place = home / f"out/rows/{number}.json"
        write_row(place, row | change)
        os.utime(place, (100 + number % 3, 100 + number % 3))
    os.utime(home / "out/rows/2.json", (1, 1))
    found = {(each["system"], each["case"]) for each in comparable_rows([row], home / "out")}
    assert found == {("rest", row["case"]), ("a", "new"), ("b", "other")}


def test_rows_of_other_weights_do_not_share_a_line(home):
    home, _ = home
    weights = home / "weights.txt"
    shutil.copytree(home / "data/case-1", home / "data/case-2")
    found = []
    for number in (1, 2):
        weights.write_text(str(number))
        found += run(home, "w=my_systems:Weighs", subject=f"case-{number}", weights={"w": weights})
    assert [each["notes"] for each in found] == [["1"], ["2"]]
    assert comparable_rows(found[1:], home / "out") == found[1:]


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
