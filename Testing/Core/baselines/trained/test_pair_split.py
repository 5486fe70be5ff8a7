"""Held-out pairs of CTs against every way in which a training could have seen them."""

from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from PolyPoseLib.baselines.trained.pair_split import split_pairs


def cts_of(studies, pairs):
    return {studies[pair.study][number] for pair in pairs for number in (pair.moving, pair.fixed)}


@pytest.mark.parametrize(
    ("studies", "held_out", "training"),
    [
        (["ab", "cd"], 2, 2),
        (["abcdefghij", "kl"], 2, 90),  # the smaller one is held out, whichever comes first
        (["kl", "abcdefghij"], 2, 90),
        (["abc", "def", "ghi", "jkl", "mno", "pqr"], 12, 24),
        (["abcd"], 2, 2),
        (["abcdefghijklmno"], 6, 132),  # of 15 CTs, 3
        (["ab", "bc", "cd", "xy"], 2, 6),  # the first three are of one patient
        (["ab", "ab", "cd"], 2, 4),
    ],
)
def test_no_ct_is_on_both_sides(studies, held_out, training):
    split = split_pairs(studies)
    assert (len(split.held_out), len(split.training)) == (held_out, training)
    assert split.is_enough and not split.shares_cts
    assert cts_of(studies, split.held_out).isdisjoint(cts_of(studies, split.training))


@pytest.mark.parametrize(("studies", "training"), [(["abc"], 4), (["abc", "abc"], 8), (["ab", "bc"], 2)])
def test_with_too_few_cts_no_pair_is_learned_from_the_other_way_round(studies, training):
    split = split_pairs(studies)
    assert split.shares_cts and split.is_enough and len(split.training) == training
    ends = [{studies[pair.study][number] for number in pair[1:]} for pair in split.held_out]
    assert len(set(map(frozenset, ends))) == 1
    assert all({studies[p.study][n] for n in p[1:]} != ends[0] for p in split.training)


@pytest.mark.parametrize("studies", [["a"], ["aa"], ["ab"], ["ab", "ba"], ["aa", "bb"]])
def test_what_cannot_be_divided_is_not_enough(studies):
    """A CT is no pair with its own copy, and both directions of one pair are one motion."""
    assert not split_pairs(studies).is_enough


@given(st.lists(st.lists(st.sampled_from("abcdefghijkl"), min_size=1, max_size=6), min_size=1, max_size=6))
def test_every_division_is_honest(studies):
    split = split_pairs(studies)
    pairs = (*split.held_out, *split.training)
    assert len(set(pairs)) == len(pairs)
    assert all(studies[study][moving] != studies[study][fixed] for study, moving, fixed in pairs)
    shared = cts_of(studies, split.held_out) & cts_of(studies, split.training)
    assert bool(shared) <= split.shares_cts
    if len(patients := joined(studies)) > 1:
        assert split.is_enough and not shared
        # No patient is on both sides, and none is left out.
        sides = [
            {patient_of(patients, studies[p.study]) for p in side}
            for side in (split.held_out, split.training)
        ]
        assert sides[0].isdisjoint(sides[1]) and len(sides[0] | sides[1]) == len(patients)


def joined(studies):
    """CTs of each patient that has a pair, by joining what touches until nothing does."""
    sets = [frozenset(study) for study in studies]
    while touching := next((two for two in combinations(sets, 2) if two[0] & two[1]), None):
        sets = [each for each in sets if each not in touching] + [touching[0] | touching[1]]
    return [each for each in sets if any(len(set(study)) > 1 and set(study) <= each for study in studies)]


def patient_of(patients, study):
    return next(number for number, patient in enumerate(patients) if set(study) <= patient)
