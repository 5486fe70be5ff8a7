"""A full disk: known before it is written to, said in one sentence, and no reason to lose what was computed."""

import errno
import io
import json
import os
import shutil
import subprocess
import sys
from collections import namedtuple
from pathlib import Path

import pytest
import result_case
from result_case import FILES, make_result
from small_study import write_small_study

import PolyPoseLib
from PolyPoseLib.cli import _saving
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import results
from PolyPoseLib.io.disk_space import require_space, takes_nothing, write_failure
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.transforms import preview_writer
from PolyPoseLib.io.whole_folders import claimed_folder

Usage = namedtuple("Usage", "total used free")
SMALL = {"result.json", "report.html", "report.png"}


@pytest.fixture
def nearly_full(monkeypatch):
    """A disk on which a thousand bytes are free, as far as the system says."""
    monkeypatch.setattr(shutil, "disk_usage", lambda path: Usage(10**9, 10**9, 1000))


@pytest.fixture
def refuses_volumes(monkeypatch):
    """A disk that takes small files only."""

    def refuse(volume, path):
        raise InputError(write_failure(path, OSError(errno.ENOSPC, "No space left on device")))

    monkeypatch.setattr(results, "write_volume", refuse)


def test_what_does_not_fit_is_refused_before_anything_is_written(tmp_path, nearly_full):
    with pytest.raises(
        InputError, match=r"out: the disk is full: this needs about \d\.\d MB, and 0\.0 MB are free in"
    ):
        make_result().save(tmp_path / "out")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("usage", [Usage(0, 0, 0), Usage(10**9, 0, 10**9)])
def test_a_disk_that_does_not_know_its_size_is_tried(tmp_path, monkeypatch, usage):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    require_space(tmp_path / "out", 10**8)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: (_ for _ in ()).throw(OSError(errno.ENOSYS, "x")))
    require_space(tmp_path / "out", 10**8)


def test_the_expected_size_is_a_little_more_than_the_real_one(tmp_path):
    result = make_result()
    result.save(tmp_path / "out")
    real = sum(each.stat().st_size for each in (tmp_path / "out").iterdir())
    assert real < results._bytes_of(result) < real + 3e6


def save(result, place):
    with claimed_folder(place, overwrite=False) as claim:
        return _saving.save_or_rescue(result, claim)


