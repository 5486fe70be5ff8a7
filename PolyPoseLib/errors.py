"""The exceptions that PolyPose raises on purpose; each knows the exit status of the command line."""

from typing import Any


class PolyPoseError(Exception):
    """Base of every error whose message is one sentence meant for the user."""

    exit_status: int = 1


class InputError(PolyPoseError, ValueError):
    """The input is wrong; the sentence names the file, the field and the mend."""

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
