"""How far a benchmark is: a step as registrations report it, with what became of the run that has just ended."""

from __future__ import annotations

import json
from dataclasses import dataclass

from PolyPoseLib.data.progress import Progress

RUNNING = "running"
"""Status of a run that has begun."""


@dataclass(frozen=True)
class BenchmarkProgress(Progress):
    """One system has begun or ended on one case.

    Parameters
    ----------
    case, system : str
        Which.
    status : str
        "running", or "done", "failed" or "skipped" once it has ended.
    reused : bool
        Whether the row is of an earlier run.

    """

    case: str = ""
    system: str = ""
    status: str = ""
    reused: bool = False

    def to_json(self) -> str:
        """One JSON object on one line, which ``Progress.from_json`` reads as well."""
        more = {"case": self.case, "system": self.system, "status": self.status, "reused": self.reused}
        return json.dumps({**json.loads(super().to_json()), **more})
