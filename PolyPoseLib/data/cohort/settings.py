"""How the studies of a cohort are registered, and on which machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

THREADS = "POLYPOSE_THREADS"
MEMORY = "POLYPOSE_MIB"
"""Resources that a worker offers and a study takes: processor threads, and memory in MiB."""

CACHES = ("worker", "usual")
"""Where compiled loops are kept: in a folder of each worker, or where numba keeps them by itself."""


@dataclass(frozen=True)
class StudySettings:
    """How every study of a cohort is registered.

    Parameters
    ----------
    options : mapping
        Options that win over the studies' own: preset, device, seed.
    threads : int
        Processor threads of one registration.
    allow_outside : bool
        Whether studies may read files outside of their folders.
    limit_seconds : float or None
        A registration that takes longer is ended.
    cache : {"worker", "usual"}
        Where compiled loops are kept.
    retry_failed : bool
        Whether a study that failed before by its own fault runs again although nothing of it has changed.
    rehash : bool
        Whether all files are read to see whether they have changed, and not only those whose size or time is new.
    program : tuple of str
        Beginning of the command that registers; none for this version's own.

    """

    options: Mapping[str, Any] = field(default_factory=dict)
    threads: int = 1
    allow_outside: bool = False
    limit_seconds: float | None = None
    cache: str = "worker"
    retry_failed: bool = False
    rehash: bool = False
    program: tuple[str, ...] = ()


@dataclass(frozen=True)
class ClusterSettings:
    """The machines that register.

    Parameters
    ----------
    scheduler : str
        "local", the address of a running Dask scheduler, or the name of a batch system.
    workers : int or None
        Worker processes on this machine, or jobs of the batch system.
    cores : int or None
        Processor cores of one worker.
    memory_mib : int or None
        Memory of one worker.
    walltime : str
        Of a job, such as 24:00:00.
    queue, account : str
        Of the batch system, where it wants them.
    directives : tuple of str
        Further lines of the job script's head, such as ``--constraint=ib``.
    prologue : tuple of str
        Lines of the job script before the worker starts, such as ``module load python``.
    interface : str
        Network interface between the jobs and this machine.
    retries : int
        How often a study is tried again, elsewhere where possible, after it was killed or ran out of memory.

    """

    scheduler: str = "local"
    workers: int | None = None
    cores: int | None = None
    memory_mib: int | None = None
    walltime: str = "24:00:00"
    queue: str = ""
    account: str = ""
    directives: tuple[str, ...] = ()
    prologue: tuple[str, ...] = ()
    interface: str = ""
    retries: int = 2
