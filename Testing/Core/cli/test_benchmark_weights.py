"""What --weights means: files for all cases, for a set of views, or for a subject."""

import pytest

from PolyPoseLib.benchmark.systems import NamedSystem
from PolyPoseLib.cli._benchmark_weights import weight_files
from PolyPoseLib.data.benchmark.job import CaseSource
from PolyPoseLib.errors import InputError

SYSTEMS = [NamedSystem("mine", "my_systems:Mine", own=True)]
SOURCES = [CaseSource("headneck", "/data", subject, "2x30") for subject in ("HN_P001", "HN_P002")]


@pytest.fixture
def file(tmp_path):
    (tmp_path / "w=1@x.pt").write_text("weights")
    return tmp_path / "w=1@x.pt"


def test_views_have_one_spelling_and_paths_any(file):
    words = [f"mine={file}", f"mine@02x30.0={file}", f"mine@HN_P002={file}"]
    found = weight_files(words, SYSTEMS, SOURCES)
    assert found == dict.fromkeys(["mine", "mine@2x30", "mine@HN_P002"], file)


@pytest.mark.parametrize("twice", [("mine", "mine"), ("mine@2x30", "mine@02x30"), ("mine@HN_P001",) * 2])
def test_two_files_for_one_thing_are_refused(file, twice):
    with pytest.raises(InputError, match="has two files"):
        weight_files([f"{each}={file}" for each in twice], SYSTEMS, SOURCES)


@pytest.mark.parametrize("part", ["3x30", "HN_P003", "", "2x30@HN_P001"])
def test_what_is_none_of_the_call_is_refused(file, part):
    with pytest.raises(InputError, match="subject or set of views"):
        weight_files([f"mine@{part}={file}"], SYSTEMS, SOURCES)
