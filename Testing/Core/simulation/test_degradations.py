"""Every degradation is repeatable, changes what it says and nothing else, and leaves images that can be read."""

import re
from pathlib import Path

import numpy as np
import pytest
from simulation_phantom import NAMES, phantom

from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.degraded_cases import load_degradation_record, write_degraded_case
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation.degradations.degraded_case import undegraded
from PolyPoseLib.simulation.degradations.registry import ACTS_ON, DEGRADATIONS, OF_TWO_VIEWS, STAGES, degrade
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras

PAGE = Path(__file__).resolve().parents[3] / "docs" / "degradations.md"

ASKED_FOR = {
    "eight_bit", "gamma", "window_clipped", "clahe", "unsharp", "multi_scale", "inverted", "mirrored",
    "views_exchanged", "cropped", "collimation_square", "collimation_tilted", "collimation_round",
    "collimation_black", "lead_letters", "burned_text", "ecg_leads", "table_rails", "k_wires", "retractor",
    "clamp", "prosthesis", "pedicle_screws", "contrast", "bowel_gas", "intensifier", "distance_wrong",
    "spacing_at_isocentre", "patient_moved", "ct_cut_short", "ct_raw_values", "ct_soft_window",
    "ct_slice_distance", "labels_mirrored", "labels_shifted", "view_twice", "ct_bone_only", "small_bones",
}  # fmt: skip

WITHOUT_CHANCE = {
    "eight_bit", "inverted", "mirrored", "views_exchanged", "view_twice", "distance_wrong", "spacing_at_isocentre",
    "ct_cut_short", "ct_raw_values", "ct_raw_padding", "ct_soft_window", "ct_slice_distance", "ct_bone_only",
    "labels_mirrored",
}  # fmt: skip


@pytest.fixture(scope="module")
def case():
    ct, structures, source = phantom(spacing=(6.0, 6.0, 6.0), handedness=-1)
    options = SimulationOptions(projector="sum", node_mm=5.0, pad_mm=10.0)
    cameras = view_cameras(ct, (0.0, 60.0), pixels=72, detector_mm=350)
    return simulate_case(ct, structures, None, cameras, 3, options, "pelvis", source)


def parts(degraded):
    """{what a degradation may act on: its values}."""
    stated = [view.stated for view in degraded.views]
    return {
        "image": [view.image for view in degraded.views],
        "camera": [
            np.r_[view.camera.extrinsic.ravel(), view.camera.intrinsics.ravel()] for view in degraded.views
        ],
        "CT": [degraded.ct.voxels, degraded.ct.affine],
        "labels": [degraded.structures.labels, degraded.source_labels.voxels, degraded.source_labels.affine],
        "study": [
            *(each.extrinsic for each in stated),
            *(np.array([each.source_to_detector_mm, *each.pixel_spacing_mm]) for each in stated),
            np.array([degraded.camera_state == "known"]),
        ],
    }


def same(first, second):
    return all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("name", DEGRADATIONS)
def test_it_changes_what_it_says_and_nothing_else(case, name):
    before, after = parts(undegraded(case)), parts(degrade(case, [name]))
    changed = {part for part in ACTS_ON if not same(before[part], after[part])}
    assert changed == set(DEGRADATIONS[name].acts_on)


@pytest.mark.parametrize("name", DEGRADATIONS)
def test_the_same_seed_gives_the_same_case_bit_for_bit(case, name):
    first, again = (parts(degrade(case, [name], 5)) for _ in range(2))
    assert all(same(first[part], again[part]) for part in ACTS_ON)


@pytest.mark.parametrize("name", DEGRADATIONS)
def test_another_seed_gives_another_case_where_chance_has_a_part(case, name):
    first = parts(degrade(case, [name], 5))
    others = (parts(degrade(case, [name], seed)) for seed in (6, 7, 8, 9))
    differs = any(not same(first[part], other[part]) for other in others for part in ACTS_ON)
    assert differs == (name not in WITHOUT_CHANCE)


@pytest.mark.parametrize("name", DEGRADATIONS)
def test_images_stay_finite_and_of_one_type(case, name):
    for view in degrade(case, [name]).views:
        assert view.image.dtype == np.float32 and view.image.ndim == 2
        assert np.isfinite(view.image).all()
        assert view.image.shape == (view.camera.height, view.camera.width)
        assert view.image.std() > 0
        if view.grey_bits:
            assert view.image.min() >= 0 and view.image.max() <= 1


def test_the_case_itself_is_left_alone(case):
    before = [image.copy() for image in case.images], case.ct.voxels.copy(), case.structures.labels.copy()
    for name in DEGRADATIONS:
        degrade(case, [name])
    assert same(before[0], case.images)
    assert np.array_equal(before[1], case.ct.voxels) and np.array_equal(before[2], case.structures.labels)


def test_nothing_asked_for_is_nothing_done(case):
    before, after = parts(undegraded(case)), parts(degrade(case, []))
    assert all(same(before[part], after[part]) for part in ACTS_ON)


def test_things_happen_in_the_order_of_a_clinic_whatever_the_order_of_names(case):
    names = ["eight_bit", "k_wires", "patient_moved", "labels_shifted", "collimation_black", "mirrored"]
    first, second = parts(degrade(case, names)), parts(degrade(case, names[::-1]))
    assert all(same(first[part], second[part]) for part in ACTS_ON)


def test_unknown_and_repeated_names_are_refused(case):
    with pytest.raises(InputError, match="k_wires"):
        degrade(case, ["k_wire"])
    with pytest.raises(InputError, match="twice"):
        degrade(case, ["gamma", "gamma"])


