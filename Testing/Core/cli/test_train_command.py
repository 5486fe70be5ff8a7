"""The subcommand train, and cameras with --method learned, from files to files."""

import dataclasses
import json
import sys

import learned_phantom
import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.camera_models import load_model
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.learned import training
from PolyPoseLib.learned.camera_model import USABLE_MM
from PolyPoseLib.learned.regress import CameraRegressor
from PolyPoseLib.registration.cameras import initial as initial

pytest.importorskip("monai", reason="learned cameras need MONAI")


def write_study(folder):
    """One AP X-ray without a camera."""
    ct, structures = learned_phantom.phantom()
    write_volume(Volume(ct.voxels.astype(np.int16), ct.affine), folder / "ct.nii.gz")
    write_volume(Volume(structures.labels.astype(np.uint8), ct.affine), folder / "labels.nii.gz")
    pixels = np.random.default_rng(0).random((60, 60)).astype(np.float32)
    sitk.WriteImage(sitk.GetImageFromArray(pixels), str(folder / "ap.nii.gz"))
    xray = {
        "image": "ap.nii.gz",
        "source_to_detector_mm": 1000,
        "pixel_spacing_mm": [5, 5],
        "standard_view": "AP",
    }
    fields = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "anchor": "pelvis", "xrays": [xray],
        "structures": {"pelvis": [1], "femur": [2]},
    }  # fmt: skip
    path = folder / "study.json"
    path.write_text(json.dumps(fields))
    return path


@pytest.fixture
def study(tmp_path):
    return write_study(tmp_path)


@pytest.fixture(autouse=True, scope="module")
def small():
    """A network that trains in seconds, whatever the plan."""
    plan = training.TrainingPlan

    def tiny(**given):
        sizes = {
            "side": 32,
            "channels": (4, 4, 8, 8),
            "size_mm": 12.0,
            "renderings": 4,
            "validation_batches": 1,
            "validate_every": 5,
        }
        return plan(**{**given, **sizes})

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "TrainingPlan", tiny)
        yield


@pytest.fixture(scope="module")
def trained(small, tmp_path_factory):
    """A model that the subcommand trained far too little, and what the folder holds afterwards."""
    study = write_study(tmp_path_factory.mktemp("trained"))
    path = study.with_name("model.pt")
    assert run("train", study, "--output", str(path), "--minutes", "0.02") == 3
    return path, sorted(each.name for each in study.parent.iterdir())


@pytest.fixture
def model(study, trained):
    path = study.with_name("model.pt")
    path.write_bytes(trained[0].read_bytes())
    return path


def run(command, study, *more):
    return main([command, str(study), "--device", "cpu", "--threads", "1", "--progress", "none", *more])


def test_train_writes_a_model_of_the_studys_views(trained):
    path, files = trained
    read = load_model(path)
    assert read.views.views == ("AP",) and read.detector.half_tangent == pytest.approx(0.15)
    assert files == [
        "ap.nii.gz",
        "ct.nii.gz",
        "labels.nii.gz",
        "model.pt",
        "model.pt.checkpoint",
        "study.json",
    ]


@pytest.mark.parametrize(("error_mm", "status"), [(USABLE_MM, 0), (USABLE_MM + 1, 3), (88.0, 3)])
def test_a_model_that_is_far_off_is_written_but_not_trusted(study, monkeypatch, capsys, error_mm, status):
    def validated(trainer):
        trainer.last_mm = error_mm
        return error_mm

    monkeypatch.setattr(training.Trainer, "validation_mm", validated)
    path = study.with_name("model.pt")
    assert run("train", study, "--output", str(path), "--minutes", "0.001") == status
    assert load_model(path).validation_mm == error_mm
    said = capsys.readouterr()
    assert f"{error_mm:.1f} mm" in said.out
    assert (f"median error on renderings that it was not trained on is {error_mm:.0f} mm" in said.err) == (
        status == 3
    )
    assert ("--resume" in said.err) == path.with_name("model.pt.checkpoint").exists() == (status == 3)


