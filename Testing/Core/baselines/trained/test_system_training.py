"""Training: the loss falls, an interrupted training that is resumed ends where an uninterrupted one does."""

from dataclasses import replace

import learned_phantom
import numpy as np
import pytest
import torch
import trained_case

from PolyPoseLib.baselines.liftreg import LiftReg, LiftRegNetwork
from PolyPoseLib.baselines.regnet import RegNet, RegNetwork
from PolyPoseLib.baselines.trained.ct_pairs import ct_pairs, demons_field
from PolyPoseLib.baselines.trained.input_scale import InputScale
from PolyPoseLib.baselines.trained.training import Training, TrainingPlan
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.io.camera_models import read_tensors, write_tensors
from PolyPoseLib.simulation.motion import apply
from PolyPoseLib.simulation.simulate import SimulationOptions
from PolyPoseLib.warp.dense import warp_volume

SYSTEMS = (LiftReg(), pytest.param(RegNet(), marks=pytest.mark.long))
"""Steps of the U-Net take ten times as long; its answers and its loss are tested by default all the same."""
PLAN = TrainingPlan(minutes=None, steps=4, batch=1, validate_every=2)


@pytest.fixture(scope="module")
def pairs():
    return trained_case.training_set(4, 2)


def run(method, pairs, plan=PLAN, monitor=None, checkpoint=None, resume=False):
    keep = None if checkpoint is None else lambda fields: write_tensors(fields, checkpoint)
    earlier = read_tensors(checkpoint, "checkpoint") if resume and checkpoint else None
    return Training(method, pairs, plan, keep).run(monitor or Monitor(None, None), earlier)


def inputs(views, side):
    return InputScale(torch.zeros(1).expand(views, side, side, side), torch.tensor(1.0))


def test_the_published_sizes():
    """4000 values leave the encoder of a grid of 160 nodes; the decoder doubles up to the full grid."""
    network = LiftRegNetwork(inputs(4, 160), torch.zeros(1), torch.zeros(56, 1))
    dense = [layer for layer in network.dense.modules() if isinstance(layer, torch.nn.Linear)]
    assert [(layer.in_features, layer.out_features) for layer in dense] == [
        (4000, 800),
        (800, 256),
        (256, 56),
    ]
    convolutions = [layer for layer in network.encoder.modules() if isinstance(layer, torch.nn.Conv3d)]
    assert [layer.out_channels for layer in convolutions] == [16, 32, 32, 32, 32, 32]
    assert [layer.stride[0] for layer in convolutions] == [1, 2, 2, 2, 2, 2]
    unet = RegNetwork(inputs(3, 16))
    decoder = [layer for layer in unet.decoder.modules() if isinstance(layer, torch.nn.Conv3d)]
    assert [layer.out_channels for layer in decoder] == [32, 32, 32, 32, 16, 16]
    assert unet(torch.zeros(1, 1, 16, 16, 16), torch.zeros(1, 3, 16, 16, 16)).shape == (1, 3, 16, 16, 16)


def test_an_untrained_network_tells_one_xray_from_another(pairs):
    """With X-rays as they come, coefficients differed by 2e-4 standard deviations: the network learned nothing."""
    torch.manual_seed(0)
    network = LiftReg().new_network(pairs, PLAN)
    with torch.no_grad():
        found = torch.cat(
            [network.coefficients(p.moving[None].float(), p.lifted[None].float()) for p in pairs.training]
        )
    assert found.std(dim=0).mean() > 0.02


@pytest.mark.parametrize("method", SYSTEMS, ids=("liftreg", "2d3d-regnet"))
def test_the_loss_falls(pairs, method):
    weights = run(method, pairs, replace(PLAN, steps=16, validate_every=16, learning_rate=2e-3))
    first, last = weights.report["curve"][0], weights.report["curve"][-1]
    untrained = np.mean([  # of the training pairs, before any step
        float(method.loss(torch.zeros(1, 3, 16, 16, 16), pair, PLAN)) for pair in pairs.training
    ])  # fmt: skip
    assert last["loss"] < untrained and last["step"] == 16 and first["step"] == 0


@pytest.mark.parametrize("method", (LiftReg(), RegNet()), ids=("liftreg", "2d3d-regnet"))
def test_the_true_motion_has_a_smaller_loss_than_rest(pairs, method):
    for pair in pairs.training[:2]:
        true = pair.displacement[None].float()
        assert method.loss(true, pair, PLAN) < 0.9 * method.loss(torch.zeros_like(true), pair, PLAN)


