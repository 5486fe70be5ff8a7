"""A whole case: bones exactly rigid, soft tissue between them, images of what really lies there."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_phantom import HEAD_CENTRE, NAMES, phantom

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.score import rotation_between_deg
from PolyPoseLib.simulation.motion import rigid_about
from PolyPoseLib.simulation.simulate import (
    SimulationOptions,
    arc_angles,
    perturbed_camera,
    simulate_case,
    structures_centre,
    view_cameras,
)

QUICK = SimulationOptions(projector="sum", node_mm=5.0, pad_mm=10.0)


def small_cameras(ct):
    return view_cameras(ct, pixels=32, detector_mm=350)


def bend(degrees=15.0):
    motion = rigid_about(HEAD_CENTRE, np.radians(degrees) * np.array([0.6, 0.8, 0]), np.array([0.5, -0.5, 0]))
    return {"femur_left": motion}


CASES = [
    (1, "harmonic"),
    (-1, "harmonic"),
    (-1, "elastic"),
    pytest.param((1, "elastic"), marks=pytest.mark.long),
]
"""Handedness of the CT, and law of its soft tissue."""


@pytest.fixture(scope="module", params=CASES)
def case(request):
    handedness, tissue = request.param
    ct, structures, source = phantom(handedness=handedness)
    options = replace(QUICK, tissue=tissue)
    return simulate_case(ct, structures, bend(), small_cameras(ct), 4, options, "pelvis", source)


def test_every_fixed_voxel_is_a_bone_exactly_when_it_comes_from_it(case):
    labels = case.structures.labels
    kji = np.stack(np.meshgrid(*map(np.arange, labels.shape), indexing="ij"), -1).reshape(-1, 3)
    points = case.ct.to_world(kji[:, ::-1])
    expected = np.zeros(len(points), np.int16)
    for number, name in reversed(list(enumerate(NAMES, start=1))):
        pose = case.fixed_to_moving[name]
        index = np.rint(case.ct.to_index(points @ pose[:3, :3].T + pose[:3, 3])).astype(int)[:, ::-1]
        inside = np.all((index >= 0) & (index < labels.shape), axis=1)
        hit = np.zeros(len(points), bool)
        hit[inside] = labels[tuple(index[inside].T)] == number
        expected[hit] = number
    pelvis_first = np.where(labels.ravel() == 1, 1, expected)
    agreement = (case.fixed_labels.voxels.ravel() == pelvis_first).mean()
    assert agreement > 0.9999


def test_bones_that_stay_keep_their_hounsfield_units_and_labels(case):
    still = np.isin(case.structures.labels, (1, 3, 4))
    assert np.array_equal(case.fixed_labels.voxels[still], case.structures.labels[still])
    assert np.allclose(case.fixed_ct.voxels[still], case.ct.voxels[still], atol=1e-2)


def test_the_moved_bone_has_bone_inside(case):
    moved = case.fixed_labels.voxels == 2
    assert np.median(case.fixed_ct.voxels[moved]) == pytest.approx(700, abs=1)
    grown = case.structures.labels == 2
    assert abs(moved.sum() - grown.sum()) < 0.08 * grown.sum()


def test_no_bone_is_left_behind(case):
    old_place = (case.structures.labels == 2) & (case.fixed_labels.voxels == 0)
    assert old_place.sum() > 50
    assert np.median(case.fixed_ct.voxels[old_place]) < 300


def test_the_field_is_rigid_inside_bones_and_does_not_fold_outside(case):
    inside = np.argwhere(case.fixed_labels.voxels == 2)[::7]
    points = case.ct.to_world(inside[:, ::-1])
    pose = case.fixed_to_moving["femur_left"]
    error = case.field(points) - (points @ pose[:3, :3].T + pose[:3, 3])
    assert np.median(np.linalg.norm(error, axis=1)) < 0.2
    assert case.statistics["folds_percent_outside_bones"] < 0.1


def test_the_organ_moves_with_the_field(case):
    organ = case.fixed_source_labels.voxels == 5
    assert organ.sum() == pytest.approx((case.source_labels.voxels == 5).sum(), rel=0.25)
    assert set(np.unique(case.fixed_source_labels.voxels)) == {0, 5, 10, 20, 30, 40}


def test_images_are_line_integrals_of_the_posed_body(case):
    for image, clean, camera in zip(case.images, case.clean_images, case.cameras, strict=True):
        assert image.shape == clean.shape == (camera.height, camera.width)
        assert image.dtype == np.float32 and np.isfinite(image).all()
        assert 1 < clean.max() < 8
        assert np.corrcoef(image.ravel(), clean.ravel())[0, 1] > 0.9


def test_initial_cameras_are_off_by_what_was_asked(case):
    centre = np.append(structures_centre(case.structures, case.ct.affine), 1)
    for true, initial in zip(case.cameras, case.initial_cameras, strict=True):
        assert rotation_between_deg(true.extrinsic, initial.extrinsic) == pytest.approx(4.0, abs=1e-6)
        shift = (initial.extrinsic @ centre - true.extrinsic @ centre)[:3]
        assert np.linalg.norm(shift) == pytest.approx(15.0, abs=1e-6)


def test_at_rest_nothing_changes():
    ct, structures, source = phantom()
    case = simulate_case(ct, structures, {}, small_cameras(ct), 0, QUICK, "pelvis", source)
    assert np.allclose(case.fixed_ct.voxels, ct.voxels, atol=1e-2)
    assert np.array_equal(case.fixed_labels.voxels, structures.labels)
    assert np.array_equal(case.fixed_source_labels.voxels, source.voxels)
    assert not case.field.vectors.any()


def test_a_translated_body_is_the_body_translated():
    ct, structures, _ = phantom(spacing=(5.0, 5.0, 5.0))
    one = Structures(("all",), (structures.labels > 0).astype(np.int16))
    shift = np.eye(4)
    shift[:3, 3] = [10.0, 0.0, -5.0]
    with pytest.raises(InputError, match="cannot move"):
        simulate_case(ct, one, {"all": shift}, small_cameras(ct), 0, QUICK)
    labels = 2 * one.labels
    labels[0, 0, 0] = 1
    two = Structures(("still", "all"), labels)
    case = simulate_case(ct, two, {"all": shift}, small_cameras(ct), 0, QUICK)
    expected = np.roll(one.labels, (-1, 0, 2), axis=(0, 1, 2)) > 0
    assert np.array_equal(case.fixed_labels.voxels == 2, expected)


def test_the_same_seed_gives_the_same_case_bit_for_bit():
    ct, structures, _ = phantom(spacing=(6.0, 6.0, 6.0))
    first, second, other = (
        simulate_case(ct, structures, None, small_cameras(ct), seed, QUICK, "pelvis") for seed in (5, 5, 6)
    )
    assert np.array_equal(first.fixed_ct.voxels, second.fixed_ct.voxels)
    assert all(np.array_equal(a, b) for a, b in zip(first.images, second.images, strict=True))
    assert not np.array_equal(first.fixed_ct.voxels, other.fixed_ct.voxels)


@pytest.mark.long
def test_elastic_tissue_does_not_depend_on_the_axes():
    """The same body stored with an axis reversed moves the same way."""
    fields, points = [], None
    for handedness in (1, -1):
        ct, structures, _ = phantom(handedness=handedness)
        options = replace(QUICK, tissue="elastic")
        made = simulate_case(ct, structures, bend(), small_cameras(ct), 4, options, "pelvis")
        points = ct.to_world(np.argwhere(np.ones((5, 5, 5))) * 4.0 + 5) if points is None else points
        fields.append(made.field.sample(points))
    assert np.abs(fields[0] - fields[1]).max() < 0.15 * np.abs(fields[0]).max()


def test_continued_ends_leave_no_air_below():
    ct, structures, _ = phantom(spacing=(5.0, 5.0, 5.0))
    from dataclasses import replace

    cut, continued = (
        simulate_case(ct, structures, bend(), small_cameras(ct), 0, replace(QUICK, ends=ends), "pelvis")
        for ends in ("cut", "continued")
    )
    assert continued.clean_images[0].sum() > cut.clean_images[0].sum()


def test_arguments_that_do_not_fit_are_refused():
    ct, structures, source = phantom(spacing=(8.0, 8.0, 8.0))
    with pytest.raises(InputError, match="tibia"):
        simulate_case(ct, structures, {"tibia": np.eye(4)}, options=QUICK)
    with pytest.raises(InputError, match="skull"):
        simulate_case(ct, structures, anchor="skull", options=QUICK)
    with pytest.raises(InputError, match="grid"):
        simulate_case(ct, structures, source_labels=Volume(source.voxels[1:], source.affine), options=QUICK)
    with pytest.raises(InputError):
        SimulationOptions(ends="open")


def test_views_are_spread_over_the_arc():
    ct, _, _ = phantom(spacing=(8.0, 8.0, 8.0))
    assert arc_angles(2, 30) == [0, 30] and arc_angles(3, 120) == [0, 60, 120] and arc_angles(1, 90) == [0]
    frontal, side = view_cameras(ct, (0, 90))
    assert np.allclose(frontal.axis, [0, 1, 0]) and np.allclose(side.axis, [-1, 0, 0])
    assert np.allclose(frontal.project(ct.bounds_center), (frontal.width - 1) / 2)
    again = perturbed_camera(frontal, ct.bounds_center, np.random.default_rng(0), 0, 0)
    assert np.allclose(again.extrinsic, frontal.extrinsic)