def test_resuming_a_model_that_is_far_off_makes_it_better(study, monkeypatch, capsys):
    errors = [88.0]

    def validated(trainer):
        trainer.last_mm = errors[0]
        return trainer.last_mm

    monkeypatch.setattr(training.Trainer, "validation_mm", validated)
    path = study.with_name("model.pt")
    assert run("train", study, "--output", str(path), "--minutes", "0.001") == 3
    errors[0] = 9.0
    assert run("train", study, "--output", str(path), "--minutes", "0.5", "--resume") == 0
    assert load_model(path).validation_mm == 9.0
    assert not path.with_name("model.pt.checkpoint").exists()


def test_cameras_by_a_model_that_is_far_off_come_with_a_warning(study, model, monkeypatch):
    ct, structures = learned_phantom.phantom()
    weak = load_model(model)
    (warning,) = CameraRegressor.of(weak, ct, structures, "pelvis").warnings
    assert warning.startswith("The camera model was trained too little")
    good = dataclasses.replace(weak, validation_mm=USABLE_MM)
    assert CameraRegressor.of(good, ct, structures, "pelvis").warnings == ()


def test_train_refuses_what_could_not_be_written(study, model, capsys):
    for more, reason in (
        (("--output", str(model)), "exists"),
        (("--output", str(study.parent)), "is a folder"),
        (("--output", str(study.parent / "absent" / "model.pt")), "no such folder"),
        (("--output", str(study.with_name("new.pt")), "--minutes", "0"), "--minutes"),
        (("--output", str(study.with_name("new.pt")), "--minutes", "nan"), "--minutes"),
        (("--output", str(study.with_name("new.pt")), "--resume"), "no checkpoint"),
    ):
        assert run("train", study, *more) == 2
        assert reason in capsys.readouterr().err


@pytest.fixture
def refined(monkeypatch):
    """The models that were asked, with refinement left out."""
    asked = []

    def learned(run, xray, model):
        asked.append(model.model.validation_mm)
        return FoundCamera(model.predict(xray)[0].extrinsic, True, (2, 10), model.how, (), 0.8, 0.2)

    monkeypatch.setattr(initial, "learned_camera", learned)
    return asked


def test_cameras_by_a_model(study, model, refined, capsys):
    assert run("cameras", study, "--method", "learned", "--model", str(model)) == 0
    assert "learned" in capsys.readouterr().out and len(refined) == 1
    extrinsic = np.array(json.loads(study.read_text())["xrays"][0]["extrinsic"])
    np.testing.assert_allclose(extrinsic[:3, :3] @ extrinsic[:3, :3].T, np.eye(3), atol=1e-9)


def test_auto_takes_a_model_only_when_it_is_given(study, model, refined, monkeypatch):
    searched = []

    def search(run, xray):
        searched.append(xray.name)
        return FoundCamera(np.eye(4), True, (2, 10), "searched")

    monkeypatch.setattr(initial, "searched_camera", search)
    assert run("cameras", study) == 0
    assert (len(searched), len(refined)) == (1, 0)
    fields = json.loads(study.read_text())
    del fields["xrays"][0]["extrinsic"], fields["xrays"][0]["camera"]
    fields["options"] = {"camera_model": "model.pt"}
    study.write_text(json.dumps(fields))
    assert run("cameras", study) == 0
    assert (len(searched), len(refined)) == (1, 1)


def test_a_model_outside_the_folder_or_absent_is_refused(study, model, capsys):
    fields = json.loads(study.read_text())
    for name, reason in (("../model.pt", "outside"), ("absent.pt", "no such file")):
        study.write_text(json.dumps({**fields, "options": {"camera_model": name}}))
        assert run("cameras", study) == 2
        said = capsys.readouterr().err
        assert reason in said and "camera_model" in said


def test_another_ct_is_refused(study, model, capsys):
    ct, _ = learned_phantom.phantom()
    write_volume(Volume(ct.voxels.astype(np.int16) + 1, ct.affine), study.with_name("ct.nii.gz"))
    assert run("cameras", study, "--method", "learned", "--model", str(model)) == 2
    assert "another CT" in capsys.readouterr().err


def test_no_model_and_no_monai(study, capsys, monkeypatch):
    assert run("cameras", study, "--method", "learned") == 2
    assert "--model" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "monai.networks.nets.resnet", None)
    assert run("train", study, "--output", str(study.with_name("model.pt"))) == 2
    assert "pip install monai" in capsys.readouterr().err
