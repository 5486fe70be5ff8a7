"""Names that may be a patient's are taken out of texts, whatever they look like."""

import pytest

from PolyPoseLib.benchmark.hidden_names import HiddenNames
from PolyPoseLib.data.benchmark.job import CaseSource
from PolyPoseLib.io.benchmark import headneck


@pytest.fixture
def root(tmp_path):
    for name in (
        "Doe, John: 4711/CT of Doe/a b.dcm",
        "HN_P001/ct_1.nii.gz",
        "HN_P001/masks/vertebrae_C5.nii.gz",
    ):
        place = tmp_path / "data" / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text("")
    return tmp_path / "data"


def hidden(root, text, subject=None):
    names = [each for each in headneck.subjects(root) if each != "HN_P001"]
    return HiddenNames(CaseSource("headneck", str(root), subject or names[0], "2x30"))(text)


def test_names_below_the_data_are_hidden_and_those_that_tell_nothing_of_a_person_stay(root):
    (subject,) = (each for each in headneck.subjects(root) if each != "HN_P001")
    said = hidden(root, f"{root}/Doe, John: 4711/CT of Doe/a b.dcm: it is damaged.")
    assert said.startswith(f"{subject}/s") and said.endswith(": it is damaged.")
    assert not {"Doe", "John", "CT of", "a b"} & {
        each for each in ("Doe", "John", "CT of", "a b") if each in said
    }
    plain = "HN_P001/ct_1.nii.gz: bad; see HN_P001/masks/vertebrae_C5.nii.gz"
    assert hidden(root, plain.replace("HN_P001/ct", f"{root}/HN_P001/ct")) == plain
    assert hidden(root, f"{root}: odd", "HN_P001") == "the data: odd"
    assert hidden(root, "the folder Doe, John: 4711 is odd") == f"the folder {subject} is odd"
    assert "Roe" not in hidden(root, f"{root}/HN_P001/Roe_Jane/1.dcm: there is no such file")
    beside = f"{root}-2/x: odd"
    assert hidden(root, beside) == beside


def test_a_root_that_is_the_patients_own_folder_is_hidden_too(root):
    own = root / "Doe, John: 4711"
    (subject,) = (each for each in headneck.subjects(root) if each != "HN_P001")
    hide = HiddenNames(CaseSource("simulated", str(own), subject, "own"))
    assert hide(f"{own}/study.json: odd; Doe, John: 4711") == f"study.json: odd; {subject}"


def test_a_log_is_rewritten_as_it_was_but_for_names(root, tmp_path):
    log = tmp_path / "a.log"
    log.write_bytes(b"one\n\xff " + str(root / "Doe, John: 4711").encode() + b"\nlast")
    (subject,) = (each for each in headneck.subjects(root) if each != "HN_P001")
    HiddenNames(CaseSource("headneck", str(root), subject, "2x30")).in_file(log)
    assert log.read_bytes() == b"one\n\xff " + subject.encode() + b"\nlast"


def test_long_numbers_such_as_dicoms_own_take_no_time(root):
    """A pattern that tries every way to cut a number apart would never end."""
    name = "1.2.840." + "0123456789" * 6 + ".x.dcm"
    said = hidden(root, f"{root}/HN_P001/{name}: odd", "HN_P001")
    assert name not in said and said.endswith(": odd")
