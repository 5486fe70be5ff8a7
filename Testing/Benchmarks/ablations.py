"""Ablations: what the representation of the motion, the weight function, the rotation of tissue with bones, the number
of structures, labels that are too small, the number of views, the angle between them and noise do to the result.

Each study changes one setting of the usual case, two views of the pelvis or the chest 30 degrees apart with an
independent truth (see accuracy.py), and leaves all else as it is; rows that studies share are run once. Every
registration runs as its own process. With several seeds the tables have mean(SD) over them.

    python Testing/Benchmarks/ablations.py
    python Testing/Benchmarks/ablations.py --studies views angle --anatomy pelvis --seeds 0 1 2 3 4

Rows that are in the results file already are not run again unless --again is given; --list prints what is missing.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path

from ablation_cases import TITLES, Settings, points, prepare, settings_of
from ablation_tables import plot, write_tables
from benchmark_cases import STRUCTURES
from benchmark_runs import RESULTS, register_and_score
from benchmark_tables import machine
from system_fits import fit_and_score

from PolyPoseLib.io.truths import load_truth


def main() -> int:
    """Run what is missing, and write tables and plots after every row."""
    arguments = parse_arguments()
    store = arguments.output / f"{arguments.name}.json"
    rows = json.loads(store.read_text())["rows"] if store.is_file() else []
    rows = [row | {"settings": Settings.of(row).key()} for row in rows]
    wanted = list(planned(arguments))
    if not arguments.again:
        done = [row["settings"] for row in rows]
        wanted = [settings for settings in wanted if settings.key() not in done]
    if arguments.list:
        print("\n".join(describe(settings) for settings in wanted))
        print(f"{len(wanted)} registrations to run.")
        return 0
    arguments.work.mkdir(parents=True, exist_ok=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    for number, settings in enumerate(wanted[: arguments.at_most], start=1):
        row = {"settings": settings.key()} | run_row(settings, arguments)
        rows = [each for each in rows if each["settings"] != row["settings"]] + [row]
        store.write_text(json.dumps({"machine": machine(), "rows": rows}, indent=1) + "\n")
        report(rows, arguments)
        print(f"{number}/{len(wanted)} {describe(settings)}: {outcome(row)}", flush=True)
    report(rows, arguments)
    return 0


def parse_arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--studies", nargs="+", choices=tuple(TITLES), default=list(TITLES))
    parser.add_argument("--anatomy", nargs="+", choices=tuple(STRUCTURES), default=list(STRUCTURES))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument(
        "--preset", choices=("default", "fast", "paper"), default="default", help="of all studies but weights"
    )
    parser.add_argument(
        "--weight-presets",
        nargs="+",
        choices=("default", "fast", "paper"),
        default=["default", "paper"],
        help="of the study of weights (default: default paper)",
    )
    parser.add_argument(
        "--iterations",
        type=int,
        metavar="N",
        help="of the dense systems in the study of representations (default: the published 501, about ten CPU "
        "minutes each)",
    )
    parser.add_argument("--pixels", type=int, default=400, help="rows and columns of an X-ray of 430 mm")
    parser.add_argument("--threads", type=int, help="of a registration (default: all)")
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--limit", type=float, default=7200, metavar="SECONDS", help="of one registration")
    parser.add_argument("--work", type=Path, default=Path("benchmark-work"), help="where cases are kept")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the tables and plots")
    parser.add_argument("--name", default="ablations", help="of the results' files")
    parser.add_argument("--again", action="store_true", help="run rows again that are there already")
    parser.add_argument("--at-most", type=int, metavar="N", help="stop after so many registrations")
    parser.add_argument("--list", action="store_true", help="print what would be run, and stop")
    return parser.parse_args()


def planned(arguments: argparse.Namespace) -> Iterator[Settings]:
    """Every row of the chosen studies, once; one seed after another, so that an early stop leaves whole tables."""
    seen = set()
    for seed in arguments.seeds:
        for anatomy in arguments.anatomy:
            base = Settings(anatomy, seed, arguments.pixels, arguments.preset)
            for study in arguments.studies:
                for point in points(study, anatomy, arguments.weight_presets, [arguments.iterations]):
                    settings = settings_of(point, base)
                    if settings not in seen:
                        seen.add(settings)
                        yield settings


def run_row(settings: Settings, arguments: argparse.Namespace) -> dict:
    """Simulate if necessary, register, score."""
    study, stands_for, kept = prepare(settings, arguments.work)
    truth = load_truth(study.parent / "truth")
    if settings.system:
        row = fit_and_score(study, truth, settings.system, settings.iterations, arguments)
    else:
        row = register_and_score(study, truth, settings.tag(), arguments, stands_for=stands_for)
    return row | {"kept_percent": kept}


def report(rows: list[dict], arguments: argparse.Namespace) -> None:
    """Tables and plots of all rows that there are."""
    write_tables(rows, arguments.preset, arguments.output / f"{arguments.name}.md")
    plot(rows, arguments.preset, arguments.output / f"{arguments.name}.png")


def describe(settings: Settings) -> str:
    """What a row is, in one line."""
    return (
        f"{settings.anatomy} seed {settings.seed}, {settings.views} views over {settings.arc_deg:g} degrees, "
        f"{settings.photons:g} photons, {settings.tag()}"
    )


def outcome(row: dict) -> str:
    """What came out, in one line."""
    if "failed" in row:
        return f"failed with {row['exit_status']}: {row['failed'].splitlines()[-1:]}"
    summary = row["summary"]
    return (
        f"TRE {summary['mean_tre_mm']:.2f} mm, worst {summary['worst_tre_mm']:.2f} mm, "
        f"soft {summary['soft_error_mean_mm']:.2f} mm, folds {summary['folds_percent']:.4f} %, "
        f"{row['wall_seconds']:.0f} s, {row['peak_memory_mib']:.0f} MiB"
    )


if __name__ == "__main__":
    sys.exit(main())
