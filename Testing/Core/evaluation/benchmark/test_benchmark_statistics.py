"""Means, ranks and tests over subjects, against worked examples and enumeration."""

import itertools

import numpy as np
import pytest
from benchmark_rows import row
from scipy.stats import rankdata

from PolyPoseLib.evaluation.benchmark.statistics import holm, signed_rank, tables_of

DICE = ("bones", "Dice", "")


def test_wilcoxons_own_example():
    """Darwin's heights of cross- and self-fertilised maize, in eighths of an inch: W = 24, p = 0.0413."""
    heights = np.array([49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48.0])
    assert signed_rank(heights) == pytest.approx(0.041259765625, abs=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_p_is_that_of_all_signs_enumerated(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(6, 11))
    differences = rng.normal(0.5, 1.0, count) if seed % 2 else rng.integers(-4, 6, count).astype(float)
    kept = differences[differences != 0]
    if len(kept) < 6:
        assert signed_rank(differences) is None
        return
    ranks = rankdata(abs(kept))
    signs = np.array(list(itertools.product((-1, 1), repeat=len(kept))))
    sums = signs @ ranks
    expected = (abs(sums) >= abs(np.sign(kept) @ ranks) - 1e-9).mean()
    assert signed_rank(differences) == pytest.approx(expected, abs=1e-12)


def test_rounding_makes_no_difference():
    values = np.array([0.91, 0.92, 0.93, 0.94, 0.95, 0.96, 0.97])
    assert signed_rank(values - (values + 0.1 - 0.1)) is None
    shifted = (values + 0.1) - values  # all 0.1, if it were not for rounding
    assert signed_rank(shifted) == pytest.approx(2 / 2**7)


def test_holms_example():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []


def test_mean_and_sd_are_over_subjects_not_cases():
    rows = [row("a", "s1", 0.5), {**row("a", "s1", 0.7), "case": "s1-second"}, row("a", "s2", 0.8)]
    cell = tables_of(rows)[0].lines[0].cells[DICE]
    assert cell.values == {"s1": pytest.approx(0.6), "s2": 0.8}
    assert cell.mean == pytest.approx(0.7) and cell.sd == pytest.approx(np.std([0.6, 0.8], ddof=1))
    assert tables_of(rows[:1])[0].lines[0].cells[DICE].sd is None


def test_ties_as_printed_share_a_rank_and_rest_has_none():
    rows = []
    for system, value in (
        ("a", 0.9001),
        ("b", 0.8999),
        ("c", 0.85),
        ("d", 0.8503),
        ("e", 0.7),
        ("rest", 0.99),
    ):
        rows += [row(system, f"s{n}", value) for n in range(3)]
    (table,) = tables_of(rows)
    assert table.best[DICE] == {"a", "b"} and table.second[DICE] == {"c", "d"}
    assert "rest" not in table.best[DICE] | table.second[DICE]
    assert table.best["deformation", "folds", "%"] == frozenset()  # all alike: nothing to mark


def test_polypose_from_other_cameras_takes_no_mark_from_a_rival():
    values = {"polypose": 0.9, "polypose-found": 0.88, "b": 0.8, "c": 0.7}
    rows = [row(system, f"s{n}", value) for system, value in values.items() for n in range(2)]
    (table,) = tables_of(rows)
    assert (table.best[DICE], table.second[DICE]) == ({"polypose"}, {"b"})
    # Nor does it take them by having a number of a case that nobody else has.
    hard = {"case": "s1-second"}
    rows += [row("polypose-found", "s1", 0.1) | hard]
    rows += [row(system, "s1") | hard for system in ("polypose", "b", "c")]
    (table,) = tables_of(rows)
    assert (table.best[DICE], table.second[DICE]) == ({"polypose"}, {"b"})


def test_lower_is_better_for_distances():
    rows = [row(system, "s1", 0.9, hd95=value) for system, value in (("a", 3.0), ("b", 1.0), ("c", 2.0))]
    (table,) = tables_of(rows)
    key = ("bones", "HD95", "mm")
    assert table.best[key] == {"b"} and table.second[key] == {"c"}


def test_a_system_that_failed_on_a_subject_is_ranked_by_the_cases_that_both_finished():
    """It failed on the hardest one: its mean over the others looks best, and is no better than theirs there."""
    values = {"a": (0.96, 0.96, 0.1), "b": (0.9, 0.9, 0.2), "c": (0.95, 0.95)}
    rows = [row(system, f"s{n}", value) for system, own in values.items() for n, value in enumerate(own)]
    rows.append(row("c", "s2", status="failed", reason="out of memory"))
    (table,) = tables_of(rows)
    line = table.lines[2]
    assert (line.done, line.cases, line.reasons) == (2, 3, {("failed", "out of memory"): 1})
    assert not line.is_whole
    assert table.best[DICE] == {"a"} and table.second[DICE] == {"c"}
    not_run = tables_of(rows[:-1])[0].lines[2]
    assert (not_run.done, not_run.cases) == (2, 3) and sum(not_run.reasons.values()) == 1


def test_a_case_that_was_run_twice_counts_once():
    (table,) = tables_of([row("a", "s0", 0.5), row("a", "s0", 0.5), row("b", "s0", 0.5)])
    assert (table.lines[0].done, table.lines[0].cases, table.lines[0].is_whole) == (1, 1, True)


def test_scores_of_a_failed_row_are_not_used():
    broken = {**row("a", "s1", 0.1, status="failed"), "scores": {"groups": {"bones": {"dice": 0.1}}}}
    (table,) = tables_of([broken, row("a", "s2", 0.9), row("b", "s1", 0.5), row("b", "s2", 0.5)])
    assert table.lines[0].cells[DICE].values == {"s2": 0.9}


def test_polypose_is_tested_against_its_best_rival():
    rng = np.random.default_rng(1)
    rows = []
    for n in range(8):
        base = rng.uniform(0.6, 0.8)
        rows += [
            row("polypose", f"s{n}", base + 0.1, hd95=2.0 + base),
            row("good", f"s{n}", base + 0.05 + 0.001 * n, hd95=1.0 + base + 0.01 * n),
            row("bad", f"s{n}", base - 0.2, hd95=9.0),
            row("rest", f"s{n}", base + 0.19, hd95=0.1),
            row("polypose-found", f"s{n}", base + 0.18, hd95=0.2),
        ]
    (table,) = tables_of(rows)
    dice, hd95 = (next(c for c in table.comparisons if c.column.measure == m) for m in ("Dice", "HD95"))
    assert (dice.rival, dice.better, dice.pairs) == ("good", True, 8)
    assert dice.p == pytest.approx(2 / 2**8) and dice.p_holm == pytest.approx(2 * 2 / 2**8)
    assert (hd95.rival, hd95.better) == ("good", False)
    folds = next(c for c in table.comparisons if c.column.measure == "folds")
    assert folds.p is None and folds.differing == 0
    assert not [c for c in table.comparisons if c.column.span == "cost"]


def test_a_system_of_the_users_has_every_other_for_a_rival():
    rows = [
        row(s, f"s{n}", v + 0.01 * n**2)
        for s, v in (("mine", 0.5), ("polypose", 0.6), ("polypose-found", 0.7))
        for n in range(6)
    ]
    (table,) = tables_of(rows, ours="mine")
    assert {each.rival for each in table.comparisons if each.column.measure == "Dice"} == {"polypose-found"}


def test_too_few_subjects_give_no_p():
    rows = [row(s, f"s{n}", v + 0.01 * n**2) for s, v in (("polypose", 0.9), ("b", 0.7)) for n in range(5)]
    (table,) = tables_of(rows)
    assert all(each.p is None and each.p_holm is None for each in table.comparisons)
    assert tables_of([]) == []


def test_tables_are_one_per_data_set_and_views():
    rows = [row("a", "s1", 0.9), row("a", "s1", 0.95, views="9x180")]
    assert [(t.dataset, t.views, t.subjects) for t in tables_of(rows)] == [
        ("drawn", "2x30", 1),
        ("drawn", "9x180", 1),
    ]


def test_a_subject_is_compared_by_the_cases_that_both_systems_finished():
    """The rival's second case is far harder, and ours failed on it: over the shared ones nothing differs."""
    rows = []
    for n in range(7):
        rows += [row("polypose", f"s{n}", 0.8), row("b", f"s{n}", 0.8)]
        rows += [{**row("b", f"s{n}", 0.2), "case": f"s{n}-second"}]
        rows += [
            {**row("polypose", f"s{n}", status="failed", reason="out of memory"), "case": f"s{n}-second"}
        ]
    (table,) = tables_of(rows)
    (dice,) = (each for each in table.comparisons if each.column.measure == "Dice")
    assert (dice.pairs, dice.differing, dice.p, dice.better) == (7, 0, None, False)


def with_failures(values, failed):
    """Rows of systems with a value each, a little other for every subject; failed: {system: subjects}."""
    return [
        row(system, f"s{n}", status="failed")
        if n in failed.get(system, ())
        else row(system, f"s{n}", value + 0.001 * n**2, hd95=10 * (1 - value))
        for system, value in values.items()
        for n in range(7)
    ]


@pytest.mark.parametrize("ours", [0.905, 0.97])
def test_a_better_rival_that_failed_on_a_subject_stays_the_rival(ours):
    rows = with_failures({"polypose": ours, "a": 0.955, "b": 0.704}, {"a": [3]})
    (table,) = tables_of(rows)
    order = ["polypose", "a"] if ours > 0.955 else ["a", "polypose"]
    assert [table.best[DICE], table.second[DICE]] == [{each} for each in order]
    dice = next(each for each in table.comparisons if each.column.measure == "Dice")
    assert (dice.rival, dice.pairs, dice.better) == ("a", 6, ours > 0.955)
    assert dice.p == pytest.approx(2 / 2**6)


def test_polypose_is_under_the_same_rule():
    """It failed where all do badly: without that case nobody else is worse for it."""
    rows = with_failures({"polypose": 0.9, "a": 0.91, "b": 0.7}, {"polypose": [6]})
    for each in rows:
        if each["subject"] == "s6" and each["status"] == "done":
            each["scores"]["groups"]["bones"]["dice"] = 0.1
    (table,) = tables_of(rows)
    assert (table.best[DICE], table.second[DICE]) == ({"a"}, {"polypose"})
    rows = with_failures({"polypose": 0.99, "a": 0.91, "b": 0.7}, {"polypose": [0, 1, 2, 3]})
    (table,) = tables_of(rows)
    assert (table.best[DICE], table.second[DICE]) == ({"a"}, {"b"})
    assert table.unranked[DICE] == {"polypose"}


def test_a_system_with_fewer_than_half_of_the_cases_is_no_rival():
    rows = with_failures({"polypose": 0.9, "a": 0.99, "b": 0.7}, {"a": [0, 1, 2, 3]})
    (table,) = tables_of(rows)
    assert (table.best[DICE], table.second[DICE]) == ({"polypose"}, {"b"})
    assert table.unranked[DICE] == {"a"}
    assert {each.rival for each in table.comparisons if each.column.measure == "Dice"} == {"b"}


def test_the_best_rival_is_chosen_by_the_cases_that_each_shares_with_polypose():
    """The one with the better mean failed on the case that is hard for all."""
    values = {"polypose": [0.9] * 6 + [0.2], "a": [0.88] * 6, "b": [0.89] * 6 + [0.19]}
    rows = [row(system, f"s{n}", value) for system, own in values.items() for n, value in enumerate(own)]
    (table,) = tables_of(rows)
    dice = next(each for each in table.comparisons if each.column.measure == "Dice")
    assert (dice.rival, dice.pairs, dice.better) == ("b", 7, True)


@pytest.mark.parametrize("unread", [True, False])
def test_a_case_that_no_system_finished_takes_no_rank_from_any(unread):
    """Data that could not be read are no failure of a system; a case on which all failed is one."""
    rows = with_failures({"polypose": 0.9, "a": 0.8, "rest": 0.5}, {})
    expected = tables_of(rows)[0]
    digest = {"case_digest": "unread"} if unread else {}
    rows += [row(system, "s7", status="failed", **digest) for system in ("polypose", "a")]
    rows += [row("rest", "s7", 0.5)] if not unread else [row("rest", "s7", status="failed", **digest)]
    (table,) = tables_of(rows)
    assert (table.best, table.second) == (expected.best, expected.second) and table.best[DICE] == {"polypose"}
    assert [(each.rival, each.pairs, each.p_holm) for each in table.comparisons] == [
        (each.rival, each.pairs, each.p_holm) for each in expected.comparisons
    ]
    assert (table.subjects, table.unread) == (8, int(unread))
    assert [line.is_whole for line in table.lines[:2]] == [unread, unread]
    assert [(line.done, line.cases) for line in table.lines[:2]] == [(7, 8), (7, 8)]


def test_systems_that_beat_each_other_in_a_circle_have_no_rank():
    values = {"a": (0.9, 0.1, None), "b": (None, 0.9, 0.1), "c": (0.1, None, 0.9)}
    rows = [
        row(system, f"s{n}", value)
        for system, own in values.items()
        for n, value in enumerate(own)
        if value is not None
    ]
    (table,) = tables_of(rows)
    assert (table.best[DICE], table.second[DICE]) == (frozenset(), frozenset())


def test_a_mean_over_fewer_cases_of_a_subject_is_compared_over_those():
    """Both finished both cases, but one has a number of the easier one alone."""
    hard = {**row("a", "s1", 0.3), "case": "s1-second"}
    without = {**row("b", "s1", 0.5), "case": "s1-second"}
    del without["scores"]["groups"]["bones"]["dice"]
    rows = [
        row("a", "s1", 0.9),
        hard,
        row("b", "s1", 0.9),
        without,
        row("c", "s1", 0.8),
        {**hard, "system": "c"},
    ]
    (table,) = tables_of(rows)
    assert table.best[DICE] == {"a", "b"} and table.second[DICE] == {"c"}
