"""Cases are known again by what they are made of, and read again only where that has changed."""

import os
import re

import numpy as np
import pytest
from benchmark_home import change_one_voxel, run

from PolyPoseLib.benchmark import digests, know_cases
from PolyPoseLib.benchmark import run as benchmark_run
from PolyPoseLib.io.benchmark import two_scans


def test_changed_data_are_read_and_run_again_and_touched_ones_only_read(home):
    home, started = home
    first = run(home, "rest")
    started.clear()
    ct = home / "data/case-1/ct.nii.gz"
    os.utime(ct, (1, 1))
    assert run(home, "rest") == first and started == ["know_cases"]
    started.clear()
    change_one_voxel(home)
    (row,) = run(home, "rest")
    assert started == ["know_cases", "run_system"] and row["case_digest"] != first[0]["case_digest"]


def test_data_that_change_between_reading_and_running_give_no_scores(home, monkeypatch):
    home, _ = home
    known = know_cases.known_cases

    def changed_afterwards(source):
        cases = known(source)
        change_one_voxel(home)
        return cases

    monkeypatch.setattr(know_cases, "known_cases", changed_afterwards)
    (row,) = run(home, "rest")
    assert row["status"] == "failed" and "have changed meanwhile" in row["reason"]


@pytest.fixture
def projector(monkeypatch):
    """Sets the projector's name and by how much its pictures are off."""

    def is_now(name, off=0.0):
        def project(attenuation, camera):
            drawn = np.random.default_rng(0).random((camera.height, camera.width)) + off
            return drawn.astype(np.float32)

        monkeypatch.setattr(two_scans, "project", project)
        for module in (two_scans, benchmark_run):
            monkeypatch.setattr(module, "projector_name", lambda: name)

    return is_now


def test_the_last_bits_of_what_is_computed_are_no_change_of_the_data(home, projector):
    """Processors and versions of libraries differ in them: the benchmark would never end."""
    home, started = home
    projector("rtk 1")
    first = run(home, "rest", views=("2x30",))
    projector("rtk 1", 1e-6)
    rows = run(home, "rest", "m=my_systems:Mine", views=("2x30",))
    assert rows[0] == first[0] and [row["status"] for row in rows] == ["done", "done"]
    assert started == ["know_cases", "run_system", "run_system"]
    os.utime(home / "data/case-1/ct.nii.gz", (1, 1))  # read again, it is still the same case
    assert run(home, "rest", views=("2x30",)) == first


def test_cases_are_run_again_with_another_projector_but_not_those_whose_x_rays_are_given(home, projector):
    home, started = home
    projector("rtk 1")
    first = run(home, "rest", views=("own", "2x30"))
    projector("sum", 1e-2)
    started.clear()
    rows = run(home, "rest", views=("own", "2x30"))
    assert rows[0] == first[0] and [row["status"] for row in rows] == ["done", "done"]
    assert rows[1]["case_digest"] != first[1]["case_digest"]
    assert started == ["know_cases", "know_cases", "run_system"]
    started.clear()
    assert run(home, "rest", views=("own", "2x30")) == rows and not started


def test_a_projector_that_changes_between_reading_and_running_gives_no_scores(home, projector, monkeypatch):
    home, _ = home
    projector("rtk 1")
    known = know_cases.known_cases

    def changed_afterwards(source):
        cases = known(source)
        projector("sum")
        return cases

    monkeypatch.setattr(know_cases, "known_cases", changed_afterwards)
    (row,) = run(home, "rest", views=("2x30",))
    assert row["status"] == "failed" and "run the command again with --resume" in row["reason"]
    (row,) = run(home, "rest", views=("2x30",))
    assert row["status"] == "done"


def test_a_file_that_cannot_be_read_is_told_in_one_sentence(home, monkeypatch):
    home, _ = home

    def refused(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(digests, "file_digest", refused)
    (row,) = run(home, "rest")
    assert row["status"] == "failed"
    assert re.search(
        r"could not be read: case-1/\S+: the file cannot be read \(Permission denied\)", row["reason"]
    )


def test_a_result_beside_the_x_rays_is_no_part_of_the_case(home):
    home, started = home
    first = run(home, "rest")
    (home / "data/case-1/result").mkdir()
    (home / "data/case-1/result/result.json").write_text("{}")
    (home / "data/case-1/result/transform.h5").write_text("")
    assert run(home, "rest") == first and started == ["know_cases", "run_system", "know_cases"]
