"""The subcommand benchmark as a user runs it: arguments, real processes, what is left and how it ends."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from benchmark_case import started_benchmark, write_benchmark_data
from cohort_case import is_alive
from phantom_study import case as phantom_case

from PolyPoseLib.__main__ import main
from PolyPoseLib.benchmark.systems import SYSTEMS
from PolyPoseLib.data.benchmark.job import DATASETS
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.io.benchmark.readers import READERS
from PolyPoseLib.io.benchmark.row_files import read_row
from PolyPoseLib.io.transforms import read_transform


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return write_benchmark_data(tmp_path_factory.mktemp("simulated") / "data")


def rows_in(folder):
    """All rows, by system; every file there must be a whole row."""
    found = [read_row(path) for path in sorted((folder / "rows").glob("*.json"))]
    assert None not in found
    return {row["system"]: row for row in found}


def ended(process, seconds=300):
    """Exit status, stdout and stderr."""
    out, err = process.communicate(timeout=seconds)
    return process.returncode, out, err


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="a crash is a signal")
def test_a_crash_is_a_row_and_the_other_system_has_its_scores(data, tmp_path):
    command = [
        "simulated",
        data,
        "--output",
        "out",
        "--methods",
        "mine=my_systems:Mine",
        "my_systems:Crashes",
    ]
    status, out, err = ended(started_benchmark(tmp_path, *command, "--progress", "json"))
    assert status == 3 and "Of 2 runs 1 failed: the rows and logs in out say why." in err
    assert "Traceback" not in err
    steps = [json.loads(line) for line in out.splitlines()]
    assert [(each["system"], each["status"], each["iteration"], each["of"]) for each in steps] == [
        ("mine", "done", 1, 2),
        ("my_systems:Crashes", "failed", 2, 2),
    ]
    assert Progress.from_json(out.splitlines()[0]).stage == "runs"
    rows = rows_in(tmp_path / "out")
    assert rows["mine"]["scores"]["structures"]["femur_left"]["tre_mean_mm"] > 3
    assert 50 < rows["mine"]["peak_memory_mib"] < 2000 and 0 <= rows["mine"]["cpu_seconds"] < 60
    assert "killed by the system (SIGSEGV)" in rows["my_systems:Crashes"]["reason"]
    assert (tmp_path / "runs").read_text() == "run\n"
    table = (tmp_path / "out/tables/table-simulated-own-2x60.md").read_text()
    assert "| mine | 1/1 |" in table and "failed on 1 of 1: It was killed" in table
    with (tmp_path / "out/tables/scores.csv").open(newline="") as stream:
        assert {row["system"] for row in csv.DictReader(stream)} == set(rows)
    assert not [path for path in (tmp_path / "out").rglob(".*") if path.is_file()]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--methods", "polypos"], 'did you mean "polypose"'),
        (["--methods", "no_such_module:Mine"], 'there is no module "no_such_module"'),
        (["--subjects", "case-2"], 'did you mean "case-1"'),
        (["--views", "2x"], "--views: simulated: the views '2x' are none"),
        (["--views", "../2x30"], "are none: give a number of views"),
        (["--views", "own", "2x400"], "an arc of up to 360 degrees"),
        (["--views", "10+9"], "are none: give a number of views"),
        (["--weights", "polypose"], "write SYSTEM=FILE"),
        (["--weights", "polypose="], "write SYSTEM=FILE"),
        (
            ["--weights", "liftreg=absent.pt"],
            '"liftreg" is not among the systems that run: add it to --methods',
        ),
        (["--weights", "liftrg=absent.pt"], 'The system "liftrg" is not known'),
        (["--methods", "rigid", "--weights", "rigid=absent.pt"], "absent.pt: there is no such file"),
        (["--methods", "rigid", "--weights", "rigid@own=absent.pt"], "absent.pt: there is no such file"),
        (["--methods", "rigid", "--weights", "rigid@case-1=absent.pt"], "absent.pt: there is no such file"),
        (
            ["--methods", "rigid", "--weights", "rigid@2x30=absent.pt"],
            'The subject or set of views "2x30" is not known: give one of own, case-1.',
        ),
        (["--methods", "rigid", "--weights", "rigid@case-2=absent.pt"], 'did you mean "case-1"?'),
        (["--weights", "polypose=absent.pt"], '"polypose" takes no weights'),
        (["--threads", "0"], "--threads is 0"),
        (["--jobs", "-1"], "--jobs is -1"),
        (["--seed", "-1"], "--seed is -1"),
        (["--limit", "nan"], "--limit is nan"),
        (["--limit", "0"], "--limit is 0"),
    ],
)
def test_wrong_arguments_are_refused_in_one_sentence_before_anything_is_written(
    data, tmp_path, capsys, arguments, said
):
    status = main(["benchmark", "simulated", str(data), "--output", str(tmp_path / "out"), *arguments])
    out, err = capsys.readouterr()
    assert (status, out) == (2, "") and said in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_wrong_data_and_places_are_refused_in_one_sentence(data, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    for folder, output, said in (
        (tmp_path / "absent", "out", "absent"),
        (tmp_path / "empty", "out", "empty"),
        (tmp_path / "file", "out", "file"),
        (data, "absent/out", "does not exist"),
        (data, "file", "this is a file"),
    ):
        status = main(["benchmark", "simulated", str(folder), "--output", str(tmp_path / output)])
        out, err = capsys.readouterr()
        assert (status, out) == (2, "") and said in err and err.count("\n") == 1
    assert sorted(os.listdir(tmp_path)) == ["empty", "file"]


def test_the_data_sets_are_those_that_have_a_reader():
    assert set(DATASETS) == set(READERS)


def test_the_list_needs_no_data_and_says_what_can_run_here(capsys, monkeypatch):
    with pytest.raises(SystemExit) as ending:
        main(["benchmark", "--list"])
    lines = capsys.readouterr().out.splitlines()[2:]
    assert ending.value.code == 0 and [line.split()[0] for line in lines] == list(SYSTEMS)
    assert re.fullmatch(r"polypose +the default method +- +- +yes", lines[1])
    assert re.fullmatch(r"liftreg +trained network LiftReg +needed +- +yes", lines[-2])


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="processes are ended by signals")
def test_a_slow_system_is_ended_at_the_limit(data, tmp_path):
    command = ["simulated", data, "--output", "out", "--methods", "my_systems:Sleeps", "--limit", "20"]
    status, _, err = ended(started_benchmark(tmp_path, *command))
    rows = rows_in(tmp_path / "out")
    assert status == 3 and "Of 1 runs 1 failed" in err
    assert rows["my_systems:Sleeps"]["reason"] == "It took longer than the limit of 20 s and was ended."
    assert 20 <= rows["my_systems:Sleeps"]["seconds"] < 60


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="processes are ended by signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_interrupted_run_keeps_its_rows_and_goes_on(data, tmp_path, number):
    systems = ["first=my_systems:Mine", "my_systems:Sleeps", "third=my_systems:Mine"]
    command = ["simulated", data, "--output", "out", "--methods", *systems]
    process = started_benchmark(tmp_path, *command)
    until = time.monotonic() + 200
    while not (tmp_path / "sleeps").exists():
        assert time.monotonic() < until and process.poll() is None
        time.sleep(0.1)
    children = children_of(process.pid)
    assert len(children) == 1
    process.send_signal(number)
    status, _, err = ended(process)
    if number == signal.SIGKILL:
        assert status == -signal.SIGKILL
    else:
        assert status == 130
        assert "interrupted; 1 of 3 runs have ended: run the same command with --resume to go on" in err
    until = time.monotonic() + 60
    while is_alive(children[0]):
        assert time.monotonic() < until
        time.sleep(0.1)
    assert list(rows_in(tmp_path / "out")) == ["first"]
    status, _, err = ended(started_benchmark(tmp_path, *command))
    assert status == 2 and "add --resume" in err
    command[command.index("my_systems:Sleeps")] = "rest"
    status, out, err = ended(started_benchmark(tmp_path, *command, "--resume", "--jobs", "2"))
    assert status == 0, err
    assert set(rows_in(tmp_path / "out")) == {"first", "rest", "third"} and "Benchmark: out" in out
    assert (tmp_path / "runs").read_text().count("run") == 2  # the first one was not run again
    assert not [path for path in (tmp_path / "out").rglob(".*") if path.is_file()]


@pytest.mark.long
def test_polypose_beats_rest_and_its_field_and_pictures_are_kept(tmp_path):
    pytest.importorskip("matplotlib")
    data = write_benchmark_data(tmp_path / "data", phantom_case())
    command = ["simulated", data, "--output", "out", "--keep-fields", "--draw"]
    status, out, err = ended(started_benchmark(tmp_path, *command), 900)
    assert status == 0, err
    rows = rows_in(tmp_path / "out")
    bones = {name: row["scores"]["groups"]["bones"]["tre_mean_mm"] for name, row in rows.items()}
    assert bones["polypose"] < 0.4 * bones["rest"] and rows["polypose"]["cpu_seconds"] > 0.5
    field = read_transform(tmp_path / "out/fields/case-1-own-2x60--polypose.h5")
    assert field.vectors.any() and not rows["polypose"]["reason"]
    pictures = sorted(path.name for path in (tmp_path / "out/pictures/case-1-own-2x60--polypose").iterdir())
    assert pictures == ["deformation.png", "overlay.png", "projection.png"]
    assert [line.split()[:2] for line in out.splitlines()[2:4]] == [["rest", "1"], ["polypose", "1"]]


def children_of(process: int) -> list[int]:
    """Processes that a process has started and that run."""
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process)], capture_output=True, text=True)
    return [int(each) for each in found.stdout.split() if Path(f"/proc/{each}").exists()]
