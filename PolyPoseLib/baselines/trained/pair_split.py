"""Which pairs of CTs a network learns from, and which are held out: a CT of the one is none of the other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import NamedTuple

HELD_OUT_SHARE = 5
"""One pair of so many is held out, or as near to it as whole patients allow."""

_FEWEST_TRAINING = 2


class CtPair(NamedTuple):
    """The study, and the numbers of the moving and the fixed CT among its CTs."""

    study: int
    moving: int
    fixed: int


@dataclass(frozen=True)
class PairSplit:
    """Pairs of CTs, divided.

    Attributes
    ----------
    held_out, training : tuple[CtPair, ...]
        By studies.
    shares_cts : bool
        Whether CTs of held-out pairs are in training pairs, too, since there are too few to keep them apart: the
        held-out error is then smaller than it will be on other CTs.

    """

    held_out: tuple[CtPair, ...]
    training: tuple[CtPair, ...]
    shares_cts: bool

    @property
    def is_enough(self) -> bool:
        """Whether there is anything to learn from and to hold out."""
        return len(self.held_out) > 0 and len(self.training) >= _FEWEST_TRAINING


def split_pairs(studies: Sequence[Sequence[str]]) -> PairSplit:
    """Divide all pairs of CTs, each with each of its study and in both directions.

    Whole patients are held out where there are two or more: those with the fewest pairs, until they have a fifth of
    all. Of one patient it is the last CTs, a fifth of them and two at least, and pairs of one of these with one of the
    others are left out; with fewer than four CTs both directions of one pair.

    Parameters
    ----------
    studies : sequence of sequence of str
        What tells the CTs of each study from others, such as their digests. Studies with a CT in common are of one
        patient; a CT is no pair with its own copy.

    """
    pairs = [
        CtPair(study, moving, fixed)
        for study, cts in enumerate(studies)
        for moving, fixed in permutations(range(len(cts)), 2)
        if cts[moving] != cts[fixed]
    ]
    chosen = _patients_held_out(_patients(studies), pairs)
    if chosen:
        return _divided(pairs, [pair for pair in pairs if pair.study in chosen])
    apart = _last_cts_held_out(studies, pairs)
    if apart.is_enough:
        return apart
    ends = {studies[study][number] for study, *numbers in pairs[-1:] for number in numbers}
    both = [pair for pair in pairs if {studies[pair.study][number] for number in pair[1:]} == ends]
    return _divided(pairs, both, shares_cts=True)


def _divided(pairs: Iterable[CtPair], held_out: Sequence[CtPair], shares_cts: bool = False) -> PairSplit:
    """All that is not held out is learned from."""
    kept = set(held_out)
    return PairSplit(tuple(held_out), tuple(pair for pair in pairs if pair not in kept), shares_cts)


def _patients(studies: Sequence[Sequence[str]]) -> list[set[int]]:
    """Studies that have a CT in common, directly or by others."""
    patients: list[tuple[set[int], set[str]]] = []
    for number, cts in enumerate(studies):
        same = [each for each in patients if not each[1].isdisjoint(cts)]
        patients = [each for each in patients if each not in same]
        patients.append(({number}.union(*(each[0] for each in same)), set(cts).union(*(s[1] for s in same))))
    return [each[0] for each in patients]


def _patients_held_out(patients: Sequence[set[int]], pairs: Sequence[CtPair]) -> set[int]:
    """Studies of the patients with the fewest pairs that have a fifth together; none where one patient has all."""
    counts = [sum(pair.study in patient for pair in pairs) for patient in patients]
    order = sorted((number for number in range(len(patients)) if counts[number]), key=counts.__getitem__)
    studies: set[int] = set()
    done = 0
    for number in order[:-1]:  # the largest one is learned from
        if done * HELD_OUT_SHARE >= len(pairs):
            break
        studies |= patients[number]
        done += counts[number]
    return studies


def _last_cts_held_out(studies: Sequence[Sequence[str]], pairs: Sequence[CtPair]) -> PairSplit:
    """Pairs of the last CTs of the largest study, and those without any of these."""
    known = list(dict.fromkeys(max(studies, key=lambda cts: len(set(cts)))))
    last = set(known[-max(2, len(known) // HELD_OUT_SHARE) :])
    held_out, training = [], []
    for pair in pairs:
        inside = [studies[pair.study][number] in last for number in (pair.moving, pair.fixed)]
        if all(inside):
            held_out.append(pair)
        elif not any(inside):
            training.append(pair)
    return PairSplit(tuple(held_out), tuple(training), False)
