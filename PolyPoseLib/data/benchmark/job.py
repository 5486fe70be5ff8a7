"""What is asked of the processes of a benchmark."""

from __future__ import annotations

from dataclasses import dataclass

DATASETS = ("deepfluoro", "headneck", "thoraxcbct", "simulated")
"""Layouts that are read."""

TRAINED_SYSTEMS = ("liftreg", "2d3d-regnet")
"""Whose weights ``polypose train`` makes; they know the CTs of their training."""

DONE, FAILED, SKIPPED = STATUSES = ("done", "failed", "skipped")
"""Of a row: with scores, without by its own fault, without because it cannot run here."""

UNREAD = "unread"
"""In place of the digest of a case that could not be read."""

NOT_SEEN, UNKNOWN, CT, TRUTH = TRAINED_ON = ("", "unknown", "ct", "truth")
"""Of a row: its weights were trained on no CT of its case as far as is known, do not say on which, on the CT that is
registered, or on that of the X-rays' posture."""


@dataclass(frozen=True)
class CaseSource:
    """Where cases are read from, again by every process that needs one.

    Attributes
    ----------
    dataset : str
        One of ``DATASETS``.
    root : str
        Folder or file of the data.
    subject : str
        As its reader lists it; a patient with several pairs of scans is listed once for each.
    views : str
        One set of views by the name that its reader has for it, as a rule "2x30": number of views x arc in degrees.

    """

    dataset: str
    root: str
    subject: str
    views: str


@dataclass(frozen=True)
class RunSettings:
    """What is the same for every run of a benchmark, so that times can be compared.

    Attributes
    ----------
    threads : int
        Of the processor, for each run.
    device : str
        "cpu" or "cuda".
    seed : int
        Of whatever is random.

    """

    threads: int = 1
    device: str = "cpu"
    seed: int = 0


@dataclass(frozen=True)
class KnownCase:
    """A case that has been read once.

    Attributes
    ----------
    source : CaseSource
        By which it is read again.
    name, subject, views : str
        As ``BenchmarkCase`` has them.
    digest : str
        SHA256 of the files that it is made of and of what rendered its X-rays: of nothing that is computed, which
        differs by the last bit between processors and versions of libraries.
    stamp : str
        Of the same, by the files' sizes and times: whether it still is the case that was read.

    """

    source: CaseSource
    name: str
    subject: str
    views: str
    digest: str
    stamp: str


@dataclass(frozen=True)
class RunJob:
    """One system on one case.

    Attributes
    ----------
    case : KnownCase
        What it is given.
    system : str
        As the tables have it.
    path : str
        "module:Class".
    settings : RunSettings
        How it runs.
    folder : str
        Of the benchmark.
    digest : str
        SHA256 of all that the row depends on.
    system_digest : str
        SHA256 of the system's code, as far as that is known.
    weights_digest : str
        What tells the weights of a line of a table from others: SHA256 of the file; empty without one.
    weights : str
        Its file of trained weights; empty without.
    keep_field, draw : bool
        Whether the field is written, and pictures of the case, too.

    """

    case: KnownCase
    system: str
    path: str
    settings: RunSettings
    folder: str
    digest: str
    system_digest: str
    weights_digest: str = ""
    weights: str = ""
    keep_field: bool = False
    draw: bool = False
