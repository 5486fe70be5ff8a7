"""The subcommand train with --system, from files to files."""

import json
from dataclasses import replace

import numpy as np
import pytest
import SimpleITK as sitk
import trained_case

from PolyPoseLib.__main__ import main
from PolyPoseLib.baselines.liftreg import LiftReg
from PolyPoseLib.baselines.trained import training, training_pairs
from PolyPoseLib.baselines.trained.ct_digests import ct_digest
from PolyPoseLib.baselines.trained.trained_weights import read_weights
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.cli import _train_pairs
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.simulation import independent_projector


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Two pairs held out, three steps, and the projector that needs no import of seconds."""
    plan = training.TrainingPlan
    monkeypatch.setattr(training, "TrainingPlan", lambda **given: plan(**{**given, "steps": 2, "batch": 1}))
    monkeypatch.setattr(_train_pairs, "HELD_OUT", 2)
    monkeypatch.setattr(independent_projector, "rtk_available", lambda: False)


def write_study(folder):
    folder.mkdir(exist_ok=True)
    study = trained_case.study()
    write_volume(Volume(study.ct.voxels.astype(np.int16), study.ct.affine), folder / "ct.nii.gz")
    write_volume(Volume(study.structures.labels.astype(np.uint8), study.ct.affine), folder / "labels.nii.gz")
    xrays = []
    for number, xray in enumerate(study.xrays):
        sitk.WriteImage(sitk.GetImageFromArray(xray.image), str(folder / f"{number}.nii.gz"))
        xrays.append({
            "image": f"{number}.nii.gz",
            "source_to_detector_mm": 1020.0,
            "pixel_spacing_mm": [430 / 48, 430 / 48],
            "extrinsic": xray.extrinsic.tolist(),
            "camera": "known",
        })  # fmt: skip
    fields = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "anchor": "pelvis", "xrays": xrays,
        "structures": {"pelvis": [1], "femur": [2]},
    }  # fmt: skip
    path = folder / "study.json"
    path.write_text(json.dumps(fields))
    return path


@pytest.fixture
def study(tmp_path):
    return write_study(tmp_path / "case")


def run(*arguments):
    return main(["train", *map(str, arguments), "--device", "cpu", "--threads", "1", "--progress", "none"])


def train(study, output, *more, system="liftreg"):
    return run(study, "--system", system, "--output", output, "--side", 16, "--pairs", 2, *more)


def test_the_weights_fit_the_study(study, tmp_path, capsys):
    path = tmp_path / "weights.pt"
    status = train(study, path)
    weights = read_weights(path, "liftreg", "train")
    untrained = weights.report["curve"][0]["held_out_mm"]
    better = weights.report["held_out_mm"] < 0.98 * min(weights.report["rest_mm"], untrained)
    assert status == (0 if better else 3)
    assert path.with_name("weights.pt.checkpoint").exists() == (not better)
    said = capsys.readouterr()
    assert ("not better by 2 % than doing nothing" in said.err) == (not better)
    assert "after 2 steps" in said.out
    motion = LiftReg().fit(Study.load(study), SystemSetting(weights={"liftreg": path}))
    assert motion.field.spacing.max() <= 4


@pytest.mark.parametrize(
    ("looks", "status"),
    [((1.2, 0.9, 1.1), 0), ((1.2, 1 - 1e-4, 1.1), 3), ((1.2, 1.0, 1.1), 3), ((0.9, 0.95, 0.895), 3)],
    ids=["a gain", "microns", "none", "a lucky start"],
)
def test_a_gain_by_luck_is_none(study, tmp_path, monkeypatch, capsys, looks, status):
    """The best of many looks of a network that has learned nothing is a little better than doing nothing."""
    left, share = iter(looks), min(looks)
    monkeypatch.setattr(training_pairs.PreparedPair, "error_mm", lambda pair, _: factor[0] * pair.rest_mm)
    factor = [1.0]
    validate = training.Training._validate

    def look(self, *given):
        factor[0] = next(left)
        validate(self, *given)

    monkeypatch.setattr(training.Training, "_validate", look)
    plan = training.TrainingPlan  # of the fixture
    monkeypatch.setattr(training, "TrainingPlan", lambda **given: replace(plan(**given), validate_every=1))
    path = tmp_path / "weights.pt"
    assert train(study, path) == status
    report = read_weights(path, "liftreg", "train").report
    assert report["held_out_mm"] == pytest.approx(share * report["rest_mm"]) and len(report["curve"]) == 3
    assert ("not better by 2 %" in capsys.readouterr().err) == (status == 3)


def write_later(study, *names):
    """Other CTs of a study's patient beside it."""
    ct = Study.load(study).ct
    for number, name in enumerate(names):
        noise = np.random.default_rng([number, *name.encode(), *study.parent.name.encode()]).normal(
            0, 5, ct.shape
        )
        moved = np.roll(ct.voxels, 1 + number, axis=1) + noise
        write_volume(Volume(moved.astype(np.int16), ct.affine), study.parent / name)


