"""Weights from a file: what was saved comes back, and everything else is refused in one sentence."""

import dataclasses
import io
import pickle
import zipfile

import numpy as np
import pytest
import torch
import trained_case

from PolyPoseLib.baselines.liftreg import LiftReg
from PolyPoseLib.baselines.regnet import RegNet
from PolyPoseLib.baselines.trained import trained_weights
from PolyPoseLib.baselines.trained.ct_digests import ct_digest
from PolyPoseLib.baselines.trained.trained_weights import TrainedWeights, read_weights
from PolyPoseLib.baselines.trained.training import Training, TrainingPlan
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError, InputError

PLAN = TrainingPlan(minutes=None, steps=2, batch=1, validate_every=2)


@pytest.fixture(scope="module")
def made():
    pairs = trained_case.training_set(3, 1)
    return {each.name: Training(each, pairs, PLAN).run(Monitor(None, None)) for each in (LiftReg(), RegNet())}


def saved(weights, path):
    torch.save(weights.to_fields(), path)
    return path


def fitted(path, study, system="liftreg", **setting):
    method = LiftReg() if system == "liftreg" else RegNet()
    return method.fit(study, SystemSetting(weights={system: path}, **setting))


@pytest.mark.parametrize("system", ["liftreg", "2d3d-regnet"])
def test_saved_is_loaded(made, tmp_path, system):
    path = saved(made[system], tmp_path / "weights.pt")
    read = read_weights(path, system, "train")
    assert read.report == made[system].report and read.side == trained_case.SIDE
    np.testing.assert_array_equal(read.directions, made[system].directions)
    assert read.state.keys() == made[system].state.keys()
    assert all(torch.equal(value, made[system].state[name]) for name, value in read.state.items())
    motion = fitted(path, trained_case.study(), system)
    again = fitted(path, trained_case.study(), system)
    np.testing.assert_array_equal(motion.field.vectors, again.field.vectors)
    assert (motion.field.spacing <= 4 + 1e-9).all() and len(motion.notes) == 1


def test_the_cts_of_a_training_are_known_again(made, tmp_path):
    """The phantom alone: the other postures were simulated and are nobody's CTs."""
    ct = trained_case.study().ct
    for system, weights in made.items():
        assert weights.cts == (ct_digest(ct),)
        assert read_weights(saved(weights, tmp_path / system), system, "train").cts == weights.cts


def test_scans_in_both_postures_are_recorded():
    pair = next(trained_case.pairs())
    found = TrainingSet.collected(iter([dataclasses.replace(pair, simulated=False)] * 3), (2, 1), 16)
    assert set(found.cts) == {ct_digest(pair.moving), ct_digest(pair.fixed)} and len(found.cts) == 2


@pytest.mark.parametrize("absent", [True, False], ids=["none then", "not known"])
def test_weights_of_before_are_loaded_and_say_no_cts(made, tmp_path, absent):
    old = dataclasses.replace(made["liftreg"], cts=None)
    fields = old.to_fields()
    if absent:
        del fields["settings"]["cts"]
        fields["digest"] = trained_weights._digest(fields)
    torch.save(fields, tmp_path / "weights.pt")
    assert read_weights(tmp_path / "weights.pt", "liftreg", "train").cts is None
    assert fitted(tmp_path / "weights.pt", trained_case.study()).notes


def test_the_order_of_the_xrays_does_not_matter(made, tmp_path):
    path = saved(made["2d3d-regnet"], tmp_path / "weights.pt")
    one = trained_case.study()
    images, views = [each.image for each in one.xrays], trained_case.cameras()
    other = trained_case.study(images[::-1], views[::-1])
    np.testing.assert_allclose(
        fitted(path, one, "2d3d-regnet").field.vectors,
        fitted(path, other, "2d3d-regnet").field.vectors,
        atol=1e-5,
    )


def test_missing_weights_name_the_command():
    with pytest.raises(InputError, match=r"train STUDY.json --system liftreg --output liftreg.pt"):
        LiftReg().fit(trained_case.study(), SystemSetting())


def test_cancelled(made, tmp_path):
    path = saved(made["liftreg"], tmp_path / "weights.pt")
    with pytest.raises(CancelledError):
        fitted(path, trained_case.study(), cancelled=lambda: True)


@pytest.mark.parametrize("system", ["liftreg", "2d3d-regnet"])
def test_a_gpu_that_is_not_there_is_no_crash(made, tmp_path, system, monkeypatch):
    """The row of a benchmark then says "skipped", and what to do, as for every other system."""
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    path = saved(made[system], tmp_path / "weights.pt")
    with pytest.raises(InputError, match='torch finds no CUDA device: give "cpu"'):
        fitted(path, trained_case.study(), system, device="cuda")


def test_progress_ends_at_its_end(made, tmp_path):
    path = saved(made["liftreg"], tmp_path / "weights.pt")
    seen = []
    fitted(path, trained_case.study(), progress=lambda *step: seen.append(step))
    assert seen[0][0] == 0 and seen[-1][:2] == (3, 3)


@pytest.mark.parametrize(
    ("views", "sentence"),
    [
        ((0.0,), "trained for 2 X-rays, but the study has 1"),
        ((0.0, 45.0, 90.0), "trained for 2 X-rays, but the study has 3"),
        ((0.0, 60.0), "one X-ray is 30 degrees from"),
        ((0.0, 270.0), "one X-ray is 180 degrees from"),
    ],
)
def test_other_views_are_refused(made, tmp_path, views, sentence):
    path = saved(made["liftreg"], tmp_path / "weights.pt")
    with pytest.raises(InputError, match=sentence):
        fitted(path, trained_case.study(views=trained_case.cameras(views)))


