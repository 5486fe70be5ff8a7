"""The paper's method: its objective's gradient, what each stage finds, and the contract of a registration."""

import dataclasses

import numpy as np
import pytest
from paper_cases import ANCHOR, fastest_backend, phantom, projection_error_px
from quiet_run import quiet_run

from PolyPoseLib.baselines.published import method as paper
from PolyPoseLib.baselines.published.method import (
    PAPER_LEVELS,
    PaperLevel,
    anchor_body,
    attenuation_grid,
    find_camera_by_anchor,
    fit_structures_by_gmncc,
    view_of,
)
from PolyPoseLib.baselines.published.objective import PolyrigidObjective, poses_of
from PolyPoseLib.data.paper_options import PaperOptions
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.errors import CancelledError
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.uncertainty.covariance import joint_covariance, pose_uncertainties
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.warp.weights import distance_maps

FEW = (PaperLevel(10.0, 25), PaperLevel(None, 25))

PLAIN = PaperOptions(
    anchor="held", restart_adam=False, bone_multiplier=1.0, gradient_blur_px=0.0, camera_plateaus=False
)
"""The phantom's X-rays are plain renderings, its anchor stands still."""


@pytest.fixture(scope="module")
def case():
    return phantom()


def fit(case, levels=FEW, optimizer="adam", frame="fixed", form="mass", options=PLAIN, **changes):
    """changes: of the run."""
    run = quiet_run(case.scene(), frame=frame, form=form, epsilon=0.02)
    return fit_structures_by_gmncc(
        dataclasses.replace(run, **changes), case.study.ct, case.observations(), optimizer, levels, options
    )


def objective(case, frame="fixed", form="mass", options=PLAIN):
    scene = case.scene()
    maps = distance_maps(scene.structures, scene.ct_affine)
    warp = SoftTissue(scene, frame, form, 0.02).warp(maps, case.poses)
    grid = attenuation_grid(case.study.ct, None)
    views = [view_of(m, 180) for m in case.observations()]
    return PolyrigidObjective(quiet_run(scene), grid, warp, views, 2.0, options)


def test_the_papers_schedule():
    assert [(level.voxel_mm, level.iterations) for level in PAPER_LEVELS] == [
        (4.0, 51),
        (2.0, 51),
        (None, 51),
    ]


@pytest.mark.parametrize(("frame", "form"), [("fixed", "mass"), ("fixed", "epsilon"), ("moving", "mass")])
def test_the_gradient_is_the_similaritys_derivative(case, frame, form):
    function = objective(case, frame, form)
    at = np.random.default_rng(1).normal(size=(3, 6)) * ([0.05] * 3 + [3.0] * 3)
    value, gradient = function(at)
    assert value == pytest.approx(function.value(at), abs=1e-6)
    for k, c in [(0, 1), (1, 0), (1, 5), (2, 2), (2, 3)]:
        step = np.zeros((3, 6))
        step[k, c] = 2e-3 if c < 3 else 0.1
        numerical = (function.value(at + step) - function.value(at - step)) / (2 * step[k, c])
        size = np.abs(gradient[:, :3] if c < 3 else gradient[:, 3:]).max()
        assert gradient[k, c] == pytest.approx(numerical, abs=0.03 * size)


def test_normal_equations_have_the_same_gradient(case):
    function = objective(case)
    at = np.random.default_rng(2).normal(size=(3, 6)) * ([0.05] * 3 + [3.0] * 3)
    value, gradient = function(at)
    normal = function.normal_equations(at)
    assert normal.cost == pytest.approx(2 * (1 - value)) == function.cost(at)
    np.testing.assert_allclose(
        -normal.gradient.reshape(2, 6), gradient[1:], atol=1e-5 * np.abs(gradient).max()
    )
    assert np.linalg.eigvalsh(normal.matrix).min() > 0


def test_the_anchor_does_not_move(case):
    function = objective(case)
    step = np.random.default_rng(4).normal(size=function.size)
    moved = function.moved(np.zeros((3, 6)), step)
    assert not moved[0].any()
    np.testing.assert_array_equal(moved[1:].ravel(), step)


def test_parameters_are_motions_about_the_structures_centroids(case):
    function = objective(case)
    at = np.random.default_rng(3).normal(size=(3, 6))
    poses = poses_of(at, function.centres)
    at[:, 3:] = 0
    for pose, centre in zip(poses_of(at, function.centres), function.centres, strict=True):
        np.testing.assert_allclose(pose[:3, :3] @ centre + pose[:3, 3], centre, atol=1e-9)
    assert np.isfinite(poses).all()


@pytest.mark.parametrize("optimizer", ["adam", "lm"])
def test_moved_bones_are_found_from_rest(case, optimizer):
    at_rest = case.bone_error(np.stack([np.eye(4)] * 3))
    similarities = []
    monitor = Monitor(lambda p: similarities.append(p.similarity), None)
    found = fit(case, (PaperLevel(None, 60 if optimizer == "adam" else 25),), optimizer, monitor=monitor)
    error = case.bone_error(found.poses)
    np.testing.assert_array_equal(found.poses[0], np.eye(4))
    assert similarities[-1] > 0.99 > similarities[0]
    assert (error[1:] < 0.4 * at_rest[1:]).all(), (error, at_rest)


