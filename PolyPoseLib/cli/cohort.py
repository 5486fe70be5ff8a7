"""Subcommand cohort: many studies in, a folder of results with one table and one page out."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.cli._arguments import add_options, add_progress, given_options, new_parser
from PolyPoseLib.cli._console import progress_display, table
from PolyPoseLib.data.cohort.settings import CACHES, ClusterSettings, StudySettings
from PolyPoseLib.errors import InputError, UntrustedResultError

if TYPE_CHECKING:
    from PolyPoseLib.io.cohort.rows import StudySummary

WORST = 10
"""Studies that are listed at the end."""

_UNITS = {"": 1, "m": 1, "mib": 1, "mb": 1, "g": 1024, "gib": 1024, "gb": 1024}


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "cohort",
        "register many studies on this machine or on a cluster; an interrupted or extended cohort goes on",
        "list.csv --output registered --scheduler slurm --workers 20 --cores 16 --memory 32G",
    )
    parser.add_argument(
        "studies",
        type=Path,
        metavar="LIST.csv|FOLDER",
        help="table with the columns id and study, folder of folders with a study.json each, or BIDS-like data set",
    )
    parser.add_argument(
        "--output", type=Path, required=True, metavar="DIR", help="new folder, or that of an earlier run"
    )
    parser.add_argument(
        "--allow-outside", action="store_true", help="read files outside the list's and the studies' folders"
    )
    add_options(parser, "1 a study")
    add_progress(parser)
    _add_machines(parser)
    _add_repetition(parser)
    parser.set_defaults(run=run)


def _add_machines(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("machines")
    group.add_argument(
        "--scheduler",
        default="local",
        metavar="WHICH",
        help="local, tcp://... or tls://... of a running Dask scheduler, or slurm, pbs, sge, lsf, htcondor, moab, oar "
        "(default: local)",
    )
    group.add_argument(
        "--workers", type=int, metavar="N", help="processes here (default: 2), or jobs (default: 1)"
    )
    group.add_argument(
        "--cores", type=int, metavar="N", help="of a worker (default: this machine's share; of a job 16)"
    )
    group.add_argument(
        "--memory", metavar="SIZE", help="of a worker, such as 32G (default: this machine's share; 2G a core)"
    )
    group.add_argument("--walltime", default="24:00:00", metavar="H:M:S", help="of a job (default: 24:00:00)")
    group.add_argument("--queue", default="", metavar="NAME", help="queue or partition of jobs")
    group.add_argument("--account", default="", metavar="NAME", help="account or project of jobs")
    group.add_argument("--interface", default="", metavar="NAME", help="network interface, such as ib0")
    group.add_argument(
        "--directive",
        action="append",
        default=[],
        metavar="LINE",
        help="more for the head of the job script, as --directive=--constraint=ib; may be given several times",
    )
    group.add_argument(
        "--prologue",
        action="append",
        default=[],
        metavar="LINE",
        help="line of the job script before the worker; may be given several times",
    )
    group.add_argument("--print-job-script", action="store_true", help="print the job script, and exit")
    group.add_argument(
        "--numba-cache",
        choices=CACHES,
        default="worker",
        help="where compiled loops are kept: in a folder of each worker, or where they usually are (default: worker)",
    )


def _add_repetition(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("failures and repetition")
    group.add_argument(
        "--retries",
        type=int,
        default=2,
        metavar="N",
        help="further attempts, elsewhere where possible, of a study that was killed or ran out of memory (default: 2)",
    )
    group.add_argument("--time-limit", type=float, metavar="MIN", help="end a study that takes longer")
    group.add_argument(
        "--retry-failed", action="store_true", help="run studies again that failed by their own fault"
    )
    group.add_argument(
        "--rehash",
        action="store_true",
        help="read every file to see whether it has changed, not only those with another size or time",
    )


def run(arguments: argparse.Namespace) -> int:
    """Register what is not yet registered; raises UntrustedResultError when a study failed or must not be trusted."""
    from PolyPoseLib.cohort.packages import require_packages
    from PolyPoseLib.io.cohort.bids_derivative import write_description
    from PolyPoseLib.io.cohort.bids_layout import is_data_set
    from PolyPoseLib.io.cohort.cohort_folder import opened_cohort
    from PolyPoseLib.io.cohort.entries import read_entries

    require_packages()
    from PolyPoseLib.cohort.batch_systems import BATCH_SYSTEMS, job_script
    from PolyPoseLib.cohort.clusters import require_scheduler
    from PolyPoseLib.cohort.run import Cohort, run_cohort

    study, cluster = study_settings(arguments), cluster_settings(arguments)
    require_scheduler(cluster.scheduler)
    if arguments.print_job_script and cluster.scheduler not in BATCH_SYSTEMS:
        raise InputError(
            f"--print-job-script is of batch systems: give --scheduler {next(iter(BATCH_SYSTEMS))}."
        )
    entries = read_entries(arguments.studies, arguments.allow_outside)
    with opened_cohort(arguments.output, arguments.studies) as folder:
        if is_data_set(arguments.studies):
            write_description(folder, arguments.studies)
        if arguments.print_job_script:
            print(job_script(cluster, folder))
            return 0
        display = progress_display(arguments.progress)
        try:
            summaries = run_cohort(Cohort(entries, folder, study, cluster), display)
        finally:
            display.close()
    if arguments.progress != "json":
        print(f"{summary_table(summaries)}\n\nCohort: {arguments.output}")
    return _verdict(summaries, arguments.output)


def study_settings(arguments: argparse.Namespace) -> StudySettings:
    """How every study is registered; raises InputError naming the argument."""
    from PolyPoseLib.data.options import Options

    options = given_options(arguments)
    Options.from_dict(options)
    threads = options.pop("threads", 1)
    if arguments.time_limit is not None and not 0 < arguments.time_limit < 1e6:
        raise InputError(f"--time-limit is {arguments.time_limit}: give minutes, more than 0.")
    return StudySettings(
        options=options,
        threads=threads,
        allow_outside=arguments.allow_outside,
        limit_seconds=None if arguments.time_limit is None else 60 * arguments.time_limit,
        cache=arguments.numba_cache,
        retry_failed=arguments.retry_failed,
        rehash=arguments.rehash,
    )


def cluster_settings(arguments: argparse.Namespace) -> ClusterSettings:
    """The machines; raises InputError naming the argument."""
    for name, least, most in (("workers", 1, 10_000), ("cores", 1, 4096), ("retries", 0, 100)):
        value = getattr(arguments, name)
        if value is not None and not least <= value <= most:
            raise InputError(f"--{name} is {value}: give a whole number from {least} to {most}.")
    for name in ("queue", "account", "interface", "directive", "prologue"):
        value = getattr(arguments, name)
        for each in value if isinstance(value, list) else [value]:
            if not each.isprintable():
                raise InputError(
                    f"--{name} holds a line's end or another sign that is not printed: leave it out."
                )
    return ClusterSettings(
        scheduler=arguments.scheduler,
        workers=arguments.workers,
        cores=arguments.cores,
        memory_mib=None if arguments.memory is None else mib_of(arguments.memory),
        walltime=arguments.walltime,
        queue=arguments.queue,
        account=arguments.account,
        directives=tuple(arguments.directive),
        prologue=tuple(arguments.prologue),
        interface=arguments.interface,
        retries=arguments.retries,
    )


def mib_of(text: str) -> int:
    """MiB of a size such as 32G or 900M; raises InputError."""
    found = re.fullmatch(r"(\d{1,7}(?:\.\d{1,3})?)\s*([a-z]*)", text.strip().lower())
    size = float(found[1]) * _UNITS[found[2]] if found and found[2] in _UNITS else 0
    if not 1 <= size < 1 << 30:
        raise InputError(f"--memory is {text[:40]!r}: give a size such as 32G or 900M.")
    return int(size)


def summary_table(summaries: Sequence[StudySummary]) -> str:
    """The worst studies, and how many there are of each verdict."""
    rows = [
        (
            each.outcome.identity,
            each.outcome.verdict,
            len(each.doubtful) if each.structures else None,
            each.largest_interval_mm,
            each.outcome.cpu_seconds,
            each.outcome.peak_memory_mib,
        )
        for each in summaries[:WORST]
    ]
    lines = [table(("study", "verdict", "uncertain", "95 % mm", "CPU s", "MiB"), rows)]
    more = len(summaries) - WORST
    if more > 0:
        lines.append(f"and {more} more, see index.html")
    reused = sum(each.outcome.reused for each in summaries)
    if reused:
        lines.append(f"{reused} of {len(summaries)} were registered by an earlier run and have not changed")
    return "\n".join(lines)


def _verdict(summaries: Sequence[StudySummary], output: Path) -> int:
    """0 when all are done; raises UntrustedResultError, which says how many are not."""
    from PolyPoseLib.cohort.run import verdict_counts

    counts = verdict_counts(summaries)
    untrusted = counts.get("untrusted", 0)
    failed = len(summaries) - untrusted - counts.get("done", 0)
    if not untrusted and not failed:
        return 0
    parts = [f"{untrusted} must not be trusted"] if untrusted else []
    parts += [f"{failed} failed"] if failed else []
    raise UntrustedResultError(
        f"Of {len(summaries)} studies {' and '.join(parts)}: see {output / 'index.html'}."
    )
