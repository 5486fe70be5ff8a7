"""Files of weights reach the runs that they are for, and never cost scores that are there."""

import os
import shutil

from benchmark_home import run

from PolyPoseLib.benchmark.comparable_rows import comparable_rows
from PolyPoseLib.benchmark.weights_given import given_weights
from PolyPoseLib.data.benchmark.job import CaseSource
from PolyPoseLib.io.benchmark.row_files import read_row


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


def test_a_file_for_a_subject_goes_before_one_for_its_views_and_that_before_one_for_all():
    files = {"a": "all", "a@2x30": "views", "a@s1": "subject", "b@s1": "other"}

    def given(system, subject, views):
        found = given_weights(files, system, CaseSource("headneck", "/data", subject, views))
        return found and (found.path, found.of_subject)

    assert given("a", "s1", "2x30") == given("a-io", "s1", "3x180") == ("subject", True)
    assert given("a", "s2", "2x30") == ("views", False) and given("a", "s2", "3x180") == ("all", False)
    assert given("b", "s2", "2x30") is None


def test_weights_of_views_and_subjects_reach_these_alone(home):
    home, _ = home
    for name in ("one", "two", "three"):
        (home / name).write_text(name)
    files = {"w@2x30": home / "one", "w": home / "two"}
    rows = run(home, "w=my_systems:Weighs", views=("own", "2x30"), weights=files)
    assert [row["notes"] for row in rows] == [["two"], ["one"]]
    (row,) = run(home, "w=my_systems:Weighs", weights=files | {"w@case-1": home / "three"})
    assert row["notes"] == ["three"]


def test_subjects_with_weights_of_their_own_share_a_line(home):
    home, _ = home
    shutil.copytree(home / "data/case-1", home / "data/case-2")
    found = []
    for number in (1, 2):
        (home / f"{number}.pt").write_text(str(number))
        given = {f"w@case-{number}": home / f"{number}.pt"}
        found += run(home, "w=my_systems:Weighs", subject=f"case-{number}", weights=given)
    assert sorted(each["notes"] for each in comparable_rows(found[1:], home / "out")) == [["1"], ["2"]]


def test_a_run_that_its_weights_do_not_fit_leaves_scores_with_others_alone(home):
    home, started = home
    good, bad = {"weights": {"w": home / "good"}}, {"weights": {"w": home / "bad"}}
    (home / "good").write_text("good")
    (home / "bad").write_text("of other views")
    system = "w=my_systems:Fits"
    (first,) = run(home, system, keep_fields=True, **good)
    place, field = home / "out/rows/case-1-own-2x60--w.json", home / "out/fields/case-1-own-2x60--w.h5"
    assert first["status"] == "done" and field.is_file()
    (row,) = run(home, system, **bad)
    assert row["status"] == "skipped" and read_row(place) == first and field.is_file()
    assert comparable_rows([row], home / "out") == [first]
    started.clear()
    assert run(home, system, keep_fields=True, **good) == [first] and not started
    place.unlink()
    (row,) = run(home, system, **bad)
    assert read_row(place) == row and row["status"] == "skipped"
    assert not list((home / "out/rows").glob("*.new"))
