"""Batch systems whose jobs are workers, by dask-jobqueue."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from PolyPoseLib.cohort.packages import jobqueue
from PolyPoseLib.data.cohort.settings import MEMORY, THREADS, ClusterSettings
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.cohort_folder import LOGS, WORKER_LOGS

BATCH_SYSTEMS = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "lsf": "LSFCluster",
    "htcondor": "HTCondorCluster",
    "moab": "MoabCluster",
    "oar": "OARCluster",
}
"""Names of batch systems and their classes in dask_jobqueue."""

USUAL_CORES = 16
USUAL_MIB_PER_CORE = 2048
"""Of a job, where nothing is given."""

_WALLTIME = re.compile(r"(?:\d+-)?\d{1,3}(?::\d{2}){0,2}")

_WITH_ACCOUNT = ("slurm", "pbs", "sge", "moab", "lsf", "oar")


def worker_resources(settings: ClusterSettings) -> dict[str, int]:
    """What a job offers: threads and MiB of memory."""
    cores = settings.cores or USUAL_CORES
    memory = settings.memory_mib or USUAL_MIB_PER_CORE * cores
    return {THREADS: cores, MEMORY: memory}


def batch_cluster(settings: ClusterSettings, folder: Path) -> Any:
    """A cluster of jobs, none of which is submitted yet.

    Parameters
    ----------
    settings : ClusterSettings
        Which batch system, and what a job is.
    folder : Path
        Of the cohort, seen by all machines; logs of jobs and the keys of this run go there.

    Raises
    ------
    InputError
        A walltime that is none, or the batch system's class refuses the settings.

    """
    if not _WALLTIME.fullmatch(settings.walltime):
        raise InputError(
            f"--walltime is {settings.walltime!r}: give hours, minutes, seconds, as in 24:00:00."
        )
    resources = worker_resources(settings)
    given: dict[str, Any] = {
        "cores": resources[THREADS],
        "processes": 1,
        "memory": f"{resources[MEMORY]} MiB",
        "job_name": "polypose",
        "log_directory": str(folder / LOGS / WORKER_LOGS),
        "worker_extra_args": ["--resources", _as_argument(resources), "--no-dashboard"],
        "job_extra_directives": list(settings.directives),
        "job_script_prologue": ["export OMP_NUM_THREADS=1", *settings.prologue],
        # Whoever reaches a worker's port could run code as this user: both ends show a key that this run has made.
        "security": True,
        "shared_temp_directory": str(folder),
        "scheduler_options": {"dashboard_address": "127.0.0.1:0"},
        "config_name": settings.scheduler,
    }
    if settings.scheduler != "htcondor":
        given["walltime"] = settings.walltime
    if settings.queue:
        given["queue"] = settings.queue
    if settings.account and settings.scheduler in _WITH_ACCOUNT:
        given["project" if settings.scheduler in ("lsf", "oar", "sge") else "account"] = settings.account
    if settings.interface:
        given["interface"] = settings.interface
    if settings.scheduler == "htcondor":
        given["disk"] = f"{resources[MEMORY]} MiB"
    try:
        return getattr(jobqueue(), BATCH_SYSTEMS[settings.scheduler])(**given)
    except (ValueError, TypeError, OSError) as error:
        raise InputError(f"--scheduler {settings.scheduler}: the settings are refused: {error}.") from error


def job_script(settings: ClusterSettings, folder: Path) -> str:
    """The text of the script by which a job starts a worker."""
    cluster = batch_cluster(settings, folder)
    try:
        return cluster.job_script()
    finally:
        cluster.close()


def _as_argument(resources: dict[str, int]) -> str:
    """Resources as the worker's command line has them."""
    return ",".join(f"{name}={count}" for name, count in resources.items())
