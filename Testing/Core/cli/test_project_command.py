"""polypose project: pictures, DICOM captures of the same study, and one sentence for what cannot be drawn."""

import dataclasses
import json
import shutil
import subprocess

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from report_case import seen_result
from tiny_case import tiny_case

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.result import CameraResult
from PolyPoseLib.io.cases import write_case


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """The folder of a small case whose X-rays are DICOM, and of a result as if of it."""
    folder = tmp_path_factory.mktemp("project")
    tiny = tiny_case()
    write_case(tiny, folder / "case", options={})
    for path in (folder / "case").glob("*.dcm"):
        dataset = pydicom.dcmread(path)
        dataset.PatientID, dataset.PatientName, dataset.BodyPartExamined = "P-17", "Doe^Jane", "PELVIS"
        dataset.save_as(path)
    study = json.loads((folder / "case" / "study.json").read_text())
    study["structures"]["femur"] = study["structures"].pop("femur_left")
    (folder / "case" / "study.json").write_text(json.dumps(study))
    result = seen_result(0)
    views = zip(tiny.cameras, result.cameras, strict=True)
    result.cameras = [CameraResult(camera, each.similarity, each.name) for camera, each in views]
    for name in ("renderings_before", "renderings_after", "xray_images"):
        setattr(result, name, [np.asarray(each, np.float32) for each in tiny.images])
    result.save(folder / "result")
    centre = result.structures["femur"].centroid
    (folder / "plan.csv").write_text("label,x,y,z\n<b>tip</b>,{},{},{}\n".format(*centre))
    return folder


def run(case, capsys, *arguments):
    status = main(["project", str(case / "result"), *map(str, arguments)])
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return status, out, err


def test_captures_belong_to_the_xrays_study_and_name_the_xray(case, tmp_path, capsys):
    out = tmp_path / "drawn"
    arguments = (case / "plan.csv", "--output", out, "--study", case / "case" / "study.json", "--quiet")
    status, said, _ = run(case, capsys, *arguments)
    assert status == 0 and "xray_1.dcm" in said and "Doe" not in said
    assert {each.name for each in out.iterdir()} == {
        "points.csv", "xray_0.png", "xray_0.dcm", "xray_1.png", "xray_1.dcm",
    }  # fmt: skip
    sources = [pydicom.dcmread(each) for each in sorted((case / "case").glob("*.dcm"))]
    captures = [pydicom.dcmread(out / f"xray_{n}.dcm") for n in range(2)]
    for n, (made, source) in enumerate(zip(captures, sources, strict=True)):
        assert made.SOPClassUID == "1.2.840.10008.5.1.4.1.1.7"
        for keyword in ("PatientID", "PatientName", "StudyInstanceUID"):
            assert made[keyword].value == source[keyword].value
        assert made.SourceImageSequence[0].ReferencedSOPInstanceUID == source.SOPInstanceUID
        assert (
            made.SOPInstanceUID != source.SOPInstanceUID
            and made.SeriesInstanceUID != source.SeriesInstanceUID
        )
        picture = sitk.GetArrayFromImage(sitk.ReadImage(str(out / f"xray_{n}.png")))
        assert np.array_equal(made.pixel_array, picture)
        if shutil.which("dciodvfy"):
            done = subprocess.run(["dciodvfy", out / f"xray_{n}.dcm"], capture_output=True, text=True)
            assert "Error" not in done.stdout + done.stderr
    assert captures[0].SOPInstanceUID != captures[1].SOPInstanceUID


def test_without_the_study_there_are_pictures_alone(case, tmp_path, capsys):
    status, _, _ = run(case, capsys, case / "plan.csv", "--output", tmp_path / "drawn")
    assert status == 0
    assert {each.name for each in (tmp_path / "drawn").iterdir()} == {
        "points.csv",
        "xray_0.png",
        "xray_1.png",
    }


def test_what_is_wrong_is_one_sentence_and_nothing_is_written(case, tmp_path, capsys):
    (tmp_path / "plan.txt").write_text("x")
    (tmp_path / "bad.csv").write_text("label,x,y\n1,2,3\n")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.doc").write_text("x")
    (tmp_path / "empty.stl").write_bytes(b"\0" * 84)
    out = tmp_path / "drawn"
    for arguments, words in (
        ((tmp_path / "absent.csv", "--output", out), "absent.csv: there is no such file"),
        ((tmp_path / "plan.txt", "--output", out), "plan.txt: this kind of file is no plan"),
        ((tmp_path / "bad.csv", "--output", out), 'no column "z"'),
        ((tmp_path / "empty.stl", "--output", out), "empty.stl: the mesh is damaged"),
        ((case / "plan.csv", "--output", tmp_path / "full"), "thesis.doc"),
        ((case / "plan.csv", "--output", out, "--study", tmp_path / "no.json"), "no.json"),
    ):
        status, _, err = run(case, capsys, *arguments)
        assert status == 2 and words in err and err.count("\n") == 1, err
        assert not out.exists()


