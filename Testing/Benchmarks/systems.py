"""Every compared system on simulated cases of the samples, by ``polypose benchmark`` as a user runs it.

Cases are made by ``polypose simulate``; motions and noise are those of the seeds. Trained systems take the weights that
train_baselines.py left in its --work folder, and are left out of a sample that has none there.

    python Testing/Benchmarks/systems.py --samples pelvis --seeds 21 22 --methods rest polypose paper rigid
    python Testing/Benchmarks/systems.py --work FOLDER --weights WORK_OF_train_baselines

Runs that the work folder has already are not run again, so that systems and seeds can be added.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
from pathlib import Path

from benchmark_runs import RESULTS
from benchmark_tables import machine

from PolyPoseLib.data.benchmark.job import TRAINED_SYSTEMS
from PolyPoseLib.io.benchmark.benchmark_folder import TABLES
from PolyPoseLib.io.benchmark.tables import LONG_TABLE

NAME = "systems"
METHODS = ("rest", "polypose", "polypose-found", "paper", "rigid", "dense-r3", "dense-se3")
METHODS += ("fdk-greedy", "fdk-elastix", "fdk-fireants", "fdk-convexadam", *TRAINED_SYSTEMS)
DETAILS = ("structures", "views")
"""Ends of the parts of a benchmark's long table that hold a number for every structure or held-out X-ray."""

FINISHED = (0, 3)
"""Exit statuses of a benchmark that has written its tables; 3 where a run failed."""


def main() -> int:
    """Make the cases, run the systems, and keep the tables."""
    arguments = parse_arguments()
    for folder in (arguments.work, arguments.output):
        folder.mkdir(parents=True, exist_ok=True)
    for sample in arguments.samples:
        make_cases(sample, arguments)
        status = run_systems(sample, arguments)
        if status not in FINISHED:
            return status
        keep_tables(sample, arguments)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", nargs="+", choices=("pelvis", "chest"), default=["pelvis", "chest"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[21, 22, 23, 24, 25])
    parser.add_argument("--views", nargs="+", default=["2x30"], help="number of views x arc in degrees")
    parser.add_argument("--methods", nargs="+", default=list(METHODS))
    parser.add_argument("--weights", type=Path, help="folder of train_baselines.py")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path, default=Path("systems"), help="where cases and runs are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables")
    return parser.parse_args()


def make_cases(sample: str, arguments: argparse.Namespace) -> None:
    """A folder with a case a seed; those that are there stay."""
    for seed in arguments.seeds:
        folder = arguments.work / f"cases-{sample}" / case_name(sample, seed)
        if not (folder / "truth").is_dir():
            folder.parent.mkdir(exist_ok=True)
            command = ["simulate", "--sample", sample, "--seed", str(seed), "--output", str(folder)]
            subprocess.run([sys.executable, "-m", "PolyPoseLib", *command, "--quiet"], check=True)


def run_systems(sample: str, arguments: argparse.Namespace) -> int:
    """The benchmark's exit status."""
    found = weight_files(sample, arguments)
    methods = [name for name in arguments.methods if name not in TRAINED_SYSTEMS or name in found]
    runs = runs_of(sample, arguments)
    command = [sys.executable, "-m", "PolyPoseLib", "benchmark", "simulated"]
    command += [str(arguments.work / f"cases-{sample}"), "--output", str(runs), "--methods", *methods]
    command += ["--subjects", *(case_name(sample, seed) for seed in arguments.seeds)]
    command += ["--views", *arguments.views]
    command += ["--threads", str(arguments.threads), "--jobs", str(arguments.jobs)]
    chosen = [f"{name}={found[name]}" for name in methods if name in found]
    command += ["--weights", *chosen] if chosen else []
    command += ["--resume"] if runs.is_dir() else []
    return subprocess.run(command).returncode


def weight_files(sample: str, arguments: argparse.Namespace) -> dict[str, Path]:
    """{system: file} of the trained systems whose weights are there, for the first set of views."""
    if arguments.weights is None:
        return {}
    files = {name: arguments.weights / f"{sample}-{arguments.views[0]}-{name}.pt" for name in TRAINED_SYSTEMS}
    return {name: file for name, file in files.items() if file.is_file()}


def keep_tables(sample: str, arguments: argparse.Namespace) -> None:
    """The benchmark's Markdown tables as one page, and all numbers of their rows that are no single structure's."""
    tables = runs_of(sample, arguments) / TABLES
    pages = [path.read_text(encoding="utf-8").strip() for path in sorted(tables.glob("table-*.md"))]
    measured = ", ".join(f"{key} {value}" for key, value in machine().items())
    text = "\n\n".join([*pages, f"## Measured on\n\n{measured}\n"])
    (arguments.output / f"{NAME}_{sample}.md").write_text(text, encoding="utf-8")
    with (tables / LONG_TABLE).open(encoding="utf-8", newline="") as source:
        rows = list(csv.DictReader(source))
    with (arguments.output / f"{NAME}_{sample}.csv").open("w", encoding="utf-8", newline="") as target:
        writer = csv.DictWriter(target, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(row for row in rows if row["part"].split()[-1] not in DETAILS)


def runs_of(sample: str, arguments: argparse.Namespace) -> Path:
    """The benchmark's folder."""
    return arguments.work / f"runs-{sample}"


def case_name(sample: str, seed: int) -> str:
    """A case's folder."""
    return f"{sample}-{seed}"


if __name__ == "__main__":
    sys.exit(main())
