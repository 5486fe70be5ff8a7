"""The machines that register: this one, those of a running Dask scheduler, or jobs of a batch system."""

from __future__ import annotations

import gc
import logging
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit, urlunsplit

from PolyPoseLib import __version__
from PolyPoseLib.cohort.batch_systems import BATCH_SYSTEMS, batch_cluster, worker_resources
from PolyPoseLib.data.cohort.settings import MEMORY, THREADS, ClusterSettings
from PolyPoseLib.errors import InputError, one_line, unknown_name
from PolyPoseLib.io.cohort.cohort_folder import CLUSTER_LOG, LOGS, WORKER_LOGS, WORKERS_LOG
from PolyPoseLib.io.machine_memory import memory_left

if TYPE_CHECKING:
    from distributed import Client

_LOG = logging.getLogger(__name__)

SHARE = 0.9
"""Of this machine's free memory that studies may take."""

USUAL_WORKERS = 2
"""On this machine: one goes on when the other one ends."""

_ADDRESSES = ("tcp://", "tls://", "ucx://", "ws://", "wss://")

_CONNECT_SECONDS = 20
_WAIT_SECONDS = 60


@dataclass(frozen=True)
class Machines:
    """Connected workers.

    Parameters
    ----------
    client : distributed.Client
        Connected to the scheduler.
    dashboard : str
        Address of the page that shows the workers; empty where there is none.
    resources : {str: float} or None
        The largest that one worker offers; None where workers say nothing of it, so that nothing is set aside.

    """

    client: Client
    dashboard: str
    resources: Mapping[str, float] | None


def require_scheduler(name: str) -> None:
    """Refuse a --scheduler that is none; raises InputError."""
    if name != "local" and name not in BATCH_SYSTEMS and not name.startswith(_ADDRESSES):
        raise InputError(
            f"--scheduler {name[:100]}: "
            + unknown_name("scheduler", name, ("local", *BATCH_SYSTEMS))
            + " The address of a running one begins with tcp:// or tls://."
        )


@contextmanager
def machines(settings: ClusterSettings, folder: Path) -> Iterator[Machines]:
    """Workers for a block, which ends those that it has started.

    Parameters
    ----------
    settings : ClusterSettings
        Which ones.
    folder : Path
        Of the cohort, for logs.

    Raises
    ------
    InputError
        The scheduler cannot be reached, its workers lack this program or the cohort's folder, or a setting is refused.

    """
    import dask.config
    from distributed import Client

    require_scheduler(settings.scheduler)
    limits = {
        "distributed.scheduler.allowed-failures": settings.retries,
        "distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical",  # of processes of this machine
    }
    with ExitStack() as stack:
        stack.enter_context(_logged(folder / LOGS / WORKER_LOGS / CLUSTER_LOG))
        stack.enter_context(dask.config.set(limits))
        if settings.scheduler.startswith(_ADDRESSES):
            yield stack.enter_context(_connected(settings.scheduler, folder))
            return
        if settings.scheduler == "local":
            resources, cluster = stack.enter_context(_local(settings))
        else:
            resources, cluster = (
                worker_resources(settings),
                stack.enter_context(batch_cluster(settings, folder)),
            )
            cluster.scale(jobs=settings.workers or 1)
        client = stack.enter_context(Client(cluster, set_as_default=False))
        stack.callback(_collect_logs, client, folder / LOGS / WORKER_LOGS)
        yield Machines(client, _on_loopback(cluster.dashboard_link), resources)


@contextmanager
def _local(settings: ClusterSettings) -> Iterator[tuple[dict[str, int], Any]]:
    """Processes of this machine, reached over the loopback alone and by a key that is made for this run."""
    from distributed import LocalCluster

    count, resources = local_workers(settings)
    with (
        tempfile.TemporaryDirectory(prefix="polypose-cohort-", ignore_cleanup_errors=True) as scratch,
        LocalCluster(
            n_workers=count,
            threads_per_worker=resources[THREADS],
            processes=True,
            host="127.0.0.1",
            security=True,
            dashboard_address="127.0.0.1:0",
            memory_limit=0,  # Dask would look at the worker alone; studies are processes beside it
            resources=resources,
            local_directory=scratch,
            preload="PolyPoseLib.cohort.worker_preload",
            silence_logs=logging.CRITICAL,
        ) as cluster,
    ):
        yield resources, cluster


