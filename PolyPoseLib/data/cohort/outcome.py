"""What became of one study of a cohort."""

from __future__ import annotations

from dataclasses import dataclass, field

from PolyPoseLib.errors import FAULT_STATUS, CancelledError, InputError, UntrustedResultError

DONE = 0
UNTRUSTED = UntrustedResultError.exit_status
WRONG_INPUT = InputError.exit_status
INTERRUPTED = CancelledError.exit_status

VERDICTS = ("failed", "wrong input", "untrusted", "done", "not run")
"""From the worst to what tells nothing."""


@dataclass(frozen=True)
class FileStamp:
    """What a file was when it was read: size (bytes), time of its last change (ns), and its content's SHA256."""

    size: int
    changed_ns: int
    sha256: str


@dataclass(frozen=True)
class Outcome:
    """What became of one study.

    Parameters
    ----------
    identity : str
        The study's name.
    exit_status : int or None
        Of its registration, as the command line has it; negative when the system killed it with that signal; None when
        it has not run.
    reason : str
        One sentence; empty when it is done.
    digest : str
        Of all that the result depends on.
    place : str
        Of the result's folder within the cohort's; empty where there is none.
    attempts : int
        Registrations that were started for this content.
    worker : str
        Machine of the last one.
    seconds, cpu_seconds : float
        Time and processor time of the last one, all threads.
    peak_memory_mib : float
        Largest memory in use of the last one; NaN where the system does not tell.
    expected_memory_mib : float
        That was set aside for it.
    transient : bool
        Whether the machine and not the study is at fault, so that another attempt may succeed.
    reused : bool
        Whether it is from an earlier run of the cohort.
    stamps : {str: FileStamp}
        Of the study's files, under digests of their paths.

    """

    identity: str
    exit_status: int | None = None
    reason: str = ""
    digest: str = ""
    place: str = ""
    attempts: int = 0
    worker: str = ""
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    peak_memory_mib: float = float("nan")
    expected_memory_mib: float = float("nan")
    transient: bool = False
    reused: bool = False
    stamps: dict[str, FileStamp] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """One of ``VERDICTS``."""
        if self.exit_status is None or self.exit_status == INTERRUPTED:
            return "not run"
        known = {DONE: "done", UNTRUSTED: "untrusted", WRONG_INPUT: "wrong input"}
        return known.get(self.exit_status, "failed")

    @property
    def has_result(self) -> bool:
        """Whether there is a result's folder."""
        return self.exit_status in (DONE, UNTRUSTED)

    def settles(self, digest: str, retry_failed: bool) -> bool:
        """Whether nothing has to run for this content."""
        if self.digest != digest or self.exit_status is None or self.transient:
            return False
        return self.has_result or (self.exit_status == WRONG_INPUT and not retry_failed)


def lost(identity: str, reason: str, exit_status: int = FAULT_STATUS) -> Outcome:
    """The outcome of a study whose worker did not tell one."""
    return Outcome(identity, exit_status, reason, transient=exit_status == FAULT_STATUS)
