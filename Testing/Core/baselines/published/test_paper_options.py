"""Every option of the preset "paper" changes what it is to change, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from paper_cases import phantom, projection_error_px
from quiet_run import quiet_run

from PolyPoseLib.baselines.published import method as paper
from PolyPoseLib.baselines.published.method import (
    BONE_HU,
    PLATEAU_ITERATIONS,
    PaperLevel,
    anchor_body,
    attenuation_grid,
    find_camera_by_anchor,
    fit_structures_by_gmncc,
    view_of,
)
from PolyPoseLib.baselines.published.objective import PolyrigidObjective
from PolyPoseLib.baselines.published.plateau import PLATEAUS, Plateaus
from PolyPoseLib.data.paper_options import PUBLISHED, PaperOptions
from PolyPoseLib.data.volume import hounsfield_to_attenuation
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.warp.weights import distance_maps

PLAIN = PaperOptions("held", False, 1.0, 0.0, False)


@pytest.fixture(scope="module")
def case():
    return phantom()


TWICE = (PaperLevel(10.0, 3), PaperLevel(10.0, 3))


def fit(case, options, levels=TWICE, optimizer="adam"):
    steps = []
    run = quiet_run(case.scene(), steps.append, frame="fixed", form="mass")
    poses = fit_structures_by_gmncc(run, case.study.ct, case.observations(), optimizer, levels, options).poses
    return poses, [step.similarity for step in steps]


def objective(case, options):
    scene = case.scene()
    maps = distance_maps(scene.structures, scene.ct_affine)
    warp = SoftTissue(scene, "fixed", "mass", 0.02).warp(maps, case.poses)
    views = [view_of(each, 180) for each in case.observations()]
    grid = attenuation_grid(case.study.ct, 10.0, options.bone_multiplier)
    return PolyrigidObjective(quiet_run(scene), grid, warp, views, 4.0, options)


@pytest.mark.parametrize("optimizer", ["adam", pytest.param("lm", marks=pytest.mark.long)])
def test_a_free_anchor_moves_and_a_held_one_stands_still(case, optimizer):
    held, _ = fit(case, PLAIN, optimizer=optimizer)
    free, _ = fit(case, replace(PLAIN, anchor="free"), optimizer=optimizer)
    np.testing.assert_array_equal(held[0], np.eye(4))
    assert not np.allclose(free[0], np.eye(4), atol=1e-4)


def test_a_restarted_adam_differs_from_the_second_level_on(case):
    _, going_on = fit(case, PLAIN)
    _, restarted = fit(case, replace(PLAIN, restart_adam=True))
    assert going_on[:4] == restarted[:4]  # the fourth is seen before the first step of the second level
    assert going_on[4:] != restarted[4:]


def test_a_restarted_adam_first_steps_by_its_whole_rates(case):
    once, _ = fit(case, PLAIN, (PaperLevel(10.0, 3),))
    restarted, _ = fit(case, replace(PLAIN, restart_adam=True), (PaperLevel(10.0, 3), PaperLevel(10.0, 1)))
    going_on, _ = fit(case, PLAIN, (PaperLevel(10.0, 3), PaperLevel(10.0, 1)))
    turned = [np.linalg.norm(after[1:, :3, :3] - once[1:, :3, :3]) for after in (restarted, going_on)]
    assert turned[0] > turned[1] > 0


@pytest.mark.parametrize("voxel_mm", [None, 10.0])
def test_bone_and_nothing_else_is_multiplied(case, voxel_mm):
    ct = case.study.ct
    plain, more = (attenuation_grid(ct, voxel_mm, factor) for factor in (1.0, 2.0))
    np.testing.assert_array_equal(attenuation_grid(ct, voxel_mm).voxels, plain.voxels)
    cell = np.prod(np.linalg.norm(plain.affine[:3, :3], axis=0))
    bone = ct.voxels[ct.voxels > BONE_HU].astype(float)
    expected = hounsfield_to_attenuation(2 * bone).sum() - hounsfield_to_attenuation(bone).sum()
    added = (more.voxels.astype(float) - plain.voxels).sum() * cell / np.prod(ct.spacing)
    assert added == pytest.approx(expected, rel=1e-3)
    if voxel_mm is None:
        changed = more.voxels[1:-1, 1:-1, 1:-1] != plain.voxels[1:-1, 1:-1, 1:-1]
        np.testing.assert_array_equal(changed, ct.voxels > BONE_HU)


def test_the_ct_itself_is_not_multiplied(case):
    before = case.study.ct.voxels.copy()
    attenuation_grid(case.study.ct, None, 3.0)
    np.testing.assert_array_equal(case.study.ct.voxels, before)


@pytest.mark.parametrize("options", [PUBLISHED, pytest.param(PLAIN, marks=pytest.mark.long)])
def test_gradient_and_normal_equations_belong_to_the_similarity_of_the_options(case, options):
    function = objective(case, options)
    at = np.random.default_rng(1).normal(size=(3, 6)) * ([0.05] * 3 + [3.0] * 3)
    _, gradient = function(at)
    normal = function.normal_equations(at)
    moving = [0, 1, 2] if options.anchor == "free" else [1, 2]
    assert function.size == 6 * len(moving)
    np.testing.assert_allclose(
        -normal.gradient.reshape(-1, 6), gradient[moving], atol=1e-5 * np.abs(gradient).max()
    )
    assert np.linalg.eigvalsh(normal.matrix).min() > 0
    for k, c in [(0, 1), (1, 5), (2, 0)]:
        step = np.zeros((3, 6))
        step[k, c] = 2e-3 if c < 3 else 0.1
        numerical = (function.value(at + step) - function.value(at - step)) / (2 * step[k, c])
        size = np.abs(gradient[:, :3] if c < 3 else gradient[:, 3:]).max()
        assert gradient[k, c] == pytest.approx(numerical, abs=0.03 * size)


def test_the_blur_changes_the_similarity_alone(case):
    plain, soft = (objective(case, replace(PLAIN, gradient_blur_px=blur)) for blur in (0.0, 10.0))
    at = np.zeros((3, 6))
    assert plain.value(at) != pytest.approx(soft.value(at), abs=1e-3)
    for one, other in zip(plain.projectors, soft.projectors, strict=True):
        np.testing.assert_array_equal(one.image(at), other.image(at))


@pytest.mark.parametrize("seed", range(4))
def test_step_sizes_fall_as_torch_has_them(seed):
    rng = np.random.default_rng(seed)
    ours = Plateaus()
    optimizer = torch.optim.Adam([torch.zeros(1)], lr=1.0)
    theirs = torch.optim.lr_scheduler.ReduceLROnPlateau(
        optimizer, mode="max", factor=0.1, patience=10, threshold=1e-4
    )
    similarity, falls = 0.3, 0
    for n in range(400):
        if rng.random() < 0.4 * 0.99**n:
            similarity += 10 ** rng.uniform(-6, -2.5)
        value = similarity - 1e-5 * rng.random()
        ours.after(value)
        theirs.step(value)
        assert ours.factor == pytest.approx(theirs.get_last_lr()[0])
        falls = round(-np.log10(ours.factor))
        assert ours.over == (falls >= PLATEAUS - 1)
        if ours.over:
            break
    assert falls == PLATEAUS - 1


def test_a_small_fall_below_zero_is_no_rise():
    plateaus = Plateaus()
    for _ in range(12):
        plateaus.after(-0.5)
    assert plateaus.factor == pytest.approx(0.1)


def test_the_camera_stage_goes_on_until_it_is_level():
    case = phantom(seed=1, pixels=60, turn=0.0, shift=0.0, camera_error=(0.08, 12.0))
    levels = (PaperLevel(10.0, 12, 30), PaperLevel(10.0, 12, 60))
    initial = case.cameras[0].with_extrinsic(case.study.xrays[0].extrinsic)
    (observation, _) = case.observations([initial, case.cameras[1]])
    corners = anchor_body(case.study.ct, case.scene(), None).corners
    before = projection_error_px(initial, case.cameras[0], corners)
    found, lengths = {}, {}
    for plateaus in (False, True):
        steps = []
        run = quiet_run(case.scene(), steps.append)
        options = replace(PLAIN, camera_plateaus=plateaus)
        camera = find_camera_by_anchor(run, case.study.ct, observation, levels, options)
        assert projection_error_px(camera, case.cameras[0], corners) < 2 < before
        found[plateaus] = steps[-1].similarity
        lengths[plateaus] = len(steps)
        assert [step.iteration for step in steps] == sorted(step.iteration for step in steps)
        assert steps[-1].iteration < steps[-1].of == (2 * PLATEAU_ITERATIONS if plateaus else 24)
    assert lengths[False] == 24 < lengths[True] < 2 * PLATEAU_ITERATIONS
    assert found[True] > found[False]


def test_the_study_says_which_options_run(case, monkeypatch):
    levels = (PaperLevel(10.0, 4),)
    monkeypatch.setattr(paper.fit_structures_by_gmncc, "__defaults__", ("adam", levels, PUBLISHED))
    study = replace(
        case.study,
        xrays=tuple(
            replace(xray, extrinsic=camera.extrinsic, camera="known")
            for xray, camera in zip(case.study.xrays, case.cameras, strict=True)
        ),
        options={"preset": "paper", "uncertainty": False, "paper": {"anchor": "held"}},
    )
    held = register(study).structures["pelvis"].fixed_to_moving
    free = (
        register(replace(study, options=study.options | {"paper": {}})).structures["pelvis"].fixed_to_moving
    )
    np.testing.assert_array_equal(held, np.eye(4))
    assert np.linalg.norm(free - np.eye(4)) > 0.01
