"""The subcommand cohort: what it refuses, what it prints, and its exit statuses; the machines are stood in for."""

import json
import sys
from pathlib import Path

import pytest
from bids_case import write_data_set
from result_case import make_result
from small_study import write_small_study

from PolyPoseLib.__main__ import main
from PolyPoseLib.cohort import run as runner
from PolyPoseLib.cohort.clusters import Machines
from PolyPoseLib.data.cohort.outcome import Outcome
from PolyPoseLib.data.cohort.progress import CohortProgress
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.io.results import save_summary

pytest.importorskip("distributed")
pytest.importorskip("dask_jobqueue")


@pytest.fixture
def studies(tmp_path):
    """A list of three studies."""
    (tmp_path / "in").mkdir()
    for name in "abc":
        write_small_study(tmp_path / "in" / name)
    path = tmp_path / "in/list.csv"
    path.write_text("id,study\n" + "".join(f"{name},{name}/study.json\n" for name in "abc"))
    return path


@pytest.fixture
def given(monkeypatch):
    """What the machines were asked to do; statuses says how the studies end."""
    asked = {"statuses": {}, "jobs": []}

    class Stand:
        def __init__(self, at, run, retries):
            asked["retries"] = retries

        def outcomes(self, jobs):
            asked["jobs"] = list(jobs)
            for job in jobs:
                status = asked["statuses"].get(job.identity, 0)
                if status == 130:
                    raise KeyboardInterrupt
                if status in (0, 3):
                    place = Path(job.folder, job.place)
                    place.parent.mkdir(parents=True, exist_ok=True)
                    save_summary(make_result(), place, picture=False)
                yield Outcome(job.identity, status, "why" if status else "", place=job.place, seconds=1.0)

        def end(self):
            asked["ended"] = True

    class Nothing:
        def __enter__(self):
            return Machines(None, "http://127.0.0.1:1/status", None)

        def __exit__(self, *_):
            return False

    def machines(settings, folder):
        asked["cluster"] = settings
        return Nothing()

    monkeypatch.setattr(runner, "machines", machines)
    monkeypatch.setattr(runner, "Dispatcher", Stand)
    return asked


def command(capsys, *argv):
    """Exit status, stdout and stderr."""
    capsys.readouterr()
    status = main(["cohort", *map(str, argv)])
    return status, *capsys.readouterr()


def test_all_is_well(studies, tmp_path, capsys, given):
    status, out, err = command(
        capsys, studies, "--output", tmp_path / "out", "--preset", "fast", "--threads", "2", "--time-limit", "30",
        "--workers", "3", "--memory", "3.5G", "--retries", "1",
    )  # fmt: skip
    assert status == 0, err
    assert out.rstrip().endswith(f"Cohort: {tmp_path / 'out'}") and "uncertain" in out
    assert "Dashboard of the workers: http://127.0.0.1:1/status" in err
    settings = given["jobs"][0].settings
    assert (dict(settings.options), settings.threads, settings.limit_seconds) == ({"preset": "fast"}, 2, 1800)
    assert (given["cluster"].workers, given["cluster"].memory_mib, given["retries"]) == (3, 3584, 1)
    assert {"index.html", "summary.csv", "summary.parquet", "cohort.json"} <= {
        p.name for p in (tmp_path / "out").iterdir()
    }


def test_some_must_not_be_trusted_and_some_failed(studies, tmp_path, capsys, given):
    given["statuses"] = {"a": 3, "c": -9}
    status, out, err = command(capsys, studies, "--output", tmp_path / "out")
    assert status == 3 and "Of 3 studies 1 must not be trusted and 1 failed: see" in err
    rows = [line.split()[:2] for line in out.splitlines()[2:5]]
    assert rows == [["c", "failed"], ["a", "untrusted"], ["b", "done"]]


def test_progress_for_programs(studies, tmp_path, capsys, given):
    given["statuses"] = {"b": 2}
    status, out, _ = command(capsys, studies, "--output", tmp_path / "out", "--progress", "json")
    steps = [json.loads(line) for line in out.splitlines()]
    assert status == 3 and [(each["study"], each["exit_status"]) for each in steps] == [
        ("a", 0),
        ("b", 2),
        ("c", 0),
    ]
    assert (steps[-1]["failed"], steps[-1]["untrusted"], steps[-1]["of"]) == (1, 0, 3)
    read = Progress.from_json(out.splitlines()[0])
    assert (read.stage, read.iteration, read.of) == ("studies", 1, 3)
    assert CohortProgress("studies", 1, 3, None, 0.0).fraction == pytest.approx(1 / 3)