def test_the_loss_in_3d_is_least_at_the_truth(pairs):
    """Slices at which the CT ends in the body once made the truth as bad as rest: twice as far a motion was better."""
    plan = replace(PLAN, gradient_weight=0.0)
    for pair in pairs.training:
        true = pair.displacement[None].float()
        half, at_truth, twice, rest = (
            float(LiftReg().loss(k * true, pair, plan)) for k in (0.5, 1.0, 2.0, 0.0)
        )
        assert at_truth < 0.5 * rest and at_truth < half < rest and at_truth < twice


def test_errors_in_millimetres_are_those_of_the_poses():
    pair = next(trained_case.pairs(5))
    prepared = TrainingSet.collected(iter([pair] * 3), (2, 1), 32).training[0]
    rest = prepared.error_mm(torch.zeros(3, 32, 32, 32))
    assert rest == pytest.approx(np.linalg.norm(pair.moved, axis=1).mean(), rel=1e-5)
    assert prepared.rest_mm == pytest.approx(rest, rel=1e-5)
    assert prepared.error_mm(prepared.displacement) < 0.35 * rest


def test_the_true_field_is_rigid_in_bones():
    patient = trained_case.patient()
    pair = patient.pair(3, SimulationOptions(projector="sum"))
    index = np.rint(Volume(np.zeros(pair.field.shape), pair.field.affine).to_index(pair.points))
    nodes = index @ pair.field.affine[:3, :3].T + pair.field.affine[:3, 3]
    at = pair.field.sample(nodes)
    # Points of one bone have one rigid motion: fit it to the points, predict the nodes beside them.
    source, target = pair.points, pair.points + pair.moved
    a, b = source - source.mean(0), target - target.mean(0)
    u, _, v = np.linalg.svd(a.T @ b)
    turn = (u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v).T
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, target.mean(0) - turn @ source.mean(0)
    np.testing.assert_allclose(apply(pose, source), target, atol=1e-6)
    off = np.linalg.norm(apply(pose, nodes) - nodes - at, axis=1)
    assert np.median(off) < 1e-3


def test_the_same_seed_gives_the_same_weights(pairs):
    one, other = (run(LiftReg(), pairs) for _ in range(2))
    assert all(torch.equal(value, other.state[name]) for name, value in one.state.items())
    third = run(LiftReg(), pairs, replace(PLAN, seed=1))
    assert any(not torch.equal(value, third.state[name]) for name, value in one.state.items())


def test_the_same_seed_gives_the_same_pairs():
    assert trained_case.training_set(2, 1).fingerprint() == trained_case.training_set(2, 1).fingerprint()
    assert (
        trained_case.training_set(2, 1).fingerprint() != trained_case.training_set(2, 1, seed=1).fingerprint()
    )


class Interruption:
    """Asks to stop after so many questions."""

    def __init__(self, after):
        self.after = after

    def __call__(self):
        self.after -= 1
        return self.after < 0


@pytest.mark.parametrize("method", SYSTEMS, ids=("liftreg", "2d3d-regnet"))
def test_resumed_is_uninterrupted(pairs, method, tmp_path):
    path = tmp_path / "checkpoint"
    whole = run(method, pairs)
    with pytest.raises(CancelledError):
        run(method, pairs, monitor=Monitor(None, Interruption(3)), checkpoint=path)
    resumed = run(method, pairs, checkpoint=path, resume=True)
    assert all(torch.equal(value, whole.state[name]) for name, value in resumed.state.items())
    strip = [
        {name: value for name, value in each.items() if name != "seconds"} for each in resumed.report["curve"]
    ]
    assert strip == [
        {name: value for name, value in each.items() if name != "seconds"} for each in whole.report["curve"]
    ]


def test_a_checkpoint_of_another_training_is_refused(pairs, tmp_path):
    path = tmp_path / "checkpoint"
    run(LiftReg(), pairs, replace(PLAN, steps=1), checkpoint=path)
    for method, plan in (
        (RegNet(), PLAN),
        (LiftReg(), replace(PLAN, seed=4)),
        (LiftReg(), replace(PLAN, batch=3)),
    ):
        with pytest.raises(InputError, match="belongs to another training"):
            run(method, pairs, plan, checkpoint=path, resume=True)
    with pytest.raises(InputError, match="belongs to another training"):
        run(LiftReg(), trained_case.training_set(4, 2, seed=9), checkpoint=path, resume=True)