def local_workers(settings: ClusterSettings) -> tuple[int, dict[str, int]]:
    """How many workers this machine has, and what each offers."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    count = settings.workers or min(USUAL_WORKERS, cores)
    left = min((each.left for each in memory_left() if not each.is_address_space), default=4 << 30)
    each = settings.memory_mib or max(1, int(SHARE * left / count) >> 20)
    return count, {THREADS: settings.cores or max(1, cores // count), MEMORY: each}


def _on_loopback(link: str) -> str:
    """The dashboard's address as it is served: on this machine alone, whatever the machine's name is to the jobs."""
    parts = urlsplit(link)
    return urlunsplit(parts._replace(netloc=f"127.0.0.1:{parts.port}")) if parts.port else link


@contextmanager
def _connected(address: str, folder: Path) -> Iterator[Machines]:
    """A running scheduler."""
    with _client_of(address) as client, ExitStack() as stack:
        stack.callback(_collect_logs, client, folder / LOGS / WORKER_LOGS)
        try:
            client.wait_for_workers(1, timeout=_WAIT_SECONDS)
        except TimeoutError as error:
            raise InputError(
                f"--scheduler {address}: it has no worker after {_WAIT_SECONDS} s: start one."
            ) from error
        _require_fit(client, address, folder)
        resources = _offered(client)
        if resources is None:
            _LOG.warning(
                "The workers offer no memory and threads, so that nothing is set aside for a study: start them with "
                "--resources %s=...,%s=... .",
                THREADS,
                MEMORY,
            )
        yield Machines(client, client.dashboard_link or "", resources)


def _client_of(address: str) -> Client:
    """A client of the scheduler at an address; raises InputError where there is none."""
    from distributed import Client

    failure = ""
    try:
        return Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        failure = one_line(str(error))
    if "ssl_context" in failure:
        failure = (
            "Dask's settings name no certificate: distributed.comm.tls.ca-file, .client.cert and .client.key"
        )
    gc.collect()  # a client that has failed must not be disposed of while another one starts: both would wait for ever
    raise InputError(
        f"--scheduler {address}: there is no Dask scheduler to be reached ({failure}): start one, or correct it."
    )


def _require_fit(client: Client, address: str, folder: Path) -> None:
    """Refuse workers that lack this version of the program, or the cohort's folder; raises InputError."""
    try:
        found: Any = client.run(worker_view, str(folder))
    except Exception as error:  # whatever a foreign worker answers
        raise InputError(
            f"--scheduler {address}: its workers cannot run PolyPose ({error}): install version {__version__} there."
        ) from error
    for version, there in found.values():
        if version != __version__:
            raise InputError(
                f"--scheduler {address}: a worker has PolyPose {version}, this is {__version__}: install the same."
            )
        if not there:
            raise InputError(
                f"--scheduler {address}: a worker does not see {folder}: choose an --output on a shared disk."
            )


def worker_view(folder: str) -> tuple[str, bool]:
    """The version of a worker, and whether it can write into a folder."""
    return __version__, os.path.isdir(folder) and os.access(folder, os.W_OK | os.X_OK)


def workers_of(client: Client) -> dict[str, dict[str, Any]]:
    """What is known of every worker, by its address."""
    try:
        known: Any = client.scheduler_info(n_workers=-1)  # some versions tell of five where this is not given
    except TypeError:  # others do not know it
        known = client.scheduler_info()
    return known["workers"]


def _offered(client: Client) -> dict[str, float] | None:
    """The largest resources of any worker; None where none offers both."""
    offers = [each.get("resources") or {} for each in workers_of(client).values()]
    both = [each for each in offers if THREADS in each and MEMORY in each]
    return max(both, key=lambda each: each[MEMORY]) if both else None


def _collect_logs(client: Client, folder: Path) -> None:
    """Keep what scheduler and workers have said, a file each; those that are gone have kept theirs."""
    try:
        of_workers: Any = client.get_worker_logs()
        logs = {"scheduler": client.get_scheduler_logs(), **of_workers}
    except Exception as error:
        _LOG.debug("the logs of the workers could not be had: %s", error)
        return
    lines = [f"[{name}] {level} {text}" for name, each in logs.items() for level, text in reversed(each)]
    (folder / WORKERS_LOG).write_text("\n".join([*lines, ""]), encoding="utf-8", errors="backslashreplace")


@contextmanager
def _logged(path: Path) -> Iterator[None]:
    """What the scheduler and its parts say goes into a file, and not between the lines for people."""
    logger = logging.getLogger("distributed")
    kept, propagate = list(logger.handlers), logger.propagate
    handler = logging.FileHandler(path, mode="w", encoding="utf-8", delay=True)
    handler.setFormatter(logging.Formatter("%(asctime)s %(name)s %(levelname)s %(message)s"))
    logger.handlers[:], logger.propagate = [handler], False
    try:
        yield
    finally:
        logger.handlers[:], logger.propagate = kept, propagate
        handler.close()
