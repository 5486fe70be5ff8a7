"""Tables: read back, counted cell by cell, and what a hostile name or reason could do to them."""

import csv
import re
from itertools import pairwise

import numpy as np
import pytest
from benchmark_rows import row

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.latex_table import escaped as latex_escaped
from PolyPoseLib.io.benchmark.markdown_table import escaped as markdown_escaped
from PolyPoseLib.io.benchmark.tables import write_tables

NASTY = r'=HYPERLINK("x") & 50% of $a_b^c$ {d} #1 ~ | \input{/etc/passwd} `e` *f* [g] <b>' + "\n--h ''"


@pytest.fixture
def rows():
    rng = np.random.default_rng(0)
    made = []
    for system, value in (("rest", 0.5), ("polypose", 0.9), ("dense-r3", 0.8), (NASTY, 0.75)):
        made += [
            row(system, f"s{n}", value + 0.02 * rng.random(), hd95=10 * (1 - value) + rng.random())
            for n in range(7)
        ]
    made[-1] = row(NASTY, "s6", status="failed", reason=NASTY)
    made += [row("liftreg", f"s{n}", status="skipped", reason="weights are missing") for n in range(7)]
    return made


def read(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_every_number_of_every_row_is_in_the_long_table(rows, tmp_path):
    rows[0]["scores"]["held_out"] = {
        "minimum_mm2": 1203.0,
        "views": {"10 degrees": {"femur": {"dice": 0.75, "hd95_px": 3.5, "lost": True}}},
        "groups": {"bones": {"dice": 0.75}},
    }
    rows[1]["scores"]["structures"]["femur"]["dice"] = None
    names = write_tables(rows, tmp_path)
    assert sorted(names) == sorted(each.name for each in tmp_path.iterdir())
    table = read(tmp_path / "scores.csv")
    assert {(line["system"].lstrip("'"), line["subject"]) for line in table} == {
        (each["system"].replace("\n", " "), each["subject"]) for each in rows
    }

    def find(**wanted):
        (line,) = [each for each in table if all(each[key] == value for key, value in wanted.items())]
        return line["value"]

    first = {"system": "rest", "subject": "s0"}
    assert find(**first, part="held_out views", view="10 degrees", name="femur", measure="hd95_px") == "3.5"
    assert find(**first, part="held_out views", view="10 degrees", name="femur", measure="lost") == "1"
    assert find(**first, part="held_out groups", name="bones", measure="dice") == "0.75"
    assert find(**first, part="held_out", measure="minimum_mm2") == "1203"
    dice = rows[0]["scores"]["structures"]["femur"]["dice"]
    assert float(find(**first, part="structures", name="femur", measure="dice")) == pytest.approx(
        dice, abs=1e-6
    )
    assert find(system="rest", subject="s1", part="structures", name="femur", measure="dice") == ""
    assert find(**first, part="whole", measure="folds_percent") == "0"
    skipped = [line for line in table if line["system"] == "liftreg"]
    assert all(line["reason"] == "weights are missing" for line in skipped)


def test_the_wide_table_holds_means_ranks_and_reasons(rows, tmp_path):
    write_tables(rows, tmp_path)
    table = {line["system"].lstrip("'")[:9]: line for line in read(tmp_path / "table-drawn-2x30.csv")}
    own = [each["scores"]["groups"]["bones"]["dice"] for each in rows if each["system"] == "polypose"]
    assert float(table["polypose"]["bones: Dice mean"]) == pytest.approx(np.mean(own), abs=1e-6)
    assert float(table["polypose"]["bones: Dice sd"]) == pytest.approx(np.std(own, ddof=1), rel=1e-4)
    assert (table["polypose"]["bones: Dice rank"], table["dense-r3"]["bones: Dice rank"]) == ("1", "2")
    assert table[NASTY[:9]]["cases_done"] == "6" and table[NASTY[:9]]["bones: Dice rank"] == ""
    assert table["liftreg"]["bones: Dice n"] == "0"
    assert "weights are missing" in table["liftreg"]["remarks"]


def test_no_cell_is_computed_by_a_spreadsheet(rows, tmp_path):
    rows[0]["subject"] = rows[0]["case"] = "@SUM(1)"
    write_tables(rows, tmp_path)
    for path in tmp_path.glob("*.csv"):
        with path.open(encoding="utf-8", newline="") as stream:
            for line in csv.reader(stream):
                assert not any(cell.lstrip().startswith(("=", "+", "@", "-")) for cell in line)


def test_markdown_has_as_many_cells_in_every_line(rows, tmp_path):
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    heights = []
    for block in text.split("\n\n"):
        lines = [line for line in block.splitlines() if line.startswith("|")]
        counts = {len(re.findall(r"(?<!\\)\|", line)) for line in lines}
        assert len(counts) <= 1
        heights += [len(lines)] * bool(lines)
    assert heights == [2 + 5, 2 + 4, 3, 3]  # systems, tests, and one structure's Dice and HD95
    assert "| liftreg | 0/7 |" in text and "skipped on 7 of 7: weights are missing" in text
    assert re.search(r"\| polypose \| 7/7 \| \*\*0\.9\d\d\(0\.\d{3}\)\*\* \|", text)
    assert re.search(r"\| dense-r3 \| 7/7 \| \*0\.8\d\d\(0\.\d{3}\)\* \|", text)
    assert "| bones: Dice | dense-r3 | 7 | better | 0.016 | 0.031 |" in text
    assert "too few" not in text


def test_tables_by_structure_say_where_cases_are_missing(tmp_path):
    """A mean without the hardest case is no better one."""
    rows = [row(system, f"s{n}", 0.5) for system in ("a", "b") for n in range(3)]
    rows[2] = row("a", "s2", status="failed", reason="out of memory")
    for each in (rows[3], rows[0], rows[1]):
        each["scores"]["structures"]["rib"] = {"dice": 0.7}
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    part = text[text.index("## Dice by structure") :]
    assert "| structure | a\u2020 2/3 | b 3/3 |" in part
    assert "| femur | 0.500(0.000)\u2020 | 0.500(0.000) |" in part
    assert "| rib | 0.700(0.000) | 0.700\u2020 |" in part
    assert part.count("it did not finish every case") == 1


def test_structures_that_an_end_of_a_ct_cuts_off_are_named(tmp_path):
    rows = [row("a", f"s{n}", 0.5) for n in range(2)]
    rows[1]["scores"]["structures"]["rib"] = {"dice": 0.7, "cut_off": False, "trimmed": True}
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    assert "scored there only at a distance from that end: rib." in text and "Reaching an end" not in text


def test_a_system_that_knows_its_subjects_is_marked(tmp_path):
    """By the subject, of which s0 has two cases."""
    cases = [("s0", "one", "ct"), ("s0", "two", "truth"), ("s1", "one", "ct"), ("s2", "one", "")]
    rows = [
        row(system, subject, 0.5, case=f"{subject}-{case}", trained_on=known(found))
        for system, known in {
            "liftreg": str,
            "2d3d-regnet": lambda _: "unknown",
            "rest": lambda _: "",
        }.items()
        for subject, case, found in cases
    ]
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    assert "| liftreg\u2021 | 4/4 |" in text and "| 2d3d-regnet | 4/4 |" in text and "| rest | 4/4 |" in text
    assert "liftreg was trained on 2 of 3 subjects, with the true posture of 1." in text
    assert "2d3d-regnet may have been trained on these subjects: its weights do not say" in text
    assert "rest may" not in text and "rest was" not in text
    latex = (tmp_path / "table-drawn-2x30.tex").read_text(encoding="utf-8")
    assert "liftreg\\textsuperscript{\\ddag}" in latex and "trained on 2 of 3 subjects" in latex
    table = {line["system"]: line for line in read(tmp_path / "table-drawn-2x30.csv")}
    assert table["liftreg"]["remarks"] == "trained on 2 of 3 subjects, with the true posture of 1"
    assert table["rest"]["remarks"] == ""


def test_own_x_rays_of_a_simulated_case_are_called_so(tmp_path):
    write_tables([row("a", "s0", 0.5, views="own-3x90")], tmp_path)
    text = (tmp_path / "table-drawn-own-3x90.md").read_text(encoding="utf-8")
    assert "drawn, 3 own X-rays within 90 degrees, 1 subject" in text


def cells_of(line):
    """Columns that a line of a tabular fills."""
    count = 0
    for cell in re.split(r"(?<!\\)&", line.removesuffix(r"\\")):
        spans = re.findall(r"\\multicolumn\{(\d+)\}", cell)
        assert len(spans) <= 1
        count += int(spans[0]) if spans else 1
    return count


def test_latex_has_as_many_cells_in_every_line(rows, tmp_path):
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.tex").read_text(encoding="utf-8")
    bare = text.replace("\\{", "").replace("\\}", "").replace("\\%", "")
    depth = 0
    for letter in re.sub(r"%.*", "", bare):
        depth += {"{": 1, "}": -1}.get(letter, 0)
        assert depth >= 0
    assert depth == 0
    columns = len(re.search(r"\\begin\{tabular\}\{(\w+)\}", text)[1])
    lines = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert len(lines) == 2 + 5 and {cells_of(line) for line in lines} == {columns}
    rules = [tuple(map(int, each)) for each in re.findall(r"\\cmidrule\(lr\)\{(\d+)-(\d+)\}", text)]
    assert rules[0][0] == 3 and rules[-1][1] == columns
    assert all(first[1] + 1 == second[0] for first, second in pairwise(rules))
    for part in ("toprule", "midrule", "bottomrule", "end{tabular}", "end{table}", "caption{", "label{"):
        assert text.count(f"\\{part}") == 1
    assert re.search(
        r"^polypose & 7/7 & \\textbf\{0\.9\d\d\(0\.\d{3}\)\}\\textsuperscript\{\*\} &", text, re.M
    )
    assert re.search(r"^dense-r3 & 7/7 & \\underline\{0\.8", text, re.M)
    assert re.search(r"^liftreg & 0/7 & \\multicolumn\{7\}\{l\}\{skipped on 7 of 7", text, re.M)


def test_latex_takes_no_command_from_a_name():
    text = latex_escaped(NASTY)
    assert "\n" not in text
    commands = set(re.findall(r"\\([A-Za-z]+|.)", text))
    assert commands <= {
        "textbackslash", "textasciitilde", "textasciicircum", "textless", "textgreater", "textbar", "char",
        "textasciigrave", "&", "%", "$", "_", "{", "}", "#",
    }  # fmt: skip
    unescaped = re.sub(r"\\[A-Za-z]+|\\.", "", text)
    assert not re.search(r"[&%$#_^~\\]|--|''", unescaped)
    assert "\ud800" not in latex_escaped("half \ud800 a pair")


@pytest.mark.parametrize("text", [NASTY, "a|b", "line\nbreak", "<script>", "_x_ **y** `z`"])
def test_markdown_shows_a_text_as_it_is(text):
    shown = markdown_escaped(text)
    assert "\n" not in shown
    assert re.sub(r"\\([\\`*_{}\[\]<>#|~$&])", r"\1", shown) == text.replace("\n", " ")
    assert not re.search(r"(?<!\\)(?:\\\\)*[`*_<>|\[]", shown)


def test_one_subject_and_no_best_rival(tmp_path):
    write_tables([row("a", "s0", 0.5, hd95=3.0)], tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    assert "| a | 1/1 | 0.500 | 3.00 |" in text and "rival" not in text and "**" not in text


def test_too_few_subjects_are_said_so(tmp_path):
    rows = [
        row(s, f"s{n}", v + 0.01 * n, hd95=1.0) for s, v in (("polypose", 0.9), ("b", 0.7)) for n in range(4)
    ]
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    assert "too few pairs that differ (4; 6 are needed)" in text
    assert "No test: too few subjects." in (tmp_path / "table-drawn-2x30.tex").read_text(encoding="utf-8")


def test_lost_and_cut_off_structures_are_named(rows, tmp_path):
    rows[7]["scores"]["structures"]["femur"]["lost"] = True
    rows[7]["scores"]["structures"]["femur"]["cut_off"] = True
    held_out = {"minimum_mm2": 321.5, "groups": {"bones": {"dice": 0.0}}, "left_out": ["C4", "C3"]}
    rows[7]["scores"]["held_out"] = held_out
    rows[8]["scores"]["held_out"] = {**held_out, "structures": {"C4": {"dice": 1.0}}}
    write_tables(rows, tmp_path)
    for ending in ("md", "tex"):
        text = (tmp_path / f"table-drawn-2x30.{ending}").read_text(encoding="utf-8")
        assert "polypose 1" in text and "321.5 mm² at the detector" in text and "parts: femur" in text
        assert "never scored there: C3." in text


def test_real_frames_of_different_numbers_share_a_table(tmp_path):
    """Real X-rays are named by frames, which differ from subject to subject."""
    rows = [
        row(system, subject, 0.5, views=views)
        for system in ("a", "b")
        for subject, views in (("s1", "10+9"), ("s2", "0+33"), ("s3", "4"))
    ]
    assert write_tables(rows, tmp_path)[::3] == [
        "table-drawn-2-frames.md",
        "table-drawn-1-frames.md",
        "scores.csv",
    ]
    assert "drawn, 2 X-rays, 2 subjects" in (tmp_path / "table-drawn-2-frames.md").read_text(encoding="utf-8")
    assert "drawn, 1 X-ray, 1 subject" in (tmp_path / "table-drawn-1-frames.md").read_text(encoding="utf-8")


def test_names_of_data_sets_stay_in_the_folder(rows, tmp_path):
    for each in rows:
        each["dataset"] = "../../up"
    (tmp_path / "in").mkdir()
    write_tables(rows, tmp_path / "in")
    assert [each.name for each in tmp_path.iterdir()] == ["in"]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda rows: rows.clear(), "no rows"),
        (lambda rows: rows[2].pop("views"), 'Row 3 .* "views"'),
        (lambda rows: rows[0].update(status="odd"), "'odd'"),
        (lambda rows: rows[1].update(scores=None), 'Row 2 .* no "scores"'),
    ],
)
def test_rows_that_make_no_table_are_refused(rows, tmp_path, change, word):
    change(rows)
    with pytest.raises(InputError, match=word):
        write_tables(rows, tmp_path)
    assert not list(tmp_path.iterdir())


