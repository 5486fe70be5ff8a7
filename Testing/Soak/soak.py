"""Many registrations in one process: what does it still hold at the end?

    python Testing/Soak/soak.py --registrations 200

A tiny phantom is registered again and again; every tenth run is cancelled midway, at another step each time, and every
tenth result is saved with its report. Afterwards memory must be within 2 % of what it was after the warm-up, and no
open file, thread or child process may be left. Ends with exit status 1 where something is.
"""

from __future__ import annotations

import argparse
import gc
import os
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "Core" / "support"))

from tiny_case import tiny_case

from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import CancelledError
from PolyPoseLib.io.results import save_result
from PolyPoseLib.pipeline import register
from PolyPoseLib.simulation.case_study import case_to_study

WARM_UP = 20
"""Registrations before the first comparison: caches fill, and the allocator finds its size."""

WINDOW = 20
"""Registrations whose median memory is compared."""

LARGEST_GROWTH = 0.02

_OPTIONS = {"preset": "fast", "seed": 1, "threads": 1}


@dataclass(frozen=True)
class Holdings:
    """What a process holds: resident bytes, open files, threads, child processes."""

    memory: int
    files: frozenset[str]
    threads: int
    children: frozenset[int]

    @classmethod
    def now(cls) -> Holdings:
        """Of this process (Linux)."""
        gc.collect()
        folder = Path("/proc/self/fd")
        files = set()
        for each in os.listdir(folder):
            try:
                files.add(f"{each} {os.readlink(folder / each)}")
            except OSError:
                continue  # the listing's own
        tasks = os.listdir("/proc/self/task")
        children = {
            int(pid) for task in tasks for pid in Path(f"/proc/self/task/{task}/children").read_text().split()
        }
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return cls(pages * os.sysconf("SC_PAGE_SIZE"), frozenset(files), len(tasks), frozenset(children))


def tiny_studies() -> list[Study]:
    """One tiny case, with initial and with known cameras."""
    simulated = tiny_case()
    return [case_to_study(simulated, options=_OPTIONS, camera=camera) for camera in ("initial", "known")]


def soak(studies: list[Study], registrations: int) -> list[Holdings]:
    """Register in turns, again and again; returns what was held after each."""
    held = []
    for number in range(registrations):
        tiny = studies[number // 2 % len(studies)]
        if number % 10 == 9:
            register_until(tiny, 1 + number // 10)
        else:
            result = register(tiny)
            if number % 10 == 4:
                with tempfile.TemporaryDirectory() as folder:
                    save_result(result, Path(folder) / "result")
        held.append(Holdings.now())
        print(
            f"{number + 1:4d}  {held[-1].memory / 2**20:8.1f} MiB  {len(held[-1].files)} files  "
            f"{held[-1].threads} threads  {time.process_time():.0f} CPU s",
            flush=True,
        )
    return held


def register_until(tiny: Study, step: int) -> None:
    """Register and cancel when the progress has been reported ``step`` times."""
    seen = 0

    def count(_progress: object) -> None:
        nonlocal seen
        seen += 1

    try:
        register(tiny, progress=count, cancel=lambda: seen >= step)
    except CancelledError:
        return
    print(f"      not cancelled: it ended within {seen} steps")


def leaks(held: list[Holdings]) -> list[str]:
    """What is held at the end and was not after the warm-up, in sentences."""
    first, last = held[WARM_UP : WARM_UP + WINDOW], held[-WINDOW:]
    before, after = (statistics.median(each.memory for each in part) for part in (first, last))
    said = []
    if after > before * (1 + LARGEST_GROWTH):
        said.append(f"memory grew by {100 * (after / before - 1):.1f} %")
    if files := held[-1].files - first[-1].files:
        said.append(f"open files are left: {sorted(files)}")
    if held[-1].threads > max(each.threads for each in first):
        said.append(f"{held[-1].threads} threads are left, {first[-1].threads} were there")
    if held[-1].children:
        said.append(f"child processes are left: {sorted(held[-1].children)}")
    print(f"memory {before / 2**20:.1f} MiB after the warm-up, {after / 2**20:.1f} MiB at the end")
    return said


def main() -> int:
    """Soak and say what leaks."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--registrations", type=int, default=200)
    arguments = parser.parse_args()
    if arguments.registrations < WARM_UP + 2 * WINDOW:
        parser.error(f"at least {WARM_UP + 2 * WINDOW} registrations are needed")
    said = leaks(soak(tiny_studies(), arguments.registrations))
    print("\n".join(said) or "nothing leaks")
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
