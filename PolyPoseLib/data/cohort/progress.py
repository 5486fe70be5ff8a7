"""How far a cohort is: a step as registrations report it, with what became of the study that has just ended."""

from __future__ import annotations

import json
from dataclasses import dataclass

from PolyPoseLib.data.progress import Progress


@dataclass(frozen=True)
class CohortProgress(Progress):
    """One study has ended.

    Parameters
    ----------
    study : str
        Its name.
    verdict : str
        What became of it.
    exit_status : int or None
        Of its registration.
    reused : bool
        Whether that is known from an earlier run.
    untrusted, failed : int
        Studies so far that must not be trusted, and that failed.

    """

    study: str = ""
    verdict: str = ""
    exit_status: int | None = None
    reused: bool = False
    untrusted: int = 0
    failed: int = 0

    def to_json(self) -> str:
        """One JSON object on one line, which ``Progress.from_json`` reads as well."""
        more = {
            "study": self.study,
            "verdict": self.verdict,
            "exit_status": self.exit_status,
            "reused": self.reused,
            "untrusted": self.untrusted,
            "failed": self.failed,
        }
        return json.dumps({**json.loads(super().to_json()), **more})
