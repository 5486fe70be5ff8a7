"""A model file holds a model for one CT and nothing that runs; everything else is refused in one sentence."""

import pickle
from dataclasses import replace

import learned_phantom
import numpy as np
import pytest
import torch

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.camera_models import load_model, load_regressor, save_model
from PolyPoseLib.learned.camera_model import CameraModel, ct_fingerprint
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.network import Architecture, CameraNetwork
from PolyPoseLib.learned.regress import CameraRegressor
from PolyPoseLib.learned.view_range import ViewRange

pytest.importorskip("monai", reason="learned cameras need MONAI")

SIZES = Architecture(2, (1, 1, 1, 1), (4, 4, 8, 8))


@pytest.fixture
def model():
    torch.manual_seed(0)
    fingerprint = ct_fingerprint(*learned_phantom.phantom(), learned_phantom.ANCHOR)
    state = CameraNetwork(SIZES).state_dict()
    views = ViewRange(("AP", "LL"), 735.0)
    return CameraModel(fingerprint, views, VirtualDetector(48, 0.15), SIZES, state, 7.5)


@pytest.fixture
def path(model, tmp_path):
    save_model(model, tmp_path / "model.pt")
    return tmp_path / "model.pt"


def test_round_trip(model, path):
    read = load_model(path)
    assert replace(read, state={}) == replace(model, state={})
    assert read.state.keys() == model.state.keys()
    assert all(torch.equal(read.state[name], model.state[name]) for name in model.state)
    assert [each.name for each in path.parent.iterdir()] == ["model.pt"]


def test_predictions_survive_the_file(model, path):
    ct, structures = learned_phantom.phantom()
    xray = learned_phantom.xray("LL", np.random.default_rng(0).random((60, 60)).astype(np.float32))
    loaded = load_regressor(path, ct, structures, learned_phantom.ANCHOR)
    direct = CameraRegressor(model, loaded.centre.numpy())
    first, second = (each.starts(xray) for each in (loaded, direct))
    assert len(first) > 5
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(one.extrinsic, other.extrinsic, atol=1e-9)


def test_only_trained_views_are_predicted(path):
    regressor = load_regressor(path, *learned_phantom.phantom(), learned_phantom.ANCHOR)
    assert regressor.covers(learned_phantom.xray("AP"))
    assert not regressor.covers(learned_phantom.xray("PA"))
    assert not regressor.covers(learned_phantom.xray(None))
    with pytest.raises(InputError, match="PA is not one of"):
        regressor.predict(learned_phantom.xray("PA"))
    assert len(regressor.predict(learned_phantom.xray(None))) == 2


@pytest.mark.parametrize("change", ["voxel", "affine", "anchor", "mask"])
def test_another_ct_is_refused(path, change):
    ct, structures = learned_phantom.phantom()
    anchor = learned_phantom.ANCHOR
    if change == "voxel":
        voxels = ct.voxels.copy()
        voxels[3, 4, 5] += 1
        ct = Volume(voxels, ct.affine)
    elif change == "affine":
        affine = ct.affine.copy()
        affine[0, 3] += 0.5
        ct = Volume(ct.voxels, affine)
    elif change == "anchor":
        anchor = "femur"
    else:
        labels = structures.labels.copy()
        labels[tuple(np.argwhere(labels == 1)[0])] = 0
        structures = Structures(structures.names, labels)
    with pytest.raises(InputError, match="another CT"):
        load_regressor(path, ct, structures, anchor)


def test_tampered_files_are_refused(model, path):
    fields = torch.load(path, weights_only=True)
    name = next(each for each, value in fields["state"].items() if value.is_floating_point())
    fields["state"][name].view(-1)[0] += 1
    torch.save(fields, path)
    with pytest.raises(InputError, match="was changed"):
        load_model(path)
    fields["validation_mm"] = 0.1
    torch.save(fields, path)
    with pytest.raises(InputError, match="was changed"):
        load_model(path)


@pytest.mark.parametrize("kept", [0, 1, 100, 2000])
def test_truncated_files_are_refused(path, kept):
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(InputError, match="no camera model"):
        load_model(path)


class Hostile:
    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return open, (str(self.mark), "w")


@pytest.mark.parametrize("how", ["torch", "pickle", "state"])
def test_code_in_a_file_never_runs(path, tmp_path, how):
    mark = tmp_path / "executed"
    if how == "torch":
        torch.save(Hostile(mark), path)
    elif how == "pickle":
        path.write_bytes(pickle.dumps(Hostile(mark)))
    else:
        fields = torch.load(path, weights_only=True)
        torch.save({**fields, "state": Hostile(mark)}, path)
    with pytest.raises(InputError, match="no camera model"):
        load_model(path)
    assert not mark.exists()


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"format": "polypose camera model", "version": 99},
        {"format": "polypose camera model", "version": 1},
        [1, 2],
    ],
)
def test_other_files_are_refused(tmp_path, fields):
    torch.save(fields, tmp_path / "other.pt")
    with pytest.raises(InputError):
        load_model(tmp_path / "other.pt")
    with pytest.raises(InputError, match="no such file"):
        load_model(tmp_path / "absent.pt")


def test_a_state_that_does_not_fit_is_refused(model, tmp_path):
    save_model(replace(model, architecture=replace(SIZES, channels=(4, 4, 8, 16))), tmp_path / "odd.pt")
    with pytest.raises(InputError, match="does not fit"):
        load_model(tmp_path / "odd.pt").network()


@pytest.mark.parametrize(
    "change",
    [
        {"format": torch.tensor([1, 2])},
        {"version": torch.tensor([1, 2])},
        {"version": True},
        {"version": 10**5000},
        {"validation_mm": torch.ones(2)},
        {"state": {"w": torch.nn.Parameter(torch.ones(2))}},
        {"state": {"w": torch.ones(2, dtype=torch.bfloat16)}},
        {"state": {"w": torch.eye(2).to_sparse()}},
        {"state": {"w": torch.empty(2, device="meta")}},
        {"state": {"w": 1.0}},
        {"state": [torch.ones(2)]},
        {"views": {"views": ["AP"]}, "validation_mm": 10**400},
    ],
)
def test_values_of_another_kind_are_refused(path, change):
    fields = torch.load(path, weights_only=True)
    torch.save({**fields, **change}, path)
    with pytest.raises(InputError, match=r"model\.pt: ") as caught:
        load_model(path)
    assert "\n" not in str(caught.value)