def test_an_earlier_result_asks_for_its_study_and_takes_no_other(case, tmp_path, capsys):
    shutil.copytree(case / "result", tmp_path / "result")
    for n in range(2):
        (tmp_path / "result" / f"xray_{n}.nii.gz").unlink()
    earlier = [
        "project",
        str(tmp_path / "result"),
        str(case / "plan.csv"),
        "--output",
        str(tmp_path / "drawn"),
        "--quiet",
    ]
    assert main(earlier) == 2
    assert "add --study" in capsys.readouterr().err
    assert main([*earlier, "--study", str(case / "case" / "study.json")]) == 0
    capsys.readouterr()
    other = seen_result(0)
    other.cameras = [dataclasses.replace(each) for each in other.cameras]
    other.save(tmp_path / "other")
    wrong = [
        "project",
        str(tmp_path / "other"),
        str(case / "plan.csv"),
        "--output",
        str(tmp_path / "new"),
        "--quiet",
    ]
    assert main([*wrong, "--study", str(case / "case" / "study.json")]) == 2
    assert "give the study that was registered" in capsys.readouterr().err


def test_a_mirrored_xray_is_drawn_as_its_file_has_it(case, tmp_path):
    from PolyPoseLib.io.projected.folder import ShownXray, write_projections
    from PolyPoseLib.io.projected.plan import read_plan
    from PolyPoseLib.io.results import load_result

    result = load_result(case / "result")
    parts = read_plan(result, case / "plan.csv")
    columns = []
    for mirrored in (False, True):
        folder = tmp_path / str(mirrored)
        folder.mkdir()
        shown = [ShownXray(result.cameras[0], result.xray_images[0], mirrored)]
        said = write_projections(result, parts, shown, folder)
        assert any("mirrored" in each for each in said) == mirrored
        columns.append(float((folder / "points.csv").read_text().splitlines()[1].split(",")[2]))
    assert columns[0] + columns[1] == pytest.approx(59, abs=2e-3)


def test_a_result_that_must_not_be_trusted_is_drawn_and_ends_with_status_3(case, tmp_path, capsys):
    result = seen_result(0)
    result.distrust = ("the similarity did not rise.",)
    result.save(tmp_path / "result")
    plan = str(case / "plan.csv")
    status = main(["project", str(tmp_path / "result"), plan, "--output", str(tmp_path / "drawn")])
    assert status == 3 and "must not be trusted: the similarity did not rise." in capsys.readouterr().err
    pictures = [
        sitk.GetArrayFromImage(sitk.ReadImage(str(folder / "xray_0.png"))).astype(int)
        for folder in (tmp_path / "drawn", _drawn(case, tmp_path))
    ]
    red = [(each[..., 0] - each[..., 1] > 80).sum() for each in pictures]
    assert red[0] > 100 and red[1] == 0


def _drawn(case, tmp_path):
    """The same with a result that is trusted."""
    seen_result(0).save(tmp_path / "trusted")
    arguments = ["project", tmp_path / "trusted", case / "plan.csv", "--output", tmp_path / "plain"]
    assert main([str(each) for each in arguments]) == 0
    return tmp_path / "plain"


def test_a_study_of_other_pictures_or_in_another_order_is_refused(case, tmp_path, capsys):
    plan, out = case / "plan.csv", tmp_path / "drawn"
    shutil.copytree(case / "case", tmp_path / "case")
    path = tmp_path / "case" / "study.json"
    study = json.loads(path.read_text())
    study["xrays"].reverse()
    path.write_text(json.dumps(study))
    status, _, err = run(case, capsys, plan, "--output", out, "--study", path, "--quiet")
    assert status == 2 and "same order" in err and err.count("\n") == 1 and not out.exists()
    study["xrays"].reverse()
    study["anchor"] = "femur"
    path.write_text(json.dumps(study))
    status, _, err = run(case, capsys, plan, "--output", out, "--study", path, "--quiet")
    assert status == 2 and "another study" in err and err.count("\n") == 1 and not out.exists()


def test_a_folder_with_a_result_is_refused_without_an_option_that_there_is_not(case, capsys):
    status, _, err = run(case, capsys, case / "plan.csv", "--output", case / "result", "--quiet")
    assert status == 2 and "already holds a result" in err and "--overwrite" not in err
