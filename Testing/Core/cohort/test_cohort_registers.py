"""The subcommand as a user runs it, with real registrations on two workers."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tiny_case import tiny_case

from PolyPoseLib.io.cases import write_case

pytest.importorskip("distributed")
psutil = pytest.importorskip("psutil")
parquet = pytest.importorskip("pyarrow.parquet")

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """Six studies, one of them broken."""
    home = tmp_path_factory.mktemp("real") / "studies"
    home.mkdir()
    write_case(tiny_case(), home / "case-1", options={"preset": "fast"})
    for number in range(2, 7):
        shutil.copytree(home / "case-1", home / f"case-{number}")
    fields = json.loads((home / "case-6/study.json").read_text())
    fields["ct"] = "absent.nii.gz"
    (home / "case-6/study.json").write_text(json.dumps(fields))
    return home


def cohort(studies, output, *more):
    """Start the subcommand."""
    command = [sys.executable, "-m", "PolyPoseLib", "cohort", str(studies), "--output", str(output)]
    command += ["--progress", "json", "--cores", "1", "--memory", "4G", *more]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )


@pytest.mark.long
def test_six_studies_with_a_killed_worker_then_once_more(studies):
    output = studies.parent / "registered"
    process = cohort(studies, output)
    os.kill(worker_of_a_registration(process.pid), signal.SIGKILL)
    out, err = process.communicate(timeout=600)
    assert process.returncode == 3, err
    steps = [json.loads(line) for line in out.splitlines()]
    assert [step["iteration"] for step in steps] == list(range(1, 7)) and not any(
        step["reused"] for step in steps
    )
    assert "Of 6 studies 1 failed" in err and "Dashboard of the workers: http://127.0.0.1:" in err
    assert "Traceback" not in err
    rows = parquet.read_table(output / "summary.parquet").to_pylist()
    check_rows(rows)
    with (output / "summary.csv").open(newline="") as stream:
        assert len(list(csv.DictReader(stream))) == len(rows)
    before = {path: path.stat().st_mtime_ns for path in output.glob("studies/*/result.json")}
    assert len(before) == 5
    out, err = cohort(studies, output).communicate(timeout=600)
    assert all(json.loads(line)["reused"] for line in out.splitlines()), out
    assert {path: path.stat().st_mtime_ns for path in output.glob("studies/*/result.json")} == before


def check_rows(rows):
    """Three structures of five studies, all of them alike since the studies are, and one row of the broken one."""
    assert len(rows) == 16
    broken = [row for row in rows if row["study"] == "case-6"]
    assert [row["exit_status"] for row in broken] == [2] and "absent.nii.gz" in broken[0]["reasons"]
    done = [row for row in rows if row["study"] != "case-6"]
    assert {row["exit_status"] for row in done} == {0}
    femurs = {round(row["rotation_deg"], 6) for row in done if row["structure"] == "femur_left"}
    assert len(femurs) == 1 and 1 < femurs.pop() < 15
    assert max(row["attempts"] for row in done) == 2
    assert all(300 < row["peak_memory_mib"] < row["expected_memory_mib"] for row in done)


def worker_of_a_registration(coordinator: int) -> int:
    """The process that has started a registration, once there is one that has worked for a second."""
    until = time.monotonic() + 300
    while time.monotonic() < until:
        for each in psutil.Process(coordinator).children(recursive=True):
            try:
                if "PolyPoseLib.cohort.guarded" in each.cmdline() and sum(each.cpu_times()[:2]) > 1:
                    return each.ppid()
            except psutil.Error:
                continue
        time.sleep(0.1)
    raise AssertionError("nothing was registered")
