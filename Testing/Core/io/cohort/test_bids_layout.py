"""A BIDS-like data set is a cohort, and a cohort's folder a derivative, as the validator of BIDS has it."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath

import pytest
from bids_case import DESCRIPTION, write_bids_study, write_data_set
from result_case import make_result

from PolyPoseLib import __version__
from PolyPoseLib.data.cohort.outcome import Outcome
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.bids_derivative import write_description
from PolyPoseLib.io.cohort.cohort_folder import opened_cohort
from PolyPoseLib.io.cohort.entries import read_entries
from PolyPoseLib.io.cohort.outcome_files import write_outcome
from PolyPoseLib.io.cohort.report import write_summary
from PolyPoseLib.io.results import save_result
from PolyPoseLib.io.study_schema import read


@pytest.fixture(scope="module")
def data_set(tmp_path_factory):
    return write_data_set(tmp_path_factory.mktemp("bids") / "hips")


@pytest.fixture(scope="module")
def derivative(data_set):
    """The folder of a cohort that has registered the data set."""
    (data_set / "derivatives").mkdir()
    with opened_cohort(data_set / "derivatives/polypose", data_set) as folder:
        write_description(folder, data_set)
        outcomes = []
        for entry in read_entries(data_set, False):
            (folder / entry.place).parent.mkdir(parents=True, exist_ok=True)
            save_result(make_result(), folder / entry.place, report=False)
            for name in ("report.html", "report.png"):
                (folder / entry.place / name).write_text("a report")
            (folder / "logs" / f"{entry.identity}.log").write_text("a log")
            outcomes.append(Outcome(entry.identity, 0, place=str(entry.place)))
            write_outcome(folder, outcomes[-1])
        write_summary(folder, outcomes)
    return folder


def errors_of(folder: Path) -> list[str]:
    """What the validator finds wrong, code and place."""
    validator = shutil.which(
        "bids-validator-deno", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    )
    if validator is None:
        pytest.skip("needs bids-validator-deno")
    command = [validator, str(folder), "--format", "json"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    issues = json.loads(done.stdout)["issues"]["issues"]
    return [f"{each['code']} {each['location']}" for each in issues if each["severity"] == "error"]


def test_what_macos_leaves_beside_a_study_is_none(tmp_path):
    folder = write_data_set(tmp_path / "hips", ("sub-01",))
    (folder / "sub-01/._sub-01_study.json").write_bytes(b"\0")
    assert [each.identity for each in read_entries(folder, False)] == ["sub-01"]


def test_studies_are_found_by_subject_and_session(data_set):
    found = read_entries(data_set, False)
    assert [each.identity for each in found] == ["sub-01", "sub-02_ses-a", "sub-02_ses-b"]
    assert found[1].place == PurePosixPath("sub-02/ses-a/sub-02_ses-a_polypose")
    for each in found:
        assert (each.study.parent / read(each.study)["ct"]).is_file()


def test_several_studies_of_a_session_have_parts_of_their_own(tmp_path):
    folder = write_data_set(tmp_path / "set", ("sub-01_acq-lying", "sub-01_acq-standing"))
    assert [each.identity for each in read_entries(folder, False)] == [
        "sub-01_acq-lying",
        "sub-01_acq-standing",
    ]


@pytest.mark.parametrize("name", ["sub-02", "other", "sub-01_ses-a standing", "sub-01_", "sub-011"])
def test_a_study_that_is_called_after_another_subject_is_refused(tmp_path, name):
    folder = write_data_set(tmp_path / "set", ("sub-01",))
    write_bids_study(folder / "sub-01", name)
    with pytest.raises(InputError, match=r'a study is called "sub-01_study\.json"'):
        read_entries(folder, False)


@pytest.mark.parametrize(
    ("description", "said"),
    [("{", "not valid JSON"), ("{}", '"Name" is missing'), ('{"Name": "a"}', '"BIDSVersion"')],
)
def test_a_damaged_description_is_refused(tmp_path, description, said):
    folder = write_data_set(tmp_path / "set")
    (folder / "dataset_description.json").write_text(description)
    with pytest.raises(InputError, match=said):
        read_entries(folder, False)


def test_a_data_set_without_studies_says_how_they_are_called(tmp_path):
    folder = write_data_set(tmp_path / "set", ())
    with pytest.raises(InputError, match=r"sub-01/sub-01_study\.json"):
        read_entries(folder, False)


def test_the_derivative_says_what_made_it_and_from_what(derivative):
    fields = json.loads((derivative / "dataset_description.json").read_text())
    assert fields["DatasetType"] == "derivative" and DESCRIPTION["Name"] in fields["Name"]
    assert [(each["Name"], each["Version"]) for each in fields["GeneratedBy"]] == [("PolyPose", __version__)]
    assert fields["SourceDatasets"] == [{"DOI": DESCRIPTION["DatasetDOI"]}]


def test_the_validator_finds_the_data_set_sound(data_set):
    assert errors_of(data_set) == []


def test_the_validator_finds_the_derivative_sound(derivative):
    assert errors_of(derivative) == []


def test_the_validator_would_not_without_the_list_of_what_deviates(data_set, tmp_path):
    bare = shutil.copytree(data_set, tmp_path / "bare", ignore=shutil.ignore_patterns("derivatives"))
    (bare / ".bidsignore").unlink()
    assert "NOT_INCLUDED /sub-01/ct/sub-01_ct.nii.gz" in errors_of(bare)


def test_pybids_finds_subjects_and_sessions(data_set, derivative):
    bids = pytest.importorskip("bids")
    layout = bids.BIDSLayout(data_set, validate=False, derivatives=derivative)
    assert layout.get_subjects() == ["01", "02"] and layout.get_sessions() == ["a", "b"]
