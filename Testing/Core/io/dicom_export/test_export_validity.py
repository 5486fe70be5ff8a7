"""Validators of the standard find no fault in what is exported, from CTs of many kinds, and see those put in."""

import numpy as np
import pydicom
import pytest
from dicom_case import write_dicom_case
from dicom_validators import attribute_errors, attribute_faults, entity_faults
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.dicom_export.export import export_dicom
from PolyPoseLib.io.dicom_export.inputs import CtChoice
from PolyPoseLib.io.volumes import read_volume, write_volume

ABSENT = (
    "PatientBirthDate", "PatientSex", "StudyDate", "StudyTime", "StudyID", "AccessionNumber", "KVP",
    "ReferringPhysicianName", "Manufacturer", "PatientPosition", "BodyPartExamined", "WindowCenter", "WindowWidth",
    "SeriesNumber",
)  # fmt: skip
WRONG = {
    "PatientBirthDate": "in 1950", "PatientSex": "U", "PatientAge": "old", "StudyDate": "3.2.2024",
    "StudyTime": "about noon", "PatientWeight": "heavy", "KVP": "high", "AccessionNumber": "A" * 40,
    "WindowCenter": "mid",
}  # fmt: skip


def files_of(folder):
    return sorted(folder.rglob("*.dcm"))


def one_of_each(folder):
    """A file of each kind, since slices of a series have the same attributes."""
    return [
        file
        for file in files_of(folder)
        if file.parent.name not in ("ct", "original_ct") or file.stem == "0001"
    ]


def rewrite(folder, change):
    """Change every slice; values of any quality."""
    with pydicom.config.disable_value_validation():
        for file in folder.iterdir():
            whole = pydicom.dcmread(file)
            change(whole)
            whole.save_as(file)


@pytest.mark.parametrize("seed", range(3))
def test_objects_are_valid_and_agree_with_the_cts(tmp_path, seed):
    case = write_dicom_case(tmp_path / "case", seed, left_handed=seed == 1)
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    files = files_of(folder)
    assert len(files) == 12 + 1 + 1 + 1 + 2
    assert attribute_faults(*(files if seed == 0 else one_of_each(folder))) == []
    assert entity_faults(*files, *files_of(case.ct_folder)) == []


def test_the_validators_see_faults(tmp_path):
    case = write_dicom_case(tmp_path / "case")
    folder = export_dicom(case.result, case.study, tmp_path / "dicom", leave_out=["segmentation"])
    for file in (folder / "deformation.dcm", folder / "bones/01_pelvis.dcm", folder / "ct/0001.dcm"):
        whole = pydicom.dcmread(file)
        del whole.FrameOfReferenceUID
        whole.save_as(file)
        assert any("FrameOfReferenceUID" in line for line in attribute_faults(file))
    assert entity_faults(*files_of(folder))  # without the CT, to which they refer


@pytest.mark.parametrize(("part", "side"), [("HIP", None), ("HIP", "L"), ("CHEST", None), (None, "R")])
def test_the_side_of_the_body_part_is_as_valid_as_the_cts(tmp_path, part, side):
    case = write_dicom_case(tmp_path / "case", BodyPartExamined=part or "")
    if side:
        rewrite(case.ct_folder, lambda whole: setattr(whole, "Laterality", side))
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    assert attribute_errors(*one_of_each(folder)) == []
    assert str(pydicom.dcmread(folder / "ct/0001.dcm").get("Laterality") or "") == (side or "")


def test_headers_with_next_to_nothing_give_valid_objects(tmp_path):
    case = write_dicom_case(tmp_path / "case")
    rewrite(case.ct_folder, lambda whole: [delattr(whole, name) for name in ABSENT])
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    assert attribute_errors(*one_of_each(folder)) == []


@pytest.mark.parametrize("syntax", [ImplicitVRLittleEndian, ExplicitVRLittleEndian])
def test_wrong_values_are_left_out_and_the_patient_is_kept(tmp_path, caplog, syntax):
    case = write_dicom_case(tmp_path / "case", PatientName="Smith^John", PatientID="SECRET-ID")

    def change(whole):
        whole.file_meta.TransferSyntaxUID = syntax
        for name, value in WRONG.items():
            whole.add_new(name, "LO", value)  # which only the explicit syntax says

    rewrite(case.ct_folder, change)
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    assert attribute_errors(*one_of_each(folder)) == []
    for file in files_of(folder):
        whole = pydicom.dcmread(file)
        assert (whole.PatientName, whole.PatientID) == ("Smith^John", "SECRET-ID")
        assert not whole.PatientSex and not whole.PatientBirthDate
    for name in WRONG:
        assert name in caplog.text
    assert "Smith" not in caplog.text and "SECRET" not in caplog.text and "heavy" not in caplog.text


def test_a_ct_that_never_was_dicom_is_written_for_a_placeholder(tmp_path):
    case = write_dicom_case(tmp_path / "case", 1, left_handed=True)
    ct = Volume(read_volume(case.ct_folder).voxels[::-1], case.result.warped_ct.affine)
    write_volume(ct, tmp_path / "case/ct.nii.gz")
    case.study.write_text(case.study.read_text().replace('"ct": "ct"', '"ct": "ct.nii.gz"'))
    folder = export_dicom(case.result, case.study, tmp_path / "dicom", CtChoice(new_patient="Rabbit 7"))
    files = files_of(folder)
    assert attribute_errors(*one_of_each(folder)) == []
    assert entity_faults(*files) == []
    assert {str(pydicom.dcmread(file).PatientID) for file in files} == {"Rabbit 7"}
    written = read_volume(folder / "original_ct")
    index = np.rint(written.to_index(ct.to_world(np.array([[0, 0, 0], [5, 6, 7]])))).astype(int)
    assert [written.voxels[k, j, i] for i, j, k in index] == [ct.voxels[0, 0, 0], ct.voxels[7, 6, 5]]
    source = pydicom.dcmread(next((folder / "original_ct").iterdir()))
    deformation = pydicom.dcmread(folder / "deformation.dcm")
    assert (
        deformation.DeformableRegistrationSequence[0].SourceFrameOfReferenceUID == source.FrameOfReferenceUID
    )
    assert deformation.FrameOfReferenceUID != source.FrameOfReferenceUID
