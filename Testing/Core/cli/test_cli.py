"""The command line: exit statuses, one sentence an error, clean output for programs."""

import io
import json
import os
import shlex
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from result_case import FILES, make_result
from small_study import write_small_study

from PolyPoseLib import pipeline
from PolyPoseLib.__main__ import build_parser, main
from PolyPoseLib.cli import commands
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError, UntrustedResultError
from PolyPoseLib.io.samples import cached_sample
from PolyPoseLib.io.volumes import write_volume

NAMES = [command.__name__.rpartition(".")[2] for command in commands()]
RIGID = [[1, 0, 0, 0], [0, 0, -1, 5], [0, 1, 0, 800], [0, 0, 0, 1]]


@pytest.fixture
def study(tmp_path):
    """A small study on disk."""
    return write_small_study(tmp_path, {"extrinsic": RIGID}, options={"seed": 5, "preset": "fast"})


@pytest.fixture
def registered(monkeypatch):
    """A registration that takes no time; the list of studies it was given."""
    given = []

    def register(study, progress=None, cancel=None):
        given.append(study)
        for n in range(3):
            progress(Progress("bones", n + 1, 3, 0.5 + n / 10, n / 2))
        return make_result()

    monkeypatch.setattr(pipeline, "register", register)
    return given


def run_main(argv, capsys):
    """Exit status, stdout and stderr of one command."""
    capsys.readouterr()
    status = main([str(each) for each in argv])
    out, err = capsys.readouterr()
    return status, out, err


def test_every_subcommand_has_help_with_an_example(capsys):
    assert {"register", "structures", "simulate", "evaluate", "sample", "demo"} <= set(NAMES)
    for name in ["", *NAMES]:
        with pytest.raises(SystemExit) as stop:
            build_parser().parse_args([*([name] if name else []), "--help"])
        assert stop.value.code == 0
        help_text = capsys.readouterr().out
        assert f"python -m PolyPoseLib {name}" in help_text.partition("example:")[2]


def test_the_help_names_the_command_as_it_was_typed(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["/usr/local/bin/polypose", "register", "--help"])
    with pytest.raises(SystemExit):
        main(["register", "--help"])
    text = capsys.readouterr().out
    assert text.startswith("usage: polypose register ") and "example:\n  polypose register " in text
    assert "python -m" not in text


