"""Which file of trained weights a run is given: one for all cases, for a set of views, or for a subject."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from PolyPoseLib.benchmark.systems import weights_names
from PolyPoseLib.data.benchmark.job import CaseSource

AT = "@"
"""Parts a system from the views or the subject that a file is for: "liftreg@2x30"."""

PER_SUBJECT = "one for each subject"
"""In place of the digest of a file, so that subjects with files of their own share a line of a table."""


@dataclass(frozen=True)
class GivenWeights:
    """A file of weights, and whether it is for one subject alone."""

    path: Path
    of_subject: bool


def given_weights(files: Mapping[str, Path], system: str, source: CaseSource) -> GivenWeights | None:
    """The file for a system on a source, or None.

    A file for the subject goes before one for the views, and that before one for all cases.

    Parameters
    ----------
    files : {str: Path}
        By "system", "system@views" or "system@subject".
    system : str
        Its name in the tables.
    source : CaseSource
        Of the case.

    """
    for part in (AT + source.subject, AT + source.views, ""):
        for name in weights_names(system):
            if name + part in files:
                return GivenWeights(files[name + part], part == AT + source.subject)
    return None
