"""The patient of the CT is in every object, in any script, and in no name of a file, no log and no sentence."""

import logging

import pydicom
import pytest
from dicom_case import PATIENT, write_dicom_case
from dicom_validators import attribute_errors

from PolyPoseLib.__main__ import main
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom_export import export as export_module
from PolyPoseLib.io.dicom_export.export import export_dicom

NAMES = [
    (None, "Nobody^Nowhere", "femur_left"),
    ("ISO_IR 100", "Müller^Jörg", "fémur gauche"),
    ("ISO_IR 144", "Люкceмбypг", "бедро"),
    ("ISO_IR 192", "Wang^XiaoDong=王^小东", "股骨"),
    (["", "ISO 2022 IR 87"], "Yamada^Tarou=山田^太郎=やまだ^たろう", "femur"),
    (["", "ISO 2022 IR 149"], "Hong^Gildong=洪^吉洞=홍^길동", "대퇴골"),
    (None, "Nobody^Nowhere", "股骨"),
    ("NO SUCH SET", "Nobody^Nowhere", "femur"),
]


def renamed(case, name):
    """The same case with another name for its moving bone."""
    case.study.write_text(case.study.read_text().replace("femur_left", name), encoding="utf-8")
    case.result.structures[name] = case.result.structures.pop("femur_left")
    return case


@pytest.mark.parametrize(("character_set", "patient", "bone"), NAMES)
def test_names_in_any_script_survive(tmp_path, character_set, patient, bone):
    tags = {} if character_set is None else {"SpecificCharacterSet": character_set}
    case = renamed(write_dicom_case(tmp_path / "case", PatientName=patient, **tags), bone)
    source = pydicom.dcmread(next(case.ct_folder.iterdir()))
    assert str(source.PatientName) == patient
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    files = [*sorted((folder / "ct").iterdir())[:1], *folder.glob("*.dcm"), *(folder / "bones").iterdir()]
    assert len(files) == 6
    for file in files:
        whole = pydicom.dcmread(file)
        assert whole.PatientName == source.PatientName, file.name
    bones = [pydicom.dcmread(each) for each in sorted((folder / "bones").iterdir())]
    assert bones[1].SeriesDescription == f"PolyPose: rigid motion of {bone}"
    assert all(file.name.isascii() for file in folder.rglob("*"))
    errors = attribute_errors(*files)
    assert [line for line in errors if "haracter" not in line] == []


def test_every_object_has_the_patient_and_the_study_of_the_ct(tmp_path):
    case = write_dicom_case(tmp_path / "case", OtherPatientNames="Else^Some", PatientAge="074Y")
    source = pydicom.dcmread(next(case.ct_folder.iterdir()))
    folder = export_dicom(case.result, case.study, tmp_path / "dicom")
    wanted = ("StudyInstanceUID", "OtherPatientNames", "PatientAge", *list(PATIENT)[:9])
    series = {}
    for file in folder.rglob("*.dcm"):
        whole = pydicom.dcmread(file)
        assert [whole[each].value for each in wanted] == [source[each].value for each in wanted], file.name
        series.setdefault(whole.SeriesInstanceUID, set()).add((whole.Modality, int(whole.SeriesNumber)))
    assert all(len(each) == 1 for each in series.values())
    kinds = {kind for (kind,) in series.values()}
    assert kinds == {("CT", 401), ("SEG", 402), ("RTSTRUCT", 403), ("REG", 404), ("REG", 405), ("REG", 406)}
    assert len(series) == len(kinds)
    assert source.SeriesInstanceUID not in series
    instances = [str(pydicom.dcmread(each).SOPInstanceUID) for each in folder.rglob("*.dcm")]
    assert len(set(instances)) == len(instances)


def test_no_log_no_name_and_no_other_file_names_the_patient(tmp_path, caplog, capsys, monkeypatch):
    caplog.set_level(logging.DEBUG)
    case = write_dicom_case(
        tmp_path / "case", PatientName="Smith,John", PatientID="SECRET-ID", PatientSex="W"
    )
    case.result.save(tmp_path / "result")
    arguments = [
        "dicom",
        tmp_path / "result",
        "--study",
        case.study,
        "--output",
        tmp_path / "dicom",
        "--debug",
    ]
    assert main([str(each) for each in arguments]) == 0
    said = caplog.text + "".join(capsys.readouterr())
    names = " ".join(str(each.relative_to(tmp_path)) for each in (tmp_path / "dicom").rglob("*"))
    said += names + (tmp_path / "dicom/README.txt").read_text()
    assert "PatientSex" in said
    for secret in ("Smith", "John", "SECRET"):
        assert secret not in said
    assert pydicom.dcmread(tmp_path / "dicom/segmentation.dcm").PatientName == "Smith,John"


@pytest.mark.parametrize(
    "failing", ["deformable_registration", "segmentation", "spatial_registration", "structure_set"]
)
def test_all_is_written_or_nothing(tmp_path, monkeypatch, failing):
    case = write_dicom_case(tmp_path / "case")

    def fail(*_):
        raise InputError("as the test asks")

    monkeypatch.setattr(export_module, failing, fail)
    with pytest.raises(InputError, match="as the test asks"):
        export_dicom(case.result, case.study, tmp_path / "dicom")
    assert sorted(each.name for each in tmp_path.iterdir() if "lock" not in each.name) == ["case"]


def test_results_that_must_not_be_trusted_say_so_everywhere(tmp_path, capsys):
    case = write_dicom_case(tmp_path / "case")
    case.result.distrust = ("The X-rays and the CT do not overlap.",)
    case.result.save(tmp_path / "result")
    arguments = ["dicom", tmp_path / "result", "--study", case.study, "--output", tmp_path / "dicom"]
    assert main([str(each) for each in arguments]) == 3
    assert "do not overlap" in capsys.readouterr().err
    for file in (tmp_path / "dicom").rglob("*.dcm"):
        assert "NOT TRUSTED" in pydicom.dcmread(file).SeriesDescription
    assert "do not overlap" in pydicom.dcmread(tmp_path / "dicom/ct/0001.dcm").ImageComments
    assert "NOT TRUSTED: The X-rays" in (tmp_path / "dicom/README.txt").read_text()


def test_doubts_about_a_bone_are_in_its_registration(tmp_path):
    from dataclasses import replace

    case = write_dicom_case(tmp_path / "case")
    doubtful = replace(case.result.structures["femur_left"], doubts=("metal hides 40% of it in X-ray 2",))
    case.result.structures["femur_left"] = doubtful
    folder = export_dicom(
        case.result, case.study, tmp_path / "dicom", leave_out=["segmentation", "deformation"]
    )
    assert not (folder / "segmentation.dcm").exists() and not (folder / "deformation.dcm").exists()
    whole = pydicom.dcmread(folder / "bones/02_femur_left.dcm")
    comment = (
        whole.RegistrationSequence[1].MatrixRegistrationSequence[0].FrameOfReferenceTransformationComment
    )
    assert comment == "doubtful: metal hides 40% of it in X-ray 2"