def test_views_that_are_a_little_off_are_taken(made, tmp_path):
    path = saved(made["liftreg"], tmp_path / "weights.pt")
    motion = fitted(path, trained_case.study(views=trained_case.cameras((0.3, 89.8))))
    assert np.isfinite(motion.field.vectors).all()


@pytest.mark.parametrize(
    ("angles", "shift", "beyond"), [((4.0, 90.0), 0, 52), ((0.0, 90.0), 20, 20), ((0.0, 90.0), -9, 9)]
)
def test_sources_elsewhere_are_refused(made, tmp_path, angles, shift, beyond):
    path = saved(made["liftreg"], tmp_path / "weights.pt")
    views = []
    for camera in trained_case.cameras(angles):
        extrinsic = camera.extrinsic.copy()
        extrinsic[:3, 3] -= extrinsic[:3, :3] @ np.array([0.0, 0.0, shift])
        views.append(dataclasses.replace(camera, extrinsic=extrinsic))
    with pytest.raises(InputError, match=f"one is {beyond} mm beyond those of the training"):
        fitted(path, trained_case.study(views=views))


def test_a_ct_of_another_size_is_refused(made, tmp_path):
    path = saved(made["liftreg"], tmp_path / "weights.pt")
    ct = trained_case.study().ct
    stretched = Volume(ct.voxels, np.diag([1, 1, 1.4, 1.0]) @ ct.affine)
    with pytest.raises(InputError, match="from bottom to top, but the study's CT has"):
        fitted(path, trained_case.study(ct=stretched))


def test_another_systems_weights_are_refused(made, tmp_path):
    path = saved(made["2d3d-regnet"], tmp_path / "weights.pt")
    with pytest.raises(InputError, match="are weights of 2d3d-regnet, not of liftreg"):
        fitted(path, trained_case.study())


class Code:
    """What a hostile file would run."""

    def __reduce__(self):
        return (exec, ("raise SystemExit('ran')",))


def archive_with(content):
    """A file like torch's, with other bytes in the place of the description."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("archive/data.pkl", content)
        archive.writestr("archive/version", "3\n")
    return buffer.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not weights",
        pickle.dumps(Code()),
        archive_with(pickle.dumps(Code())),
        archive_with(pickle.dumps({"format": "polypose trained system"})),
    ],
)
def test_other_files_are_refused(tmp_path, content):
    path = tmp_path / "weights.pt"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"weights\.pt: these are no weights.*--system liftreg"):
        fitted(path, trained_case.study())


def test_files_that_are_not_there_or_no_files(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        fitted(tmp_path / "absent.pt", trained_case.study())
    with pytest.raises(InputError, match="this is no file"):
        fitted(tmp_path, trained_case.study())


def test_truncated_at_any_place_is_refused(made, tmp_path):
    whole = saved(made["liftreg"], tmp_path / "whole.pt").read_bytes()
    path = tmp_path / "part.pt"
    for share in (0.1, 0.5, 0.9, 0.999):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(InputError, match="these are no weights"):
            fitted(path, trained_case.study())


def changed(weights, change):
    fields = weights.to_fields()
    change(fields)
    return fields


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda fields: fields.update(version=99), "another version"),
        (lambda fields: fields["settings"].update(side=32), "damaged or changed"),
        (lambda fields: next(iter(fields["state"].values())).reshape(-1)[:1].add_(1), "damaged or changed"),
        (lambda fields: fields.pop("state"), "damaged"),
        (lambda fields: fields.update(state=[1, 2]), "damaged"),
        (lambda fields: fields["settings"].pop("directions"), "damaged"),
        (lambda fields: fields.update(digest=None), "damaged or changed"),
    ],
)
def test_changed_weights_are_refused(made, change, sentence):
    whole = made["liftreg"]
    copy = TrainedWeights(
        whole.system,
        whole.side,
        whole.directions,
        whole.extent_mm,
        whole.sources_mm,
        {name: value.clone() for name, value in whole.state.items()},
        dict(whole.report),
    )
    with pytest.raises(InputError, match=sentence):
        TrainedWeights.from_fields(changed(copy, change))


@pytest.mark.parametrize(
    "part",
    [
        {"side": 24},
        {"directions": np.zeros((2, 3))},
        {"directions": np.ones(3)},
        {"extent_mm": np.zeros((2, 3))},
        {"extent_mm": np.ones((3, 2))},
        {"sources_mm": np.zeros((2, 1, 3))},
        {"sources_mm": np.stack([np.ones((2, 3)), np.zeros((2, 3))])},
        {"sources_mm": np.full((2, 2, 3), np.nan)},
        {"state": {"weight": torch.tensor([float("nan")])}},
        {"cts": ("HN_P001",)},
    ],
)
def test_settings_that_no_training_writes_are_refused(made, part):
    whole = made["liftreg"]
    given = {
        "side": 16,
        "directions": whole.directions,
        "extent_mm": whole.extent_mm,
        "sources_mm": whole.sources_mm,
        "state": whole.state,
        **part,
    }
    fields = TrainedWeights("liftreg", report={}, **given).to_fields()
    with pytest.raises(InputError, match="are not those of a training"):
        TrainedWeights.from_fields(fields)


def test_tensors_of_another_size_are_refused(made, tmp_path):
    whole = made["liftreg"]
    wrong = TrainedWeights("liftreg", 32, whole.directions, whole.extent_mm, whole.sources_mm, whole.state)
    with pytest.raises(InputError, match="do not fit their settings"):
        fitted(saved(wrong, tmp_path / "weights.pt"), trained_case.study())
