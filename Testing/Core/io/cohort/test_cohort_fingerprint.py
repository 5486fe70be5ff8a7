"""A study's fingerprint changes with every byte that it is read from, and with nothing else."""

import os
import shutil
import time

import pytest
from small_study import write_small_study

from PolyPoseLib.io.cohort import fingerprint as module
from PolyPoseLib.io.cohort.fingerprint import fingerprint

OPTIONS = {"preset": "fast"}


@pytest.fixture
def study(tmp_path):
    """A study whose files have not changed for a minute."""
    path = write_small_study(tmp_path / "Secretname")
    for each in path.parent.iterdir():
        os.utime(each, (time.time() - 60,) * 2)
    return path


def digest(study, options=OPTIONS, known=None, **more):
    return fingerprint(study, options, more.get("allow_outside", False), known or {})[0]


def test_it_is_the_same_twice_and_in_another_place(study, tmp_path):
    before = digest(study)
    assert len(before) == 64 and before == digest(study)
    copy = shutil.copytree(study.parent, tmp_path / "elsewhere")
    assert digest(copy / "study.json") == before


@pytest.mark.parametrize("name", ["study.json", "ct.nii.gz", "labels.nii.gz", "ap.nii.gz"])
def test_one_byte_of_any_file_changes_it(study, name):
    before, stamps = fingerprint(study, OPTIONS, False, {})
    path = study.parent / name
    whole = bytearray(path.read_bytes())
    if name == "study.json":
        whole += b" "
    else:
        whole[-1] ^= 1
    path.write_bytes(whole)
    assert digest(study) != before and digest(study, known=stamps) != before


def test_options_and_the_version_change_it(study, monkeypatch):
    before = digest(study)
    assert digest(study, {"preset": "default"}) != before
    monkeypatch.setattr(module, "__version__", "9.9.9")
    assert digest(study) != before


def test_a_file_that_is_not_named_changes_nothing(study):
    before = digest(study)
    (study.parent / "notes.txt").write_text("notes")
    assert digest(study) == before


def test_files_of_known_size_and_time_are_not_read_again(study):
    before, stamps = fingerprint(study, OPTIONS, False, {})
    assert len(stamps) == 4
    image = study.parent / "ap.nii.gz"
    times = (image.stat().st_atime_ns, image.stat().st_mtime_ns)
    image.write_bytes(image.read_bytes()[:-1] + b"?")
    os.utime(image, ns=times)
    assert digest(study, known=stamps) == before, "the one change that only --rehash sees"
    assert digest(study) != before


def test_a_file_that_has_just_changed_is_read_again(study):
    (study.parent / "ap.nii.gz").touch()
    assert len(fingerprint(study, OPTIONS, False, {})[1]) == 3


def test_stamps_name_no_file(study):
    stamps = fingerprint(study, OPTIONS, False, {})[1]
    assert all(set(name) <= set("0123456789abcdef") for name in stamps)


@pytest.mark.parametrize("damage", ["absent", "no json", "outside"])
def test_a_study_that_is_wrong_has_one_too_until_it_is_mended(study, damage):
    before = digest(study)
    text = study.read_text()
    if damage == "absent":
        (study.parent / "ct.nii.gz").unlink()
    elif damage == "no json":
        study.write_text("{")
    else:
        study.write_text(text.replace("ct.nii.gz", "../ct.nii.gz"))
    wrong = digest(study)
    assert len(wrong) == 64 and wrong not in (before, digest(study, {}))
    assert digest(study) == wrong


def test_all_slices_of_a_folder_count(study):
    folder = study.parent / "ct"
    folder.mkdir()
    (folder / "1.dcm").write_bytes(b"1")
    (folder / "2.dcm").write_bytes(b"2")
    study.write_text(study.read_text().replace('"ct.nii.gz"', '"ct"'))
    before = digest(study)
    (folder / "2.dcm").write_bytes(b"3")
    assert digest(study) != before
