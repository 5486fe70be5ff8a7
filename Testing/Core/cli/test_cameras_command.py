"""The subcommand cameras writes what is sure into the study, and says what is not."""

import json

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.registration.cameras import rig_initial as rig_initial

FOUND = np.array([[1.0, 0, 0, 0], [0, 0, -1, 5], [0, 1, 0, 700], [0, 0, 0, 1]])


@pytest.fixture
def study(tmp_path):
    """Two X-rays: one with a camera, one without."""
    labels = np.zeros((10, 11, 12), np.uint8)
    labels[:5], labels[6:] = 25, 75
    hounsfield = np.where(labels > 0, 800, -1000).astype(np.int16)
    write_volume(Volume(hounsfield, np.eye(4)), tmp_path / "ct.nii.gz")
    write_volume(Volume(labels, np.eye(4)), tmp_path / "labels.nii.gz")
    rng = np.random.default_rng(0)
    xrays = []
    for name in ("ap", "side"):
        sitk.WriteImage(
            sitk.GetImageFromArray(rng.random((40, 50)).astype(np.float32)), str(tmp_path / f"{name}.nii.gz")
        )
        xrays.append({"image": f"{name}.nii.gz", "source_to_detector_mm": 1020, "pixel_spacing_mm": [1, 1]})
    xrays[0]["extrinsic"] = (np.diag([1, 1, 1, 1]) + np.pad([[800.0]], ((2, 1), (3, 0)))).tolist()
    fields = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "anchor": "pelvis", "xrays": xrays,
        "structures": {"pelvis": [25], "femur": [75]}, "comment": "stays",
    }  # fmt: skip
    path = tmp_path / "study.json"
    path.write_text(json.dumps(fields))
    return path


@pytest.fixture
def asked(monkeypatch):
    """Initial cameras that take no time; (name of the X-ray, method) of each, and whether they are sure."""
    calls = {"asked": [], "sure": True}

    def find(run, xray, method="auto", model=None):
        calls["asked"].append((xray.name, method))
        return FoundCamera(
            FOUND, calls["sure"], (2, 10), "as asked", () if calls["sure"] else ("uncertain",), 0.8, 0.3
        )

    monkeypatch.setattr(rig_initial, "initial_camera", find)
    return calls


def run(study, *more):
    return main(["cameras", str(study), "--device", "cpu", "--progress", "none", *more])


def test_only_the_missing_camera_is_found_and_written(study, asked, capsys):
    before = json.loads(study.read_text())
    assert run(study) == 0
    after = json.loads(study.read_text())
    assert asked["asked"] == [("X-ray 2", "auto")]
    np.testing.assert_array_equal(after["xrays"][1]["extrinsic"], FOUND)
    assert after["xrays"][1]["camera"] == "initial" and after["xrays"][1]["mirrored"] is False
    assert after["xrays"][0] == before["xrays"][0] and after["comment"] == "stays"
    assert "as asked" in capsys.readouterr().out
    assert run(study) == 0
    assert len(asked["asked"]) == 1


def test_again_looks_for_all_of_them(study, asked):
    assert run(study, "--again", "--method", "search") == 0
    assert asked["asked"] == [("X-ray 1", "search"), ("X-ray 2", "search")]


def test_uncertain_cameras_are_written_only_on_request(study, asked, capsys):
    asked["sure"] = False
    before = study.read_text()
    assert run(study) == 3
    assert json.loads(study.read_text()) == json.loads(before)
    assert "X-ray 2 is uncertain and was not written" in capsys.readouterr().err
    for option in ("--keep-uncertain", "--keep-doubtful"):  # the second is its earlier name
        study.write_text(before)
        assert run(study, option) == 3
        assert json.loads(study.read_text())["xrays"][1]["extrinsic"] == FOUND.tolist()


def test_another_file_in_the_same_folder(study, asked, tmp_path):
    before = study.read_text()
    assert run(study, "--output", str(study.with_name("found.json"))) == 0
    assert study.read_text() == before
    assert json.loads(study.with_name("found.json").read_text())["xrays"][1]["extrinsic"] == FOUND.tolist()
    (tmp_path / "elsewhere").mkdir()
    assert run(study, "--output", str(tmp_path / "elsewhere" / "found.json")) == 2


def test_a_method_that_does_not_apply(study, capsys):
    assert run(study, "--method", "landmarks") == 2
    assert 'no "landmarks"' in capsys.readouterr().err


def test_the_report_tells_what_was_found_and_how_sure_it_is(study, asked, tmp_path):
    asked["sure"] = False
    report = tmp_path / "found.json"
    assert run(study, "--report", str(report)) == 3
    found = json.loads(report.read_text())
    assert found["version"] == 1
    (camera,) = found["cameras"]
    assert (camera["number"], camera["name"], camera["sure"]) == (1, "X-ray 2", False)
    assert (camera["similarity"], camera["runner_up"], camera["within"]) == (0.8, 0.3, [2, 10])
    assert camera["how"] == "as asked" and camera["warnings"] == ["uncertain"] and camera["mirrored"] is False
    np.testing.assert_array_equal(camera["extrinsic"], FOUND)
    assert run(study, "--report", str(tmp_path / "nowhere" / "found.json")) == 2


@pytest.mark.parametrize(
    "report", ["nowhere/found.json", ".", "ct.nii.gz", "side.nii.gz", "study.json", "x.json"]
)
def test_a_report_that_cannot_be_written_is_refused_before_the_work(study, asked, capsys, report):
    folder = study.parent
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert run(study, "--output", str(folder / "x.json"), "--report", str(folder / report)) == 2
    assert "--report" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert not asked["asked"]


@pytest.mark.parametrize(
    "name",
    ["ct.nii.gz", "labels.nii.gz", "ap.nii.gz", "mask.nii.gz", "calibration.json", "p.h5", "dicom/1.dcm"],
)
def test_files_that_the_study_reads_are_never_replaced(study, asked, capsys, name):
    folder = study.parent
    (folder / "dicom").mkdir()
    for more in ("mask.nii.gz", "calibration.json", "p.h5", "dicom/1.dcm"):
        (folder / more).write_bytes(b"{}" if more.endswith("json") else b"\0DICM")
    fields = json.loads(study.read_text())
    fields["xrays"][0] |= {"mask": "mask.nii.gz", "calibration": "calibration.json"}
    study.write_text(json.dumps({**fields, "options": {"preview": "p.h5"}}))
    before = (folder / name).read_bytes()
    (folder / "link.json").symlink_to(folder / name)
    for path in (folder / name, folder / "link.json"):
        assert run(study, "--report", str(path)) == 2
        assert f"{path}: " in capsys.readouterr().err
    if "/" not in name:
        assert run(study, "--output", str(folder / name)) == 2
    assert (folder / name).read_bytes() == before and not asked["asked"]


def test_the_study_stays_as_it_was_when_the_report_fails_in_the_end(study, asked, monkeypatch):
    written = type(study).write_text

    def full(self, *text, **more):
        if "found" in self.name:
            raise OSError(28, "No space left on device")
        return written(self, *text, **more)

    before = study.read_text()
    monkeypatch.setattr(type(study), "write_text", full)
    assert run(study, "--report", str(study.with_name("found.json"))) == 2
    assert asked["asked"] and study.read_text() == before


def test_an_earlier_report_and_an_empty_file_are_replaced(study, asked):
    for name, text in (("found.json", '\ufeff\n {"version": 0}'), ("empty.json", "")):
        report = study.with_name(name)
        report.write_text(text, encoding="utf-8")
        assert run(study, "--again", "--report", str(report)) == 0
        assert json.loads(report.read_text())["version"] == 1