def test_every_measure_of_the_table_is_explained_below_it(tmp_path):
    rows = [row("rest", f"s{n}", 0.5, hd95=2.0 + n) for n in range(3)]
    for each in rows:
        each["scores"]["groups"]["bones"]["tre_mean_mm"] = 1.5
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text()
    head, notes = text.splitlines()[2], text[text.index("\n- ") :]
    titles = re.split(r"(?<!\\) \| ", head.strip("| "))
    measures = {title.rpartition(": ")[2].partition(" (")[0] for title in titles[2:]}
    assert measures == {"Dice", "HD95", "TRE", "folds", r"SD log\|J\|", "time", "CPU time", "peak memory"}
    plain = {"CPU time", "peak memory"}  # they say what they are
    assert all(
        f"{measure}: " in notes or f"{measure.capitalize()}: " in notes for measure in measures - plain
    )


def test_what_a_dagger_means_and_the_rival_are_true_where_a_system_failed(tmp_path):
    values = (("polypose", 0.9), ("a", 0.95), ("b", 0.7), ("c", 0.99))
    rows = [row(system, f"s{n}", value + 0.001 * n) for system, value in values for n in range(7)]
    rows[10] = row("a", "s3", status="failed", reason="it diverged")
    rows[21:25] = [row("c", f"s{n}", status="failed", reason="it diverged") for n in range(4)]
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    assert re.search(r"\| a† \| 6/7 \| \*\*0\.953\(0\.002\)\*\* \|", text)
    assert re.search(r"\| polypose \| 7/7 \| \*0\.903\(0\.002\)\* \|", text)
    assert re.search(r"\| c† \| 3/7 \| 0\.995\(0\.001\) \|", text)
    assert "| bones: Dice | a | 6 | worse | 0.031 |" in text
    assert "the means are over the cases that it finished" in text
    assert "No rank where it has fewer than half of the cases: c." in text
    assert "best mean among the others" not in text
    latex = (tmp_path / "table-drawn-2x30.tex").read_text(encoding="utf-8")
    assert (
        "failed on 1 of 7: it diverged" in latex and "two systems over the cases that both finished" in latex
    )


def test_subjects_that_could_not_be_read_are_counted_below_the_table(tmp_path):
    rows = [row(s, f"s{n}", v + 0.001 * n) for s, v in (("polypose", 0.9), ("a", 0.8)) for n in range(6)]
    told = {"status": "failed", "reason": "The case could not be read: x", "case_digest": "unread"}
    rows += [row(system, "s6", **told) for system in ("polypose", "a")]
    write_tables(rows, tmp_path)
    text = (tmp_path / "table-drawn-2x30.md").read_text(encoding="utf-8")
    assert re.search(r"\| polypose \| 6/7 \| \*\*0\.90\d\(0\.002\)\*\* \|", text)
    assert "| bones: Dice | a | 6 | better | 0.031 |" in text
    assert "1 of 7 subjects could not be read" in text and "\u2020" not in text
