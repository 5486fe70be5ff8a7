"""The exceptions that PolyPose raises on purpose; each knows the exit status of the command line."""

import difflib
from collections.abc import Iterable
from typing import Any


class PolyPoseError(Exception):
    """Base of every error whose message is one sentence meant for the user."""

    exit_status: int = 1


class InputError(PolyPoseError, ValueError):
    """The input is wrong; the sentence names the file, the field and the fix."""

    exit_status = 2


class UntrustedResultError(PolyPoseError):
    """The registration ran, but its result must not be trusted; the sentence says why."""

    exit_status = 3


class CancelledError(PolyPoseError):
    """The user asked to stop."""

    exit_status = 130


def shown(value: Any) -> str:
    """A value as it may appear in such a sentence: as Python writes it, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write whole numbers of thousands of digits
        return "a number of very many digits"
    return text if len(text) <= 60 else text[:57] + "..."


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like this one, or None when none is alike."""
    lowered = {each.lower(): each for each in known}
    found = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.6)
    return lowered[found[0]] if found else None


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """A sentence that names the unknown, the nearest known name, or else all of them."""
    known = list(known)
    name = " ".join(name.split())[:60]
    alike = nearest(name, known)
    if alike is not None:
        return f'The {kind} "{name}" is not known: did you mean "{alike}"?'
    shown = ", ".join(known[:40]) + (", ..." if len(known) > 40 else "")
    return f'The {kind} "{name}" is not known: give one of {shown}.'