def test_help_and_validation_load_nothing_heavy():
    code = (
        "import sys\nfrom PolyPoseLib.__main__ import build_parser\nimport PolyPoseLib.data.study\nbuild_parser()\n"
        "print(sorted({'torch', 'matplotlib', 'numba', 'slicer', 'qt', 'vtk'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "[]", done.stderr


def test_register_writes_a_result_and_a_table(study, registered, capsys):
    out = study.parent / "result"
    status, text, _ = run_main(["register", study, "--output", out, "--progress", "none"], capsys)
    assert status == 0
    assert {path.name for path in out.iterdir()} == FILES
    assert "femur" in text
    assert str(out / "report.png") in text


def test_the_command_line_wins_over_the_studys_options(study, registered, capsys):
    argv = [
        "register",
        study,
        "--output",
        study.parent / "a",
        "--seed",
        9,
        "--threads",
        2,
        "--preview",
        "p.h5",
    ]
    assert run_main([*argv, "--progress", "none"], capsys)[0] == 0
    assert registered[0].options == {"seed": 9, "threads": 2, "preset": "fast", "preview": "p.h5"}
    status, _, err = run_main(["register", study, "--output", study.parent / "b", "--threads", -1], capsys)
    assert status == 2
    assert "threads" in err


def test_json_progress_is_all_that_stdout_gets(study, registered, capsys):
    argv = ["register", study, "--output", study.parent / "result", "--progress", "json"]
    status, text, err = run_main(argv, capsys)
    assert status == 0
    lines = [json.loads(line) for line in text.splitlines()]
    assert [line["iteration"] for line in lines] == [1, 2, 3]
    assert set(lines[0]) == {"stage", "iteration", "of", "similarity", "seconds"}
    assert "one X-ray" in err


def test_wrong_input_is_status_2_and_one_sentence(study, registered, capsys):
    study.write_text(study.read_text().replace('"anchor": "pelvis"', '"anchor": "pelvs"'))
    status, text, err = run_main(["register", study, "--output", study.parent / "result", "--quiet"], capsys)
    assert status == 2
    assert text == ""
    assert err.count("\n") == 1
    assert 'did you mean "pelvis"' in err
    assert "Traceback" not in err
    assert not (study.parent / "result").exists()
    assert not registered


@pytest.mark.parametrize("command", ["register", "cameras", "train", "evaluate", "structures", "render"])
def test_a_path_that_the_system_refuses_is_wrong_input(study, capsys, monkeypatch, command):
    def refuse(self, *_, **__):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(sys, "stdin", io.StringIO())
    more = {"train": ["--output", study.parent / "m.pt"], "register": ["--output", study.parent / "r"]}
    argv = [
        command,
        study.with_name("locked"),
        *more.get(command, ["--truth", "t"] * (command == "evaluate")),
    ]
    for look in ("is_dir", "is_file", "exists", "stat", "open", "read_bytes"):
        monkeypatch.setattr(Path, look, refuse)
    status, _, err = run_main([*argv, "--quiet"], capsys)
    assert status == 2, err
    assert err.count("\n") == 1 and "permission" in err.lower()


def test_names_that_stdout_cannot_write_are_escaped(study, monkeypatch):
    result = make_result()
    result.structures["骨盤"] = result.structures.pop("femur")
    monkeypatch.setattr(pipeline, "register", lambda study, progress=None, cancel=None: result)
    out = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", out)
    argv = ["register", study, "--output", study.parent / "r", "--progress", "none"]
    assert main([str(each) for each in argv]) == 0
    out.flush()
    assert b"\\u9aa8" in out.buffer.getvalue()


def test_without_a_picture_none_is_promised(study, registered, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    status, out, err = run_main(
        ["register", study, "--output", study.parent / "r", "--progress", "none"], capsys
    )
    assert status == 0 and "pip install matplotlib" in err and "Picture" not in out
    assert {path.name for path in (study.parent / "r").iterdir()} == FILES - {"report.png"}


def test_debug_shows_the_traceback(study, capsys):
    _, _, err = run_main(
        ["register", study.parent / "no.json", "--output", study.parent / "r", "--debug"], capsys
    )
    assert "Traceback" in err


def test_the_destination_is_checked_before_the_work(study, registered, capsys):
    out = study.parent / "result"
    out.mkdir()
    (out / "notes.txt").write_text("x")
    status, _, err = run_main(["register", study, "--output", out, "--overwrite"], capsys)
    assert status == 2
    assert "notes.txt" in err
    assert not registered


def test_a_result_not_to_be_trusted_is_kept_but_status_3(study, monkeypatch, capsys):
    result = make_result()
    result.distrust = ("the similarity did not rise",)
    monkeypatch.setattr(pipeline, "register", lambda study, progress=None, cancel=None: result)
    out = study.parent / "result"
    status, _, err = run_main(["register", study, "--output", out, "--progress", "none"], capsys)
    assert status == 3
    assert "did not rise" in err
    assert (out / "result.json").exists()


@pytest.mark.parametrize(
    ("error", "expected", "words"),
    [
        (CancelledError("stopped"), 130, "stopped"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (UntrustedResultError("no overlap"), 3, "no overlap"),
        (MemoryError(), 2, "memory ran out: crop the CT"),
        (ZeroDivisionError("oops"), 70, "this is a fault of PolyPose (ZeroDivisionError: oops)"),
        (PermissionError(13, "Permission denied", "/a/b"), 2, "/a/b: the system refuses"),
        (OSError(28, "No space left on device"), 2, "the disk is full"),
        (OSError(5, "Input/output error"), 70, "this is a fault"),
    ],
)
def test_every_end_has_its_status(study, monkeypatch, capsys, error, expected, words):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(pipeline, "register", fail)
    status, _, err = run_main(
        ["register", study, "--output", study.parent / "r", "--progress", "none"], capsys
    )
    assert status == expected
    assert words in err
    assert "Traceback" not in err
    assert not (study.parent / "r").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_run_with_130_and_nothing_left(study, number):
    script = textwrap.dedent("""
        import sys, time
        from PolyPoseLib import __main__
        from PolyPoseLib.data.progress import Progress
        from PolyPoseLib import pipeline
        def register(study, progress=None, cancel=None):
            for n in range(10**6):
                progress(Progress("bones", n, 10**6, 0.5, 0.0))
                time.sleep(0.05)
        pipeline.register = register
        sys.exit(__main__.main(sys.argv[1:]))
    """)
    argv = ["register", str(study), "--output", str(study.parent / "result"), "--progress", "json", "--quiet"]
    before = set(study.parent.iterdir())
    with subprocess.Popen(
        [sys.executable, "-c", script, *argv], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert json.loads(child.stdout.readline())["stage"] == "bones"
        sent = time.monotonic()
        child.send_signal(number)
        _, err = child.communicate(timeout=30)
    assert child.returncode == 130
    assert time.monotonic() - sent < 25
    assert "interrupted" in err
    assert "Traceback" not in err
    assert set(study.parent.iterdir()) == before


@pytest.mark.skipif(sys.platform == "win32", reason="pipes are POSIX")
def test_a_reader_that_goes_away_stops_the_run(study):
    script = (
        "import sys\nfrom PolyPoseLib import __main__\nfrom PolyPoseLib.data.progress import Progress\n"
        "from PolyPoseLib import pipeline\n"
        "def register(study, progress=None, cancel=None):\n"
        "    while True:\n        progress(Progress('bones', 1, 2, 0.5, 0.0))\n"
        "pipeline.register = register\nsys.exit(__main__.main(sys.argv[1:]))"
    )
    argv = ["register", str(study), "--output", str(study.parent / "result"), "--progress", "json"]
    with subprocess.Popen(
        [sys.executable, "-c", script, *argv], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        child.stdout.readline()
        child.stdout.close()
        assert child.wait(timeout=30) == 130
        assert "Traceback" not in child.stderr.read()


def test_structures_prints_what_a_study_can_hold(study, capsys):
    labels = study.parent / "labels.nii.gz"
    status, text, _ = run_main(["structures", labels, "--label-table", "totalsegmentator_v2"], capsys)
    assert status == 0
    assert json.loads(text) == {
        "label_table": "totalsegmentator_v2",
        "structures": {"pelvis": [25], "femur_left": [75]},
        "anchor": "pelvis",
    }
    status, _, err = run_main(["structures", labels], capsys)
    assert status == 2
    assert "--label-table" in err


def test_sample_copies_without_replacing(tmp_path, capsys):
    if cached_sample("pelvis") is None:
        pytest.skip("the pelvis sample is not in the cache")
    status, text, _ = run_main(["sample", "pelvis", "--output", tmp_path / "pelvis"], capsys)
    assert status == 0
    assert text.strip() == str(tmp_path / "pelvis")
    assert {path.name for path in (tmp_path / "pelvis").iterdir()} == {
        "ct.nii.gz", "labels.nii.gz", "structures.json",
    }  # fmt: skip
    status, _, err = run_main(["sample", "pelvis", "--output", tmp_path / "pelvis"], capsys)
    assert status == 2
    assert "exists already" in err


def test_simulate_asks_for_its_inputs(tmp_path, capsys):
    status, _, err = run_main(["simulate", "--output", tmp_path / "case"], capsys)
    assert status == 2
    assert "--sample" in err
    status, _, err = run_main(
        ["simulate", "--sample", "pelvis", "--ct", "x", "--output", tmp_path / "case"], capsys
    )
    assert status == 2
    assert "leave out" in err


def test_evaluate_against_a_second_segmentation(tmp_path, capsys):
    result = make_result()
    result.transform.vectors[:] = 0
    result.save(tmp_path / "result")
    write_volume(result.warped_labels, tmp_path / "second.nii.gz")
    argv = ["evaluate", tmp_path / "result", "--segmentation", tmp_path / "second.nii.gz"]
    status, text, _ = run_main([*argv, "--json"], capsys)
    assert status == 0
    scores = json.loads(text)
    assert scores["summary"] == {"mean_dice": 1.0, "folds_percent": 0.0, "sd_log_jacobian": 0.0}
    assert all(each["centroid_mm"] == 0 and each["hd95_mm"] == 0 for each in scores["labels"].values())
    status, text, _ = run_main(argv, capsys)
    assert "Dice" in text and "cut off by an end of a scan" in text
    second = result.warped_labels.voxels.copy()
    second[4, 4, 4:6] = 999
    write_volume(Volume(second, result.warped_labels.affine), tmp_path / "more.nii.gz")
    status, text, _ = run_main([*argv[:-1], tmp_path / "more.nii.gz"], capsys)
    assert "not in the CT's label map, and not scored: 999" in text
    write_volume(Volume(np.full((5, 5, 5), 999, np.int16), np.eye(4)), tmp_path / "other.nii.gz")
    status, _, err = run_main([*argv[:-1], tmp_path / "other.nii.gz"], capsys)
    assert status == 2
    assert "no label in common" in err


@pytest.mark.slow
def test_the_demo_goes_from_nothing_to_a_judged_result(tmp_path):
    if cached_sample("pelvis") is None:
        pytest.skip("the pelvis sample is not in the cache; python -m PolyPoseLib sample pelvis fetches it")
    argv = ["demo", "--output", "demo", "--preset", "fast", "--pixels", "200", "--progress", "json", "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "PolyPoseLib", *argv],
        capture_output=True, text=True, timeout=600, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    scores = json.loads((tmp_path / "demo" / "scores.json").read_text())
    assert scores["summary"]["mean_tre_mm"] < 0.5 * scores["summary"]["mean_rest_tre_mm"]
    assert scores["summary"]["folds_percent"] < 0.1
    assert {path.name for path in (tmp_path / "demo" / "result").iterdir()} == FILES


def test_the_command_after_the_demo_survives_a_shell():
    from PolyPoseLib.cli.demo import next_command

    for folder in (Path("polypose-demo"), Path("my demo/$(x) it's")):
        program, words = next_command(folder).split("PolyPoseLib ", 1)
        assert program == "python -m "
        study = folder / "case" / "study.json"
        assert shlex.split(words) == ["view", str(folder / "result"), "--study", str(study)]
