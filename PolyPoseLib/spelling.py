"""Sentences about names that are not known, with the nearest that is."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like this one, or None when none is alike."""
    lowered = {each.lower(): each for each in known}
    found = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.6)
    return lowered[found[0]] if found else None


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """A sentence that names the unknown, the nearest known name, or else all of them."""
    known = list(known)
    guess = nearest(name, known)
    if guess is not None:
        return f'The {kind} "{name}" is not known: did you mean "{guess}"?'
    shown = ", ".join(known[:40]) + (", ..." if len(known) > 40 else "")
    return f'The {kind} "{name}" is not known: give one of {shown}.'
