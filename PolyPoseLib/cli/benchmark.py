"""Subcommand benchmark: systems on the cases of a data set, scored, as tables and figures."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.cli._arguments import add_progress, new_parser
from PolyPoseLib.cli._benchmark_lines import EndedRuns, RunLines
from PolyPoseLib.cli._benchmark_weights import weight_files
from PolyPoseLib.cli._console import progress_display, table
from PolyPoseLib.cli._data_sets import chosen_subjects, chosen_views
from PolyPoseLib.data.benchmark.job import DATASETS, DONE, FAILED, SKIPPED, CaseSource, RunSettings
from PolyPoseLib.data.options import RANGES
from PolyPoseLib.errors import InputError, UntrustedResultError, one_line

if TYPE_CHECKING:
    from PolyPoseLib.benchmark.systems import NamedSystem

USUAL_METHODS = ("rest", "polypose")

MOST_JOBS = 256

DATA_HELP = (
    "the data, never written to: of deepfluoro its HDF5 file or the folder of its subjects, of headneck the folder "
    "with one folder a patient, of thoraxcbct the folder with imagesTr, of simulated the folder of one case or of "
    "several; where to get them: docs/benchmark-data.md"
)


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "benchmark",
        "compare systems on a data set, each case and system in a process of its own, in tables and figures",
        "headneck data/headneck --methods rest polypose dense-r3 --views 2x180 3x180 --output compared",
    )
    parser.add_argument(
        "dataset", choices=DATASETS, help="layout of the data; simulated: of polypose simulate"
    )
    parser.add_argument("data", type=Path, metavar="DATA", help=DATA_HELP)
    parser.add_argument(
        "--output",
        type=Path,
        required=True,
        metavar="DIR",
        help="new folder for tables, figures and rows; with --resume an earlier run's",
    )
    parser.add_argument(
        "--methods",
        nargs="+",
        default=list(USUAL_METHODS),
        metavar="SYSTEM",
        help="systems to compare: names that --list shows, all for all of these, or module:Class or NAME=module:Class "
        "of your own (default: rest polypose)",
    )
    parser.add_argument(
        "--list",
        action=_ListSystems,
        nargs=0,
        help="list the systems, what they are and whether they can run here, and exit",
    )
    parser.add_argument(
        "--subjects", nargs="+", metavar="NAME", help="only these patients or cases (default: all)"
    )
    parser.add_argument(
        "--views",
        nargs="+",
        metavar="VIEWS",
        help="sets of X-rays, each a case of its own: number x degrees over which they are spread, such as 2x30 3x120, "
        "own for those of a simulated case, or of deepfluoro numbers of frames such as 10+9 (default: those of the "
        "paper, or own)",
    )
    parser.add_argument(
        "--weights",
        nargs="+",
        default=[],
        metavar="SYSTEM=FILE",
        help="files of trained weights, for systems that --list shows to need them; SYSTEM@VIEWS=FILE or "
        "SYSTEM@SUBJECT=FILE, as in liftreg@2x30=FILE, for these views or this subject alone; nothing is downloaded",
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on with the run in DIR: only what has no scores yet, or has changed",
    )
    parser.add_argument(
        "--keep-fields",
        action="store_true",
        help="keep the displacement field of every run, as an ITK transform",
    )
    parser.add_argument(
        "--draw",
        action="store_true",
        help="draw pictures of every run: what still differs from the true CT, and the deformation",
    )
    group = parser.add_argument_group("fair conditions, the same for all systems")
    group.add_argument(
        "--threads", type=int, default=1, metavar="N", help="CPU threads of a run (default: 1)"
    )
    group.add_argument(
        "--device", choices=("cpu", "cuda"), default="cpu", help="where to compute (default: cpu)"
    )
    group.add_argument("--seed", type=int, default=0, metavar="N", help="of every random choice (default: 0)")
    group.add_argument(
        "--limit", type=float, metavar="SECONDS", help="end a run that takes longer (default: none)"
    )
    group.add_argument(
        "--jobs",
        type=int,
        default=1,
        metavar="N",
        help="runs at the same time, which makes each slower (default: 1)",
    )
    add_progress(parser)
    parser.set_defaults(run=run, computes=True)


class _ListSystems(argparse.Action):
    """Print every system, and whether it can run here, and exit."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from PolyPoseLib.benchmark.systems import SYSTEMS

        heads = ("system", "what it is", "--weights", "packages", "here")
        print(table(heads, [system_line(name, path) for name, path in SYSTEMS.items()]))
        parser.exit()