def train_on_cts(output, *studies):
    """The exit status, and the CTs of the held-out and of the training pairs, in turn by an honest collection."""
    found = {}
    honest = TrainingSet.collected

    def collected(pairs, counts, *more):
        listed = list(pairs)
        digests = [{ct_digest(pair.moving), ct_digest(pair.fixed)} for pair in listed]
        found["held out"], found["training"] = digests[: counts[1]], digests[counts[1] :]
        assert len(found["training"]) == counts[0]
        return honest(iter(listed), counts, *more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TrainingSet, "collected", collected)
        status = run(
            *studies, "--system", "liftreg", "--output", output, "--side", 16, "--other-cts", "later*"
        )
    return status, found


def test_of_several_patients_whole_ones_are_held_out(study, tmp_path):
    other = write_study(tmp_path / "other")
    for each in (study, other):
        ct = Study.load(each).ct
        noise = np.random.default_rng(len(each.parent.name)).normal(0, 5, ct.shape)
        write_volume(Volume((ct.voxels + noise).astype(np.int16), ct.affine), each.parent / "ct.nii.gz")
        write_later(each, "later.nii.gz")
    path = tmp_path / "weights.pt"
    status, found = train_on_cts(path, study, other)
    assert status in (0, 3)
    report = read_weights(path, "liftreg", "train").report
    assert (report["pairs"], report["held_out_pairs"]) == (2, 2)
    assert set.union(*found["held out"]).isdisjoint(set.union(*found["training"]))


@pytest.mark.parametrize("count", [3, 4])
def test_of_one_patient_cts_are_held_out_where_there_are_four(study, tmp_path, capsys, count):
    """The last pairs were held out, whose CTs, and the same pair the other way round, were learned from."""
    write_later(study, *(f"later-{number}.nii.gz" for number in range(count - 1)))
    status, found = train_on_cts(tmp_path / "weights.pt", study)
    assert status in (0, 3) and len(found["held out"]) == 2
    assert len(found["training"]) == (2 if count == 4 else 4)
    shared = set.union(*found["held out"]) & set.union(*found["training"])
    assert bool(shared) == (count == 3) == ("share their CTs" in capsys.readouterr().err)
    assert found["held out"][0] not in found["training"]  # in neither direction


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (("--side", 20), "--side is 20: give a multiple of 16"),
        (("--pairs", 1), "--pairs is 1: give a number from 2"),
        (("--motion-scale", "nan"), "--motion-scale is nan"),
        (("--other-cts", "../*.nii.gz"), "--other-cts is '../*.nii.gz': give a pattern of file names"),
        (("--other-cts", ".."), "--other-cts is '..'"),
        (("--other-cts", "absent*"), "0 files are called absent*"),
        (("--other-cts", "ct.nii.gz"), "There are 0 pairs of CTs"),
        (("--resume",), "there is no checkpoint to continue from"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_written(study, tmp_path, capsys, more, sentence):
    before = sorted(tmp_path.rglob("*"))
    assert train(study, tmp_path / "weights.pt", *more) == 2
    assert sentence in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_cameras_are_trained_for_one_study(study, tmp_path, capsys):
    assert run(study, study, "--output", tmp_path / "model.pt") == 2
    assert "Cameras are trained for one study" in capsys.readouterr().err
    assert run(study, "--output", tmp_path / "model.pt", "--other-cts", "x*") == 2
    assert "--other-cts goes with" in capsys.readouterr().err


def test_an_xray_without_a_camera_is_refused(study, tmp_path, capsys):
    fields = json.loads(study.read_text())
    del fields["xrays"][1]["extrinsic"], fields["xrays"][1]["camera"]
    study.write_text(json.dumps(fields))
    assert train(study, tmp_path / "weights.pt") == 2
    assert "has no camera, and trained systems find none" in capsys.readouterr().err


def test_a_training_goes_on_from_its_checkpoint(study, tmp_path, monkeypatch):
    path = tmp_path / "weights.pt"

    def stop(self, *_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(training.Training, "_step", stop)
        assert train(study, path) == 130
    assert not path.exists() and path.with_name("weights.pt.checkpoint").exists()
    assert train(study, path, "--resume") in (0, 3)
    resumed = read_weights(path, "liftreg", "train")
    whole = tmp_path / "whole.pt"
    assert train(study, whole) in (0, 3)
    for name, value in read_weights(whole, "liftreg", "train").state.items():
        assert (value == resumed.state[name]).all()