def test_levenberg_marquardt_needs_fewer_steps(case):
    histories = {}
    for optimizer, iterations in (("adam", 30), ("lm", 10)):
        monitor = Monitor(None, None)
        fit(case, (PaperLevel(None, iterations),), optimizer, monitor=monitor)
        histories[optimizer] = [step["similarity"] for step in monitor.history]
    assert len(histories["lm"]) <= 10 < len(histories["adam"]) == 30
    assert histories["lm"][-1] > histories["adam"][-1] - 0.01


@pytest.mark.parametrize(("frame", "form"), [("moving", "rigid"), ("fixed", "epsilon")])
def test_weights_of_the_study_are_those_of_the_fit(case, frame, form):
    own = fit(case, (PaperLevel(10.0, 4),), frame=frame, form=form).poses
    assert not np.allclose(own, fit(case, (PaperLevel(10.0, 4),)).poses)


def test_a_run_is_repeatable_bit_by_bit(case):
    levels = (PaperLevel(10.0, 5), PaperLevel(None, 3))
    np.testing.assert_array_equal(fit(case, levels).poses, fit(case, levels).poses)


@pytest.mark.parametrize("optimizer", ["adam", "lm"])
def test_plain_torch_walks_the_same_way(case, optimizer):
    levels = (PaperLevel(10.0, 4),)
    found = [fit(case, levels, optimizer, backend=b).poses for b in (fastest_backend(), TorchBackend())]
    np.testing.assert_allclose(case.bone_error(found[0]), case.bone_error(found[1]), atol=0.02)


def test_progress_previews_and_cancelling(case):
    steps, shown = [], []
    monitor = Monitor(steps.append, lambda: len(steps) >= 12)
    with pytest.raises(CancelledError):
        fit(case, (PaperLevel(10.0, 30),), monitor=monitor, preview=lambda field: shown.append(field) or "p")
    assert [p.iteration for p in steps] == list(range(12))
    assert {p.of for p in steps} == {30} and {p.stage for p in steps} == {"bones"}
    assert [p.preview for p in steps].count("p") == len(shown) == 2


def test_uncertainty_of_the_found_poses(case):
    found = fit(case, (PaperLevel(10.0, 5),))
    uncertainties = pose_uncertainties(found.problem, joint_covariance(found.problem, found.state))
    assert set(uncertainties) == {1, 2}
    for uncertainty in uncertainties.values():
        assert np.linalg.eigvalsh(uncertainty.covariance).min() > 0


def test_a_camera_is_found_by_the_anchor():
    case = phantom(seed=1, pixels=90, turn=0.0, shift=0.0, camera_error=(0.08, 12.0))
    levels = (PaperLevel(10.0, 40, 45), PaperLevel(None, 40, 90))
    scene = case.scene()
    initial = case.cameras[0].with_extrinsic(case.study.xrays[0].extrinsic)
    (observation, _) = case.observations([initial, case.cameras[1]])
    steps = []
    found = find_camera_by_anchor(quiet_run(scene, steps.append), case.study.ct, observation, levels, PLAIN)
    body = anchor_body(case.study.ct, scene, None)
    corners = body.corners
    before, after = (projection_error_px(c, case.cameras[0], corners) for c in (initial, found))
    assert len(steps) == 80 and steps[-1].similarity > steps[0].similarity
    assert after < 0.3 * before, (after, before)


def test_the_anchor_is_cut_out_of_the_ct(case):
    body = anchor_body(case.study.ct, case.scene(), None)
    mask = case.study.structures.labels == 1
    whole = attenuation_grid(case.study.ct, None).voxels[1:-1, 1:-1, 1:-1]
    assert body.voxels.sum() == pytest.approx(whole[mask].sum(), rel=1e-5)
    coarse = anchor_body(case.study.ct, case.scene(), 10.0)
    cells = [np.prod(np.linalg.norm(b.affine[:3, :3], axis=0)) for b in (body, coarse)]
    assert coarse.voxels.sum() * cells[1] == pytest.approx(body.voxels.sum() * cells[0], rel=1e-4)


def test_preset_paper_registers_a_study(case, monkeypatch):
    monkeypatch.setattr(paper.find_camera_by_anchor, "__defaults__", ((PaperLevel(10.0, 8),), PLAIN))
    monkeypatch.setattr(paper.fit_structures_by_gmncc, "__defaults__", ("adam", FEW, PLAIN))
    study = dataclasses.replace(case.study, options={"preset": "paper", "paper": PLAIN.to_dict()})
    stages = []
    result = register(study, progress=lambda p: stages.append(p.stage))
    assert list(result.structures) == [ANCHOR, "femur_left", "femur_right"]
    assert {"camera view 1", "camera view 2", "bones"} <= set(stages)
    assert all(0 <= step["similarity"] <= 1 for step in result.history)
    assert result.structures["femur_left"].uncertainty is not None
    bones = [step["similarity"] for step in result.history if step["stage"] == "bones"]
    assert len(bones) == 50 and bones[-1] > bones[0]
