"""The folder of a cohort: known again, also after a run that was killed as it made it, and one run's at a time."""

import os

import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.io import marked_folders
from PolyPoseLib.io.cohort.cohort_folder import opened_cohort


@pytest.fixture
def source(tmp_path):
    (tmp_path / "in").mkdir()
    return tmp_path / "in"


def test_two_runs_at_a_time_are_refused(tmp_path, source):
    with (
        opened_cohort(tmp_path / "out", source),
        pytest.raises(InputError, match=f"another run of PolyPose .process {os.getpid()}. is writing here"),
        opened_cohort(tmp_path / "out", source),
    ):
        pass


@pytest.mark.parametrize("name", [".0123abcd-cohort.json", ".cohort.json.polypose-lock", ".DS_Store"])
def test_what_a_killed_run_leaves_before_the_mark_is_no_strangers(tmp_path, source, name):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("")
    with opened_cohort(tmp_path / "out", source) as folder:
        assert (folder / "cohort.json").is_file() and (folder / "logs/workers").is_dir()


def test_the_mark_is_the_first_thing_in_it(tmp_path, source, monkeypatch):
    found = []

    class Killed(Exception):
        pass

    def write(path):
        found.append(sorted(each.name for each in path.parent.iterdir()))
        raise Killed

    monkeypatch.setattr(marked_folders, "replaced_whole", write)
    with pytest.raises(Killed), opened_cohort(tmp_path / "out", source):
        pass
    assert found == [[]]


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="needs links")
def test_a_link_in_a_circle_is_refused(tmp_path, source):
    (tmp_path / "loop").symlink_to("loop")
    with (
        pytest.raises((InputError, OSError), match=r"circle|exists|levels"),
        opened_cohort(tmp_path / "loop", source),
    ):
        pass


def test_files_of_others_are_left_alone(tmp_path, source):
    (tmp_path / "out/.git").mkdir(parents=True)
    with pytest.raises(InputError, match=r'no cohort.s .".git".'), opened_cohort(tmp_path / "out", source):
        pass
    assert [each.name for each in (tmp_path / "out").iterdir()] == [".git"]
