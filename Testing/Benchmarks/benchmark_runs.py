"""Registrations as separate processes, as a user runs them, so that seconds and memory are measured separately."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from PolyPoseLib.data.truth import Truth
from PolyPoseLib.evaluation.score import score_result
from PolyPoseLib.io.results import load_result

RESULTS = Path(__file__).parent / "results"
"""Where tables and plots go."""


def register_and_score(
    study: Path,
    truth: Truth,
    name: str,
    arguments: argparse.Namespace,
    preset: str | None = None,
    stands_for: Mapping[str, str] | None = None,
) -> dict:
    """One row of a table: register a study, and score what came out.

    name: of the result's folder and log, beside the study; arguments: device, threads and limit; preset: the study's
    own when None; stands_for: as score_result takes it.
    """
    output, log = study.parent / f"result_{name}", study.parent / f"log_{name}.txt"
    shutil.rmtree(output, ignore_errors=True)
    command = register_command(study, output, preset, arguments.device, arguments.threads)
    ran = run_measured(command, log, arguments.limit)
    if ran["exit_status"] not in (0, 3) or not output.is_dir():
        return ran | {"failed": log.read_text().strip()[-500:]}
    return ran | score_result(load_result(output), truth, stands_for)


def register_command(
    study: Path, output: Path, preset: str | None = None, device: str = "cpu", threads: int | None = None
) -> list[str]:
    """The command that registers a study; the study's own preset when there is none, all threads when None."""
    command = [sys.executable, "-m", "PolyPoseLib", "register", str(study), "--output", str(output)]
    command += ["--overwrite", "--device", device, "--progress", "none"]
    command += ["--preset", preset] if preset else []
    return command + (["--threads", str(threads)] if threads else [])


def run_measured(command: list[str], log: Path, limit: float) -> dict:
    """Run a command; its exit status, wall seconds, processor seconds of all threads, and peak resident memory.

    On a busy machine CPU seconds are more meaningful than wall-clock seconds.
    """
    start, before = time.perf_counter(), os.times()
    with log.open("w") as stream:
        process = subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT)
        peak = 0.0
        while process.poll() is None:
            peak = max(peak, resident_mib(process.pid))
            if time.perf_counter() - start > limit:
                process.kill()
            time.sleep(0.05)
    after = os.times()
    return {
        "exit_status": process.returncode,
        "wall_seconds": time.perf_counter() - start,
        "cpu_seconds": after.children_user
        + after.children_system
        - before.children_user
        - before.children_system,
        "peak_memory_mib": peak,
    }


def resident_mib(pid: int | str) -> float:
    """Largest resident memory so far of a process in MiB (Linux; NaN elsewhere)."""
    try:
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmHWM"):
                return float(line.split()[1]) / 1024
    except OSError:
        return 0.0 if os.name == "posix" and Path("/proc").is_dir() else float("nan")
    return 0.0
