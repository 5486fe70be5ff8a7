"""A folder in which benchmarks run without processes of their own."""

import shutil
import sys
from dataclasses import replace

import pytest
from benchmark_case import MY_SYSTEMS, write_benchmark_data

from PolyPoseLib import benchmark
from PolyPoseLib.benchmark import know_cases, processes, run_system
from PolyPoseLib.cohort.child import ChildEnd
from PolyPoseLib.io.benchmark.readers import READERS

MAINS = {f"{benchmark.__name__}.{each}": globals()[each].main for each in ("know_cases", "run_system")}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_benchmark_data(tmp_path_factory.mktemp("simulated") / "data")


@pytest.fixture
def home(tmp_path, written, monkeypatch):
    """A folder with data and systems, in which processes are calls within this one, one after another."""
    shutil.copytree(written, tmp_path / "data")
    (tmp_path / "my_systems.py").write_text(MY_SYSTEMS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    started = []

    def run_child(command, environment, log, run, limit):
        started.append(command[2].rpartition(".")[2])
        sys.modules.pop("my_systems", None)
        said = sys.stderr
        with log.open("a") as sys.stderr:
            try:
                status = MAINS[command[2]](command[3:])
            finally:
                sys.stderr = said
        return ChildEnd(status, 1.0, 1.0, 1.0, False, False)

    def cases(root, subject, views):
        for case in reader.cases(root, subject, views):
            # Their silhouettes take most of the time, and are of no matter here.
            yield replace(case, truth=replace(case.truth, held_out=()))

    reader = READERS["simulated"]
    monkeypatch.setitem(READERS, "simulated", replace(reader, cases=cases))
    for module in (know_cases, run_system):
        monkeypatch.setattr(module, "begin", lambda: None)
    monkeypatch.setattr(processes, "run_child", run_child)
    yield tmp_path, started
    sys.modules.pop("my_systems", None)
