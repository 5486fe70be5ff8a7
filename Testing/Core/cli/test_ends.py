"""However a command ends, it says what has become of the result."""

import errno
import json
import os
import shlex
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from result_case import FILES, make_result
from small_study import write_small_study

import PolyPoseLib
from PolyPoseLib import pipeline
from PolyPoseLib.__main__ import main
from PolyPoseLib.cli import _saving
from PolyPoseLib.cli._endings import ending_of
from PolyPoseLib.errors import LONGEST_SENTENCE, InputError, is_out_of_memory
from PolyPoseLib.io.whole_files import claimed_file
from PolyPoseLib.io.whole_folders import claimed_folder


@pytest.fixture
def study(tmp_path):
    """A small study on disk, alone in its folder."""
    return write_small_study(tmp_path / "case")


@pytest.fixture
def registered(monkeypatch):
    """A registration that takes no time; the studies it was given."""
    given = []

    def register(study, progress=None, cancel=None):
        given.append(study)
        return make_result()

    monkeypatch.setattr(pipeline, "register", register)
    return given


def run_main(argv, capsys):
    """Exit status, stdout and stderr of one command."""
    capsys.readouterr()
    status = main([str(each) for each in argv])
    return status, *capsys.readouterr()


@pytest.mark.parametrize("command", ["register", "train"])
def test_the_second_run_towards_one_place_is_refused_at_the_start(
    study, registered, tmp_path, capsys, command
):
    output = tmp_path / ("out" if command == "register" else "model.pt")
    claimed = claimed_folder(output, True) if command == "register" else claimed_file(output)
    with claimed:
        status, _, err = run_main([command, study, "--output", output, "--overwrite", "--quiet"], capsys)
    assert status == 2 and not registered
    assert err.count("\n") == 1 and "another run of PolyPose (process" in err
    assert [each.name for each in tmp_path.iterdir()] == ["case"]


def test_an_interrupt_after_the_result_was_written_says_so(study, registered, tmp_path, capsys, monkeypatch):
    output = tmp_path / "out"
    argv = ["register", study, "--output", output, "--progress", "none", "--quiet"]
    save = _saving.save_result

    def save_and_interrupt(result, claim):
        save(result, claim)
        raise KeyboardInterrupt

    monkeypatch.setattr(_saving, "save_result", save_and_interrupt)
    status, _, err = run_main(argv, capsys)
    assert status == 130 and f"the result was written to {output}" in err
    assert {each.name for each in output.iterdir()} == FILES

    def interrupt(result, claim):
        raise KeyboardInterrupt

    monkeypatch.setattr(_saving, "save_result", interrupt)
    status, _, err = run_main([*argv, "--overwrite"], capsys)
    assert status == 130 and "no result was written" in err


LONG = "x" * (8 << 20)
BASE = {
    "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "anchor": "a",
    "structures": {"a": [1], "b": [2]}, "xrays": [{"image": "ap.dcm"}],
}  # fmt: skip
ABSURD = {
    "structures": {"structures": {f"s{n}": [n + 1] for n in range(60_000)}, "anchor": "s"},
    "labels": {"structures": {"a": list(range(1, 500_000))}},
    "X-rays": {"xrays": [{"image": f"{n}.dcm"} for n in range(100_000)]},
    "structure's name": {"structures": {LONG: [1]}},
    "long names": {"structures": {f"{n}{'x' * 100_000}": [n + 1] for n in range(70)}, "anchor": "s"},
    "anchor": {"anchor": LONG},
    "ct": {"ct": LONG},
    "version": {"version": LONG},
    "field": {LONG: 1},
    "option": {"options": {LONG: 1}},
    "value of an option": {"options": {"preset": LONG}},
    "image": {"xrays": [{"image": LONG}]},
    "name": {"xrays": [{"image": "ap.dcm", "name": LONG}]},
    "view": {"xrays": [{"image": "ap.dcm", "standard_view": LONG}]},
    "label table": {"label_table": LONG},
}


@pytest.mark.parametrize("what", ABSURD)
def test_absurd_studies_are_refused_at_once_and_in_short(tmp_path, what, capsys):
    study = tmp_path / "study.json"
    study.write_text(json.dumps({**BASE, **ABSURD[what]}))
    began = time.process_time()
    status, out, err = run_main(["register", study, "--output", tmp_path / "out"], capsys)
    assert time.process_time() - began < 30  # one on an idle machine; minutes if it began to work
    assert (status, out) == (2, "") and err.count("\n") == 1
    assert len(err) < 500 + len(str(study))


