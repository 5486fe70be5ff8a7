"""What cannot be exported is refused in one sentence that names the file and the fix, and nothing is written."""

import importlib.util
import json

import numpy as np
import pydicom
import pytest
from dicom_case import write_dicom_case
from pydicom.uid import generate_uid

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom_export.export import export_dicom
from PolyPoseLib.io.volumes import read_volume, write_volume


@pytest.fixture
def case(tmp_path):
    made = write_dicom_case(tmp_path / "case")
    made.result.save(tmp_path / "result")
    return made


def refusal(tmp_path, capsys, case, *more) -> str:
    """The sentence of an export that must not succeed."""
    arguments = ["dicom", tmp_path / "result", "--study", case.study, "--output", tmp_path / "dicom", *more]
    assert main([str(each) for each in arguments]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1, said
    assert not (tmp_path / "dicom").exists()
    return said


def change_slices(case, change):
    for number, file in enumerate(sorted(case.ct_folder.iterdir())):
        whole = pydicom.dcmread(file)
        change(whole, number)
        whole.save_as(file)


def change_study(case, **fields):
    case.study.write_text(json.dumps({**json.loads(case.study.read_text()), **fields}))


def test_a_ct_that_is_not_dicom_needs_its_folder_or_a_new_patient(tmp_path, capsys, case):
    write_volume(read_volume(case.ct_folder), tmp_path / "case/ct.nii.gz")
    change_study(case, ct="ct.nii.gz")
    said = refusal(tmp_path, capsys, case)
    assert '"ct" is not DICOM' in said and "--ct" in said and "--new-patient" in said
    arguments = ["dicom", tmp_path / "result", "--study", case.study, "--output", tmp_path / "dicom"]
    assert main([str(each) for each in (*arguments, "--ct", case.ct_folder)]) == 0
    frame = pydicom.dcmread(next(case.ct_folder.iterdir())).FrameOfReferenceUID
    whole = pydicom.dcmread(tmp_path / "dicom/bones/01_pelvis.dcm")
    assert frame in {each.FrameOfReferenceUID for each in whole.RegistrationSequence}


def test_a_known_patient_is_not_replaced(tmp_path, capsys, case):
    assert "leave out --new-patient" in refusal(tmp_path, capsys, case, "--new-patient", "1")


@pytest.mark.parametrize("number", ["", " ", "x" * 65, "a\\b", "a\nb"])
def test_ids_that_dicom_does_not_allow(tmp_path, capsys, case, number):
    write_volume(read_volume(case.ct_folder), tmp_path / "case/ct.nii.gz")
    change_study(case, ct="ct.nii.gz")
    assert "A patient's ID has 1 to 64 characters" in refusal(tmp_path, capsys, case, "--new-patient", number)


def test_another_ct_is_refused(tmp_path, capsys, case):
    other = write_dicom_case(tmp_path / "other", seed=5)
    said = refusal(tmp_path, capsys, case, "--ct", other.ct_folder)
    assert "lie on different grids" in said and "from which the result was computed" in said


def test_another_study_is_refused(tmp_path, capsys, case):
    change_study(case, structures={"pelvis": [25], "tibia": [75]})
    assert 'The structure "femur_left" is not known' in refusal(tmp_path, capsys, case)
    change_study(case, structures={"pelvis": [25], "femur_left": [75]}, anchor="femur_left")
    assert 'its anchor is "pelvis", not "femur_left"' in refusal(tmp_path, capsys, case)


@pytest.mark.parametrize("keyword", ["FrameOfReferenceUID", "StudyInstanceUID", "SOPInstanceUID"])
def test_slices_without_identifiers_are_refused(tmp_path, capsys, case, keyword):
    change_slices(case, lambda whole, number: delattr(whole, keyword))
    said = refusal(tmp_path, capsys, case)
    assert f"has no valid {keyword}" in said and "export the series" in said


@pytest.mark.parametrize(
    ("keyword", "words"), [("FrameOfReferenceUID", "2 frames of reference"), ("PatientID", "2 patients")]
)
def test_slices_that_do_not_belong_together_are_refused(tmp_path, capsys, case, keyword, words):
    change_slices(case, lambda whole, number: number == 3 and setattr(whole, keyword, "1.2.3"))
    said = refusal(tmp_path, capsys, case)
    assert words in said and "4711" not in said


def test_several_series_want_a_choice(tmp_path, capsys, case):
    uid = generate_uid()
    for file in list(case.ct_folder.iterdir()):
        whole = pydicom.dcmread(file)
        whole.SeriesInstanceUID, whole.SOPInstanceUID = uid, generate_uid()
        whole.file_meta.MediaStorageSOPInstanceUID = whole.SOPInstanceUID
        whole.SeriesNumber = 9
        whole.save_as(case.ct_folder / f"second_{file.name}")
    assert "there are 2 CT series" in refusal(tmp_path, capsys, case)
    arguments = ["dicom", tmp_path / "result", "--study", case.study, "--output", tmp_path / "dicom"]
    assert main([str(each) for each in (*arguments, "--ct", case.ct_folder, "--ct-series", uid)]) == 0
    named = pydicom.dcmread(tmp_path / "dicom/deformation.dcm").ReferencedSeriesSequence
    assert uid in {each.SeriesInstanceUID for each in named}
    assert pydicom.dcmread(tmp_path / "dicom/ct/0001.dcm").SeriesNumber == 901


def test_highdicom_is_asked_for_before_any_work(tmp_path, capsys, case, monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "highdicom" else found(name, *a)
    )
    assert "polypose[dicom]" in refusal(tmp_path, capsys, case)
    arguments = ["dicom", tmp_path / "result", "--study", case.study, "--output", tmp_path / "dicom"]
    assert main([str(each) for each in (*arguments, "--leave-out", "segmentation")]) == 0
    left = {each.name for each in (tmp_path / "dicom").iterdir()}
    assert left == {"README.txt", "bones", "contours.dcm", "ct", "deformation.dcm"}


def test_folders_that_hold_something_are_kept(tmp_path, capsys, case):
    (tmp_path / "dicom").mkdir()
    (tmp_path / "dicom/mine.txt").write_text("mine")
    arguments = ["dicom", tmp_path / "result", "--study", case.study, "--output", tmp_path / "dicom"]
    assert main([str(each) for each in arguments]) == 2
    assert "choose a new or empty folder" in capsys.readouterr().err
    assert [each.name for each in (tmp_path / "dicom").iterdir()] == ["mine.txt"]


def test_a_damaged_slice_is_named(tmp_path, capsys, case):
    file = sorted(case.ct_folder.iterdir())[2]
    file.write_bytes(file.read_bytes()[:200])
    assert str(file) in refusal(tmp_path, capsys, case)


def test_changed_bytes_of_the_patient_and_study_end_in_objects_or_a_sentence(tmp_path, case):
    rng = np.random.default_rng(0)
    whole = {file: file.read_bytes() for file in case.ct_folder.iterdir()}
    ends = []
    for number in range(16):
        for file, content in whole.items():
            low, high = content.index(b"\x08\x00\x20\x00"), content.index(b"\x20\x00\x0d\x00")
            changed = bytearray(content)
            changed[low + int(rng.random() * (high - low))] = int(rng.integers(256))
            file.write_bytes(changed)
        try:
            export_dicom(case.result, case.study, tmp_path / str(number), leave_out=["segmentation", "bones"])
            ends.append("written")
        except InputError:
            ends.append("refused")
            assert not (tmp_path / str(number)).exists()
        rng = np.random.default_rng(number + 1)
    assert set(ends) == {"written", "refused"}


def test_values_beyond_16_bits_are_stored_as_the_nearest(tmp_path, case):
    voxels = case.result.warped_ct.voxels.copy()
    voxels.flat[:3] = 1e6, -1e6, np.nan
    for kind, expected in ((np.float32, [32767, -32768, -1000]), (np.int32, [32767, -32768])):
        with np.errstate(invalid="ignore"):
            case.result.warped_ct = Volume(voxels.astype(kind), case.result.warped_ct.affine)
        folder = export_dicom(case.result, case.study, tmp_path / kind.__name__, leave_out=["segmentation"])
        pixels = pydicom.dcmread(folder / "ct/0001.dcm").pixel_array.ravel()
        assert pixels[: len(expected)].tolist() == expected
