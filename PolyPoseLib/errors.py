"""The exceptions that PolyPose raises on purpose; each knows the exit status of the command line."""


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
