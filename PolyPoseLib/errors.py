"""The exceptions that PolyPose raises on purpose; each knows the exit status of the command line."""

import difflib
import errno
from collections.abc import Iterable, Sequence
from typing import Any

LONGEST_SENTENCE = 2000
"""Characters; longer sentences, which repeat what a file holds, are cut in their middle: their end says what to do."""

FAULT_STATUS = 70
"""The exit status for what is no one's input but a fault of the program or of its installation."""

LESS_MEMORY = (
    'crop the CT or resample it to larger voxels, use the preset "fast", or a machine with more memory'
)
"""What to do when memory does not suffice, for sentences."""

_LONGEST_NAME = 200
"""Characters of a name that are compared with known names: more takes minutes."""

_OUT_OF_MEMORY = (
    "bad_alloc",
    "can't allocate memory",
    "cannot allocate memory",
    "failed to allocate memory",
    "not enough memory",
    "out of memory",
    "unable to allocate",
)
"""Parts of the messages, in lower case, by which libraries say that memory ran out."""


class PolyPoseError(Exception):
    """Base of every error whose message is one sentence meant for the user, on one line; a long one is cut."""

    exit_status: int = FAULT_STATUS

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(cut(one_line(each)) if isinstance(each, str) else each for each in arguments))


class InputError(PolyPoseError, ValueError):
    """The input is wrong; the sentence names the file, the field and the fix."""

    exit_status = 2


class NotFiniteError(InputError):
    """Numbers are not finite; where they were computed, and not given, the computation diverged."""


class UntrustedResultError(PolyPoseError):
    """The registration ran, but its result must not be trusted; the sentence says why."""

    exit_status = 3


class CancelledError(PolyPoseError):
    """The user asked to stop."""

    exit_status = 130


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an error of any library says that memory ran out."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM
    return isinstance(error, RuntimeError) and any(part in str(error).lower() for part in _OUT_OF_MEMORY)


def memory_ran_out(what: str) -> InputError:
    """The exception for a lack of memory at something: a file, or a stage."""
    return InputError(f"{what}: memory ran out: {LESS_MEMORY}.")


def cut(text: str, longest: int = LONGEST_SENTENCE) -> str:
    """A text as it is, or its beginning and its end where it is too long for people."""
    if len(text) <= longest:
        return text
    end = longest // 4
    return f"{text[: longest - end - 5]} ... {text[-end:]}"


def one_line(text: str) -> str:
    """A text as it is, or without what breaks a line or commands a console: blanks for white space, else escapes."""
    if text.isprintable():
        return text
    return "".join(
        each
        if each.isprintable()
        else " "
        if each.isspace()
        else each.encode("unicode_escape", "backslashreplace").decode("ascii")
        for each in text
    )


def shown(value: Any) -> str:
    """A value as it may appear in such a sentence: as Python writes it, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write whole numbers of thousands of digits
        return "a number of very many digits"
    return text if len(text) <= 60 else text[:57] + "..."


def listed(names: Sequence[str]) -> str:
    """Names in a sentence, the last one after "and"."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like this one, or None when none is alike."""
    lowered = {each[:_LONGEST_NAME].lower(): each for each in known}
    found = difflib.get_close_matches(name[:_LONGEST_NAME].lower(), lowered, n=1, cutoff=0.6)
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