def test_without_a_person_the_small_files_are_kept_beside_the_place(tmp_path, refuses_volumes, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    for number, name in enumerate(("out-summary", "out-summary-2"), start=1):
        with pytest.raises(InputError) as caught:
            save(make_result(number), tmp_path / "out")
        assert str(caught.value) == (
            f"{tmp_path / 'out' / 'warped_ct.nii.gz'}: the disk is full: free some space, or choose another folder. "
            f"Without the volumes, the result was saved in {tmp_path / name} (report.html, report.png and result.json)."
        )
        assert {each.name for each in (tmp_path / name).iterdir()} == SMALL
        assert json.loads((tmp_path / name / "result.json").read_text())["structures"]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["out-summary", "out-summary-2"]
    with pytest.raises(InputError, match=r"warped_ct\.nii\.gz: there is no such file"):
        load_result(tmp_path / "out-summary")


def test_or_among_the_temporary_files(tmp_path, nearly_full, monkeypatch):
    (tmp_path / "tmp").mkdir()
    (tmp_path / "disk").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    summary = results.save_summary

    def refuse_on_disk(result, folder, picture):
        if folder.parent.name == "disk":
            raise InputError("full")
        return summary(result, folder, picture)

    monkeypatch.setattr(_saving, "save_summary", refuse_on_disk)
    with pytest.raises(
        InputError, match=r"saved in .*tmp/out-summary \(report\.html, report\.png and result\.json\)\.$"
    ):
        save(make_result(), tmp_path / "disk" / "out")

    def without_picture(result, folder, picture):
        if picture:
            raise InputError("full")
        return summary(result, folder, picture)

    monkeypatch.setattr(_saving, "save_summary", without_picture)
    with pytest.raises(InputError, match=r"saved in .*disk/out-summary \(result\.json\)\.$"):
        save(make_result(), tmp_path / "disk" / "out")

    def nothing_fits(result, folder, picture):
        raise InputError("full")

    monkeypatch.setattr(_saving, "save_summary", nothing_fits)
    with pytest.raises(InputError, match="Not even the motions could be saved"):
        save(make_result(), tmp_path / "disk" / "out")


class Person(io.StringIO):
    """A terminal at which somebody answers."""

    def isatty(self):
        return True


def test_a_person_is_asked_for_another_folder(tmp_path, monkeypatch):
    full = results.require_space

    def only_elsewhere(place, need):
        if place.name in ("out", "also-full"):
            raise InputError(f"{place}: the disk is full: free some space.")
        full(place, need)

    monkeypatch.setattr(results, "require_space", only_elsewhere)
    stderr = Person()
    monkeypatch.setattr(sys, "stderr", stderr)
    monkeypatch.setattr(sys, "stdin", Person(f"{tmp_path / 'also-full'}\n{tmp_path / 'other'}\n"))
    assert save(make_result(), tmp_path / "out") == tmp_path / "other"
    assert {each.name for each in (tmp_path / "other").iterdir()} == FILES
    assert (
        stderr.getvalue().count("Another folder for the result") == 2
        and "also-full: the disk" in stderr.getvalue()
    )
    monkeypatch.setattr(sys, "stdin", Person("\n"))
    with pytest.raises(InputError, match=r"saved in .*out-summary"):
        save(make_result(), tmp_path / "out")


def test_a_preview_that_cannot_be_written_does_not_end_the_run(tmp_path, monkeypatch, caplog):
    folder = tmp_path / "previews"
    folder.mkdir()
    write = preview_writer(folder / "preview.h5")
    field = make_result().transform
    assert write(field) == str(folder / "preview.h5")
    shutil.rmtree(folder)
    with caplog.at_level("WARNING", "PolyPoseLib"):
        assert write(field) is None and write(field) is None
    assert caplog.text.count("The preview is not written") == 1


def test_a_disk_with_room_is_not_called_full(tmp_path):
    assert not takes_nothing(tmp_path)
    sentence = write_failure(tmp_path / "a.h5", RuntimeError("H5Fclose failed"))
    assert (
        sentence
        == f"{tmp_path / 'a.h5'}: the file could not be written whole: check the disk, or choose another folder."
    )
    assert "does not exist: make it first" in write_failure(tmp_path / "no" / "a.h5", RuntimeError())
    assert "not permitted" in write_failure(tmp_path / "a.h5", OSError(errno.EROFS, "x"))


@pytest.fixture
def tiny_disk(tmp_path):
    """A file system of 100 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=100k", "polypose-test", str(place)]
    if shutil.which("mount") is None or subprocess.run(command, capture_output=True).returncode != 0:
        pytest.skip("this user cannot mount a small file system")
    yield place
    subprocess.run(["umount", str(place)], check=True)


CHILD = """
import sys
sys.path.insert(0, sys.argv.pop(1))
from result_case import make_result
from PolyPoseLib import pipeline
from PolyPoseLib.cli import register
from PolyPoseLib.io import results
from PolyPoseLib.__main__ import main
pipeline.register = lambda study, progress=None, cancel=None: make_result()
if sys.argv.pop(1) == "surprise":  # what was free when one looked is not free any more
    results._expected = lambda *sizes: 0.0
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.parametrize("how", ["foreseen", "surprise"])
def test_a_real_full_disk_is_one_sentence_and_the_motions_are_kept(tmp_path, tiny_disk, how):
    root = str(Path(PolyPoseLib.__file__).parents[1])
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    study = write_small_study(tmp_path / "case")
    arguments = ["register", str(study), "--output", str(tiny_disk / "out"), "--progress", "none", "--quiet"]
    done = subprocess.run(
        [sys.executable, "-c", CHILD, os.path.dirname(result_case.__file__), how, *arguments],
        capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL, cwd=temporary,
        env={**os.environ, "PYTHONPATH": root, "TMPDIR": str(temporary)},
    )  # fmt: skip
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.count("\n") == 1 and f"{tiny_disk / 'out'}" in done.stderr, done.stderr
    assert "the disk is full" in done.stderr and "HDF5" not in done.stderr
    assert not list(tiny_disk.iterdir())
    if how == "surprise":
        assert f"saved in {temporary / 'out-summary'} (" in done.stderr
        assert {each.name for each in (temporary / "out-summary").iterdir()} == SMALL
