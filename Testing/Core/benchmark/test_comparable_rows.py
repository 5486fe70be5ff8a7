"""Rows of earlier calls stand in a table with those of this one where both are of the same systems and data."""

import os
import shutil

from benchmark_home import run

from PolyPoseLib.benchmark.comparable_rows import comparable_rows
from PolyPoseLib.evaluation.benchmark.statistics import tables_of
from PolyPoseLib.io.benchmark.row_files import write_row


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
        "other code": {"system": "rest", "case": "case-5-2x60", "system_digest": "other"},
        "other weights": {
            "system": "rest",
            "case": "case-4-own-2x60",
            "case_digest": "more",
            "weights_digest": "other",
        },
        "unread": {"system": "f", "case": "case-3-own-unread", "case_digest": "unread"},
    }
    for name, change in others.items():
        write_row(rows / f"{name}.json", row | change)
    (rows / "damaged.json").write_text("{")
    found = comparable_rows([row], home / "out")
    assert [each["system"] for each in found] == ["rest", "a", "b", "f"]
    assert "5 rows of earlier runs are left out" in caplog.text


def test_a_line_of_a_table_is_one_system_on_one_set_of_data(home):
    """Neither systems nor cases of this call: what is newest holds, and what differs from it is left out."""
    home, _ = home
    (row,) = run(home, "rest")
    others = [
        {"system": "a", "case": "old", "case_digest": "1", "weights_digest": "first"},
        {"system": "a", "case": "new", "case_digest": "2", "weights_digest": "second"},
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


def test_one_system_may_have_other_weights_in_another_table(home):
    """Those of a network fit one number of views."""
    home, _ = home
    (row,) = run(home, "rest")
    for number, views in enumerate(("own-2x60", "own-3x90")):
        more = {"system": "a", "case": views, "views": views, "weights_digest": views}
        write_row(home / f"out/rows/{number}.json", row | more)
    assert [each["system"] for each in comparable_rows([row], home / "out")] == ["rest", "a", "a"]


def test_scores_of_an_earlier_call_stand_for_a_run_that_could_not_run(home, caplog):
    home, _ = home
    (row,) = run(home, "rest")
    skipped = row | {"status": "skipped", "scores": {}, "weights_digest": "other"}
    (found,) = comparable_rows([skipped], home / "out")
    assert found["status"] == "done"
    assert "1 runs that were skipped now have scores of an earlier call" in caplog.text
    # But not beside scores of other weights, nor of data that have changed.
    other = row | {"case": "case-2", "weights_digest": "other"}
    assert comparable_rows([skipped, other], home / "out")[0] == skipped
    changed = skipped | {"case_digest": "other"}
    assert comparable_rows([changed], home / "out") == [changed]


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