def test_a_sentence_keeps_its_beginning_and_its_end():
    error = InputError(f"study.json: {LONG} is wrong: give another.")
    assert str(error).startswith("study.json: xxx") and str(error).endswith("x is wrong: give another.")
    assert len(str(error)) == LONGEST_SENTENCE
    assert str(InputError("short")) == "short" and InputError().args == ()


def array_memory_error() -> MemoryError:
    try:
        np.empty(1 << 56)
    except MemoryError as error:
        return error
    raise AssertionError


@pytest.mark.parametrize(
    ("error", "out_of_memory"),
    [
        (MemoryError(), True),
        (array_memory_error(), True),
        (RuntimeError("std::bad_alloc"), True),
        (RuntimeError("[enforce fail] DefaultCPUAllocator: can't allocate memory: you tried to"), True),
        (RuntimeError("CUDA out of memory. Tried to allocate 20.00 GiB"), True),
        (RuntimeError("sitk::ERROR: Failed to allocate memory for image."), True),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), True),
        (RuntimeError("mat1 and mat2 shapes cannot be multiplied"), False),
        (OSError(errno.EIO, "Input/output error"), False),
        (ValueError("out of memory"), False),
    ],
)
def test_a_lack_of_memory_is_known_in_every_librarys_words(error, out_of_memory):
    assert is_out_of_memory(error) is out_of_memory
    sentence, status = ending_of(error)
    assert (status == 2 and "memory ran out: crop the CT" in sentence) is out_of_memory


def run_child(code: str, arguments: list[str], redirect: str = "") -> subprocess.CompletedProcess:
    """Run main in a process of its own, after some code, through a shell that redirects its streams."""
    root = str(Path(PolyPoseLib.__file__).parents[1])
    script = f"import sys\n{textwrap.dedent(code)}\nfrom PolyPoseLib.__main__ import main\nsys.exit(main(sys.argv[1:]))"
    command = " ".join(shlex.quote(each) for each in (sys.executable, "-c", script, *arguments))
    return subprocess.run(
        f"{command} {redirect}",
        shell=True, capture_output=True, text=True, timeout=120, env={**os.environ, "PYTHONPATH": root},
    )  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="the shell is POSIX")
@pytest.mark.parametrize(
    ("redirect", "status"), [(">&-", 2), ("2>&-", 2), (">&- 2>&-", 2), ("< /dev/null > /dev/null", 2)]
)
def test_a_process_without_streams_ends_as_others_do(tmp_path, redirect, status):
    arguments = ["register", str(tmp_path / "no.json"), "--output", str(tmp_path / "out")]
    assert run_child("", arguments, redirect).returncode == status


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the device is Linux's")
def test_a_full_disk_under_stdout_is_one_sentence():
    done = run_child("", ["structures", "--help"], "> /dev/full")
    assert done.returncode in (0, 2) and "Traceback" not in done.stderr
    code = """
        from PolyPoseLib.cli import structures
        structures.run = lambda arguments: print("x" * 100_000) or 0
    """
    done = run_child(code, ["structures", "labels.nii.gz"], "> /dev/full")
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "the disk is full" in done.stderr


NOISE = """
    import logging, os, warnings
    from PolyPoseLib.cli import structures
    from PolyPoseLib.io.native_output import native_output_logged

    def run(arguments):
        import numpy as np
        np.float64(1) / np.float64(0)
        warnings.warn("a package's warning")
        logging.getLogger("another.package").warning("a package's log")
        with native_output_logged():
            os.write(2, b"WARNING: In itkSomething.cxx, line 7\\n")
        logging.getLogger("PolyPoseLib.io").warning("ours on\\ntwo lines")
        print("done")
        return 0

    structures.run = run
"""


@pytest.mark.skipif(sys.platform == "win32", reason="the shell is POSIX")
def test_what_libraries_say_is_logged_with_debug_only():
    done = run_child(NOISE, ["structures", "labels.nii.gz"])
    assert (done.returncode, done.stdout) == (0, "done\n")
    assert done.stderr == "WARNING: ours on two lines\n"
    done = run_child(NOISE, ["structures", "labels.nii.gz", "--debug"])
    for part in (
        "divide by zero",
        "a package's warning",
        "a package's log",
        "DEBUG: native library: WARNING: In itk",
    ):
        assert part in done.stderr