def test_faults_between_views_need_two(case):
    from dataclasses import replace

    parts_of_views = ("images", "clean_images", "cameras", "initial_cameras")
    single = replace(case, **{part: getattr(case, part)[:1] for part in parts_of_views})
    for name in OF_TWO_VIEWS:
        with pytest.raises(InputError, match="two views"):
            degrade(single, [name])
    assert len(degrade(single, ["k_wires", "small_bones"]).views) == 1


def test_the_registry_is_complete():
    assert set(DEGRADATIONS) >= ASKED_FOR
    for name, kind in DEGRADATIONS.items():
        assert kind.name == name and re.fullmatch(r"[a-z0-9_]+", name)
        assert kind.stage in STAGES and kind.acts_on and set(kind.acts_on) <= set(ACTS_ON)
        assert kind.description and "\n" not in kind.description and kind.right_outcome
        assert kind.change.__doc__


def test_the_page_lists_what_the_registry_has():
    rows = re.findall(r"^\| `(\w+)` \| (.+?) \| (yes|no) \|", PAGE.read_text(encoding="utf-8"), re.M)
    kinds = DEGRADATIONS.values()
    assert rows == [(kind.name, kind.description, "yes" if kind.recoverable else "no") for kind in kinds]


@pytest.mark.parametrize("name", ["k_wires", "cropped", "small_bones", "distance_wrong", "ct_cut_short"])
def test_the_study_that_is_written_says_what_the_case_says(case, tmp_path, name):
    degraded = degrade(case, [name])
    study = Study.load(write_degraded_case(degraded, tmp_path / "case"))
    assert study.structures.names == NAMES
    assert np.array_equal(study.structures.labels, degraded.structures.labels)
    assert np.allclose(study.ct.affine, degraded.ct.affine, atol=1e-4)
    for xray, view in zip(study.xrays, degraded.views, strict=True):
        assert np.allclose(xray.extrinsic, view.stated.extrinsic, atol=1e-6)
        assert xray.source_to_detector_mm == pytest.approx(view.stated.source_to_detector_mm, rel=1e-5)
        assert np.allclose(xray.pixel_spacing_mm, view.stated.pixel_spacing_mm, rtol=1e-5)
        assert np.allclose(xray.image, view.image, atol=1e-2)


@pytest.mark.parametrize("name", ["eight_bit", "clahe", "inverted", "burned_text"])
def test_pictures_keep_their_grey_levels_in_the_file(case, tmp_path, name):
    degraded = degrade(case, [name])
    study = Study.load(write_degraded_case(degraded, tmp_path / "case"))
    for xray, view in zip(study.xrays, degraded.views, strict=True):
        inside = (view.image > 0.02) & (view.image < 0.98)
        assert np.corrcoef(xray.image[inside], view.image[inside])[0, 1] > 0.999


def test_the_truth_holds_the_cameras_that_took_the_pictures(case, tmp_path):
    degraded = degrade(case, ["views_exchanged", "ct_slice_distance"])
    write_degraded_case(degraded, tmp_path / "case")
    truth = load_truth(tmp_path / "case" / "truth")
    assert np.allclose(truth.cameras[0].extrinsic, case.cameras[1].extrinsic)
    assert np.array_equal(truth.moving_labels.voxels, case.structures.labels)
    record = load_degradation_record(tmp_path / "case" / "truth")
    assert record.names == degraded.names and record.size_factor == 1
    assert np.allclose(record.given_to_true @ degraded.ct.affine, case.ct.affine)


def test_small_bones_look_alike_and_measure_a_quarter(case):
    small = degrade(case, ["small_bones"])
    assert small.size_factor == pytest.approx(0.25)
    assert np.allclose(small.ct.spacing, case.ct.spacing / 4)
    for name in NAMES:
        large, little = case.fixed_to_moving[name], small.case.fixed_to_moving[name]
        assert np.allclose(little[:3, :3], large[:3, :3])
        points = case.ct.to_world(np.argwhere(case.structures.mask(name))[:50, ::-1])
        moved = points @ large[:3, :3].T + large[:3, 3] - points
        shrunk = small.case.ct.to_world(case.ct.to_index(points))
        assert np.allclose(shrunk @ little[:3, :3].T + little[:3, 3] - shrunk, moved / 4, atol=1e-9)
    for view, clean in zip(small.views, case.clean_images, strict=True):
        assert np.corrcoef(view.body.ravel(), clean.ravel())[0, 1] > 0.95


def test_a_moved_patient_is_seen_by_a_moved_camera(case):
    moved = degrade(case, ["patient_moved"])
    relative = np.linalg.inv(case.cameras[1].extrinsic) @ moved.views[1].camera.extrinsic
    angle = np.degrees(np.arccos((np.trace(relative[:3, :3]) - 1) / 2))
    assert angle == pytest.approx(4, abs=1e-6)
    assert np.array_equal(moved.views[0].camera.extrinsic, case.cameras[0].extrinsic)
    assert np.allclose(moved.views[1].stated.extrinsic, case.initial_cameras[1].extrinsic)
    known = degrade(case, ["patient_moved_known_cameras"])
    assert np.allclose(known.views[1].stated.extrinsic, case.cameras[1].extrinsic)


def test_collimators_hide_little_of_any_bone(case):
    for name in ("collimation_square", "collimation_tilted", "collimation_round", "collimation_black"):
        for view in degrade(case, [name]).views:
            behind = view.leaves < 0.5
            assert behind.any()
            assert view.image[behind].std() > 0 or view.blanked is not None


def test_scatter_and_noise_remain_behind_leaves(case):
    degraded = degrade(case, ["collimation_square"])
    for view in degraded.views:
        deep = view.leaves < 0.003
        assert view.image[deep].std() > 0.02
        assert 2 < np.median(view.image[deep]) < -np.log(0.002)