def system_line(name: str, path: str) -> tuple[str, ...]:
    """Name of a system, what it is, whether it takes weights, packages that it needs, and whether it can run here."""
    from PolyPoseLib.benchmark.systems import ABOUT, installing, load_system, missing_packages
    from PolyPoseLib.benchmark.weight_checks import weights_word

    about, weights = ABOUT[name], weights_word(name)
    try:
        system = load_system(path)
    except (ImportError, InputError) as error:
        return name, about, weights, "-", f"no: {one_line(str(error))}"
    missing = missing_packages(system)
    here = f"no: {installing(system, missing)}" if missing else "yes"
    return name, about, weights, " ".join(system.needs) or "-", here


def run(arguments: argparse.Namespace) -> int:
    """Run, and write tables and figures; raises UntrustedResultError when systems have no scores."""
    from PolyPoseLib.benchmark.comparable_rows import comparable_rows
    from PolyPoseLib.benchmark.outputs import write_outputs
    from PolyPoseLib.benchmark.run import Benchmark, run_benchmark
    from PolyPoseLib.io.benchmark.benchmark_folder import opened_benchmark

    systems, settings = checked(arguments)
    sources = case_sources(arguments)
    weights = weight_files(arguments.weights, systems, sources)
    with opened_benchmark(arguments.output, arguments.dataset, arguments.data, arguments.resume) as folder:
        benchmark = Benchmark(
            sources,
            systems,
            folder,
            settings,
            weights=weights,
            jobs=arguments.jobs,
            limit_seconds=arguments.limit,
            keep_fields=arguments.keep_fields,
            draw=arguments.draw,
        )
        display = (
            RunLines() if arguments.progress == "bar" else EndedRuns(progress_display(arguments.progress))
        )
        try:
            rows = run_benchmark(benchmark, display)
        finally:
            display.close()
        write_outputs(comparable_rows(rows, folder), folder)
    if arguments.progress != "json":
        print(f"{summary(rows, systems)}\n\nBenchmark: {arguments.output}")
    return _verdict(rows, arguments.output)


def checked(arguments: argparse.Namespace) -> tuple[tuple[NamedSystem, ...], RunSettings]:
    """The systems and the settings of all runs; raises InputError naming the argument."""
    from PolyPoseLib.benchmark.systems import named_systems

    for name, (least, most) in (
        ("threads", RANGES["threads"]),
        ("jobs", (1, MOST_JOBS)),
        ("seed", RANGES["seed"]),
    ):
        value = getattr(arguments, name)
        if not least <= value <= most:
            raise InputError(f"--{name} is {value}: give a whole number from {least:g} to {most:g}.")
    limit = arguments.limit
    if limit is not None and not (math.isfinite(limit) and 0 < limit <= 1e7):
        raise InputError(f"--limit is {limit:g}: give seconds, more than 0.")
    settings = RunSettings(arguments.threads, arguments.device, arguments.seed)
    return named_systems(arguments.methods), settings


def case_sources(arguments: argparse.Namespace) -> tuple[CaseSource, ...]:
    """What is read for each subject; raises InputError for wrong data and for subjects that there are not."""
    from PolyPoseLib.io.benchmark.readers import READERS

    data, reader = arguments.data, READERS[arguments.dataset]
    sets = chosen_views(reader, arguments.views)
    subjects = chosen_subjects(reader, data, arguments.subjects)
    return tuple(
        CaseSource(arguments.dataset, str(data.resolve()), name, views) for name in subjects for views in sets
    )


def summary(rows: Sequence[dict[str, Any]], systems: Sequence[NamedSystem]) -> str:
    """How many runs of each system have scores, and what they took."""
    lines = []
    for system in systems:
        own = [row for row in rows if row["system"] == system.name]
        done = [row for row in own if row["status"] == DONE]
        counts = [sum(row["status"] == status for row in own) for status in (DONE, FAILED, SKIPPED)]
        seconds, memory = _numbers(done, "cpu_seconds"), _numbers(done, "peak_memory_mib")
        mean = sum(seconds) / len(seconds) if seconds else math.nan
        lines.append((system.name, *counts, mean, max(memory, default=math.nan)))
    return table(("system", "done", "failed", "skipped", "CPU s, mean", "memory MiB, most"), lines)


def _numbers(rows: Sequence[dict[str, Any]], name: str) -> list[float]:
    """Those of the rows that have one."""
    return [float(row[name]) for row in rows if row[name] is not None]


def _verdict(rows: Sequence[dict[str, Any]], output: Path) -> int:
    """0 when all runs have scores; raises UntrustedResultError, which says how many have not."""
    counts = {status: sum(row["status"] == status for row in rows) for status in (FAILED, SKIPPED)}
    parts = [
        f"{count} {'were ' if status == SKIPPED else ''}{status}" for status, count in counts.items() if count
    ]
    if not parts:
        return 0
    raise UntrustedResultError(
        f"Of {len(rows)} runs {' and '.join(parts)}: the rows and logs in {output} say why."
    )