def test_an_interrupt_says_how_much_is_done(studies, tmp_path, capsys, given):
    given["statuses"] = {"b": 130}
    status, _, err = command(capsys, studies, "--output", tmp_path / "out")
    assert (
        status == 130 and "1 of 3 studies have a result: run the same command again" in err and given["ended"]
    )
    assert "not run" in (tmp_path / "out/summary.csv").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scheduler", "slurn"], 'did you mean "slurm"'),
        (["--memory", "much"], "--memory is 'much'"),
        (["--memory", "0"], "--memory"),
        (["--workers", "0"], "--workers is 0"),
        (["--cores", "-1"], "--cores is -1"),
        (["--retries", "-1"], "--retries is -1"),
        (["--time-limit", "nan"], "--time-limit"),
        (["--threads", "0"], "threads"),
        (["--prologue", "a\nrm -rf ~"], "--prologue holds a line's end"),
        (["--directive", "a\nb"], "--directive holds a line's end"),
        (["--print-job-script"], "--print-job-script is of batch systems"),
    ],
)
def test_wrong_arguments_are_refused_before_anything_is_written(
    studies, tmp_path, capsys, given, arguments, said
):
    status, out, err = command(capsys, studies, "--output", tmp_path / "out", *arguments)
    assert (status, out) == (2, "") and said in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_wrong_list_leaves_nothing(tmp_path, capsys, given):
    path = tmp_path / "list.csv"
    path.write_text("id,study\n../x,s.json\n")
    status, _, err = command(capsys, path, "--output", tmp_path / "out")
    assert status == 2 and "names no file on every system" in err and not (tmp_path / "out").exists()


def test_a_folder_that_is_no_cohorts_is_left_alone(studies, tmp_path, capsys, given):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos/me.jpg").write_text("a photo")
    status, _, err = command(capsys, studies, "--output", tmp_path / "photos")
    assert status == 2 and '("me.jpg")' in err
    status, _, err = command(capsys, studies.parent, "--output", studies.parent)
    assert status == 2 and "this is the folder of the studies" in err
    status, _, err = command(capsys, studies, "--output", tmp_path / "absent/out")
    assert status == 2 and "does not exist" in err
    assert command(capsys, studies, "--output", tmp_path / "out")[0] == 0
    (tmp_path / "out/studies/a/study.json").write_text("{}")
    jobs = given.pop("jobs")
    given["jobs"] = []
    status, _, err = command(capsys, tmp_path / "out/studies", "--output", tmp_path / "out")
    assert len(jobs) == 3 and status == 2 and "are inside of it" in err
    assert not given["jobs"]


def test_the_job_script_is_printed_and_nothing_runs(studies, tmp_path, capsys, given):
    pytest.importorskip("cryptography")
    status, out, err = command(
        capsys, studies, "--output", tmp_path / "out", "--scheduler", "slurm", "--print-job-script", "--cores", "8",
        "--directive=--constraint=ib", "--quiet",
    )  # fmt: skip
    assert status == 0, err
    assert out.startswith("#!") and "#SBATCH --cpus-per-task=8" in out and "#SBATCH --constraint=ib" in out
    assert "POLYPOSE_THREADS=8,POLYPOSE_MIB=16384" in out and not given["jobs"]


def test_a_data_set_gives_a_derivative(tmp_path, capsys, given):
    source = write_data_set(tmp_path / "hips")
    status, _, err = command(capsys, source, "--output", source / "derivatives/polypose")
    assert status == 0, err
    folder = source / "derivatives/polypose"
    assert json.loads((folder / "dataset_description.json").read_text())["DatasetType"] == "derivative"
    assert (folder / "sub-02/ses-a/sub-02_ses-a_polypose/result.json").is_file()


def test_the_help_tells_the_threads_of_a_cohort(capsys):
    with pytest.raises(SystemExit):
        main(["cohort", "--help"])
    assert "CPU threads (default: 1 a study)" in capsys.readouterr().out


def test_missing_packages_are_named(studies, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "dask_jobqueue", None)
    status, _, err = command(capsys, studies, "--output", tmp_path / "out")
    assert status == 2 and "pip install 'polypose[cohort]'" in err