def test_time_ends_a_training(pairs):
    weights = run(LiftReg(), pairs, TrainingPlan(minutes=0.01, validate_every=5))
    assert (
        1 <= weights.report["steps"] < 1000 and weights.report["curve"][-1]["step"] == weights.report["steps"]
    )


def test_what_cannot_be_trained_on_is_refused(pairs):
    pair = next(trained_case.pairs())
    with pytest.raises(InputError, match="There are 2 training pairs"):
        TrainingSet.collected(iter([pair] * 2), (4, 1), 16)
    turned = replace(pair, views=pair.views[::-1])
    with pytest.raises(InputError, match="in different orders"):
        TrainingSet.collected(iter([pair, turned]), (4, 1), 16)
    with pytest.raises(
        InputError, match="Training pair 2 does not fit the first: they were trained for 2 X-rays"
    ):
        TrainingSet.collected(iter([pair, replace(pair, views=pair.views[:1])]), (4, 1), 16)
    with pytest.raises(InputError, match="no X-ray"):
        replace(pair, views=())
    with pytest.raises(InputError, match="one displacement for each"):
        replace(pair, moved=pair.moved[1:])
    with pytest.raises(InputError, match="multiple of 16"):
        run(LiftReg(), replace(pairs, side=20))
    with pytest.raises(InputError, match="batch is 0"):
        TrainingPlan(batch=0)


def moved_ct(shift):
    """The phantom displaced by a smooth field, and that field."""
    ct, _ = learned_phantom.phantom()
    points = ct.to_world(np.moveaxis(np.indices(ct.shape)[::-1], 0, -1))
    size = np.exp(-(((points - ct.bounds_center) / 60) ** 2).sum(-1))
    field = DisplacementField(size[..., None] * np.array(shift), ct.affine)
    return warp_volume(ct, field, ct), field


@pytest.mark.long
def test_demons_find_a_smooth_motion():
    ct, _ = learned_phantom.phantom()
    fixed, true = moved_ct((12.0, 0, -9.0))
    found = demons_field(ct, fixed, 16)
    points = ct.to_world(np.argwhere(ct.voxels > 300)[:, ::-1])
    rest = np.linalg.norm(true.sample(points), axis=1).mean()
    assert np.linalg.norm(found.sample(points) - true.sample(points), axis=1).mean() < 0.6 * rest


@pytest.mark.long
def test_pairs_of_cts_are_all_against_all():
    ct, _ = learned_phantom.phantom()
    cts = [ct, moved_ct((12.0, 0, -9.0))[0], moved_ct((-8.0, 5.0, 0))[0]]
    found = list(ct_pairs(cts, trained_case.cameras(), 16, 0, "sum"))
    assert len(found) == 6 and {(id(pair.moving), id(pair.fixed)) for pair in found} == {
        (id(a), id(b)) for a in cts for b in cts if a is not b
    }
    pairs = TrainingSet.collected(iter(found), (4, 2), 16)
    assert run(LiftReg(), pairs, replace(PLAN, steps=1)).report["pairs"] == 4
    with pytest.raises(InputError, match="two CTs"):
        next(ct_pairs([ct], trained_case.cameras(), 16, 0))


@pytest.mark.long
@pytest.mark.parametrize(
    ("method", "steps"), [(LiftReg(), 250), (RegNet(), 250)], ids=["liftreg", "2d3d-regnet"]
)
def test_beats_rest_on_motions_that_it_never_saw(method, steps, tmp_path):
    pairs = trained_case.training_set(60, 8)
    plan = TrainingPlan(minutes=None, steps=steps, batch=2, validate_every=25)
    weights = run(method, pairs, plan)
    assert weights.report["held_out_mm"] < 0.8 * weights.report["rest_mm"]
    path = tmp_path / "weights.pt"
    torch.save(weights.to_fields(), path)
    errors, rests = [], []
    for seed in range(4000, 4006):
        case = trained_case.simulated(seed)
        study = trained_case.study(case.images, case.cameras)
        motion = method.fit(study, SystemSetting(weights={method.name: path}))
        index = np.argwhere(case.fixed_labels.voxels == 2)[:, ::-1]
        points = case.fixed_labels.to_world(index)
        moved = apply(case.fixed_to_moving["femur"], points) - points
        errors.append(np.linalg.norm(motion.field.sample(points) - moved, axis=1).mean())
        rests.append(np.linalg.norm(moved, axis=1).mean())
    assert np.mean(errors) < 0.9 * np.mean(rests)
