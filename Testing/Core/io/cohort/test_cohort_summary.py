"""What became of studies is kept and read back; tables and page show it, and hostile names do nothing in them."""

import csv
import json
import math
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st
from result_case import make_result

from PolyPoseLib.data.cohort.outcome import FileStamp, Outcome
from PolyPoseLib.io.cohort.index_page import page_of
from PolyPoseLib.io.cohort.outcome_files import outcome_path, read_outcome, write_outcome
from PolyPoseLib.io.cohort.report import write_summary
from PolyPoseLib.io.cohort.rows import COLUMNS, rows_of, summary_of
from PolyPoseLib.io.cohort.tables import csv_cell
from PolyPoseLib.io.results import save_summary

parquet = pytest.importorskip("pyarrow.parquet")

DONE = Outcome("a", 0, "", "d" * 64, "studies/a", 1, "node", 12.5, 20.25, 900.5, 1000.0,
               stamps={"0f": FileStamp(3, 4, "ab")})  # fmt: skip
HOSTILE = "<script>alert(1)</script>"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "outcomes").mkdir()
    (tmp_path / "studies").mkdir()
    return tmp_path


def with_result(folder, name="a", **changes):
    """The folder of a result, some of whose fields are others."""
    path = save_summary(make_result(), folder / "studies" / name, picture=False) / "result.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def test_an_outcome_is_read_as_it_was_written(folder):
    write_outcome(folder, DONE)
    assert read_outcome(folder, "a") == DONE
    killed = Outcome("b", -9, "The system killed it.", "d" * 64, transient=True)
    write_outcome(folder, killed)
    read = read_outcome(folder, "b")
    assert math.isnan(read.peak_memory_mib) and (read.exit_status, read.transient) == (-9, True)


@pytest.mark.parametrize(
    "damage",
    ["", "{", '{"version": 2}', '{"version": 1}', "[]", '{"version": 1, "identity": "b"}'],
)
def test_a_damaged_outcome_is_none(folder, damage):
    outcome_path(folder, "a").write_text(damage)
    assert read_outcome(folder, "a") is None


def test_only_what_is_settled_is_not_run_again():
    digest = DONE.digest
    assert DONE.settles(digest, False) and DONE.settles(digest, True)
    assert not DONE.settles("e" * 64, False)
    wrong = Outcome("a", 2, "It is wrong.", digest)
    assert wrong.settles(digest, False) and not wrong.settles(digest, True)
    assert not Outcome("a", 2, "The disk is full.", digest, transient=True).settles(digest, False)
    assert not Outcome("a", -15, "It took too long.", digest).settles(digest, False)


def test_both_tables_hold_the_same_motions(folder):
    with_result(folder)
    summaries = write_summary(folder, [Outcome("b", 2, "It is wrong."), DONE])
    assert [each.outcome.identity for each in summaries] == ["b", "a"], "the worst first"
    rows = parquet.read_table(folder / "summary.parquet").to_pylist()
    assert [(row["study"], row["structure"]) for row in rows] == [("b", ""), ("a", "pelvis"), ("a", "femur")]
    femur = make_result().structures["femur"]
    assert rows[2]["rotation_deg"] == femur.rotation_deg
    assert [rows[2][name] for name in ("left_mm", "back_mm", "up_mm")] == list(femur.translation_mm)
    assert rows[2]["distance_mm"] == pytest.approx(math.dist(femur.translation_mm, (0, 0, 0)))
    assert (rows[2]["along_mm"], rows[2]["across_mm"]) == (1.5, 0.3)
    assert rows[1]["along_mm"] is None and rows[0]["rotation_deg"] is None
    with (folder / "summary.csv").open(newline="") as stream:
        reader = csv.DictReader(stream)
        assert reader.fieldnames == list(COLUMNS)
        for written, row in zip(reader, rows, strict=True):
            for name, value in row.items():
                if isinstance(value, float):
                    assert float(written[name]) == pytest.approx(value, rel=1e-5)
                else:
                    assert written[name] == ("" if value is None else str(value))


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "  =1"])
def test_no_text_is_a_formula(text):
    assert csv_cell(text) == f"'{text}"


def test_numbers_and_other_texts_stay_as_they_are():
    assert csv_cell(-1.5) == "-1.5" and csv_cell(-3) == "-3"
    assert csv_cell("a=b") == "a=b" and csv_cell(None) == "" and csv_cell(math.nan) == ""


@given(name=st.text(min_size=1, max_size=30), reason=st.text(max_size=80))
def test_any_names_and_reasons_are_rows_and_nothing_else(tmp_path_factory, name, reason):
    folder = tmp_path_factory.mktemp("cohort")
    (folder / "studies").mkdir()
    structures = {name: {"label": 1, "fixed_to_moving": [[float(i == j) for j in range(4)] for i in range(4)],
                         "motion": {"rotation_deg": 1, "translation_mm": [1, 2, 3], "axis": [0, 0, 1]},
                         "doubts": [reason or "none"]}}  # fmt: skip
    fields = {"structures": structures, "distrust": [reason], "warnings": []}
    (folder / "studies/a").mkdir()
    (folder / "studies/a/result.json").write_text(json.dumps(fields))
    outcome = Outcome("a", 3, reason, place="studies/a")
    write_summary(folder, [outcome])
    with (folder / "summary.csv").open(newline="", encoding="utf-8") as stream:
        assert len(list(csv.reader(stream))) == 2
    assert len(parquet.read_table(folder / "summary.parquet")) == 1


class Tags(HTMLParser):
    """The elements of a page, and where its links lead."""

    def __init__(self):
        super().__init__()
        self.found, self.links = [], []

    def handle_starttag(self, tag, attributes):
        self.found.append(tag)
        self.links += [value for name, value in attributes if name in ("href", "src")]


def test_the_page_shows_hostile_texts_and_obeys_none(folder):
    with_result(folder, distrust=[HOSTILE, '" onclick="x'], trusted=False, warnings=[HOSTILE])
    summary = summary_of(folder, Outcome("a", 3, HOSTILE, place="studies/a"))
    tags = Tags()
    tags.feed(page_of(folder, [summary]))
    assert "script" not in tags.found and tags.found.count("tr") == 2
    assert all(not link.startswith(("http", "//", "javascript")) for link in tags.links)
    assert summary.reasons == (HOSTILE, '" onclick="x')


@pytest.mark.parametrize("text", ["", "{}", '{"structures": 1}', "\ud800".encode("utf-8", "surrogatepass")])
def test_a_result_that_cannot_be_read_is_a_reason(folder, text):
    with_result(folder)
    path = folder / "studies/a/result.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    summary = summary_of(folder, DONE)
    assert "cannot be read" in summary.reasons[0]
    assert len(list(rows_of([summary]))) == 1


def test_the_page_of_ten_thousand_studies_is_made_in_seconds(folder):
    outcomes = [Outcome(f"s{n}", n % 4 if n % 4 != 1 else -9, "why") for n in range(10_000)]
    page = page_of(folder, [summary_of(folder, each) for each in outcomes if not each.has_result])
    assert page.count("<tr>") == 5001
