"""Scores of a motion on a case: directions, grids, oracles that share no code, and what is not defined."""

import dataclasses
import json

import numpy as np
import pytest
import scored_case
import SimpleITK as sitk
from scipy.spatial.distance import cdist

from PolyPoseLib.data.benchmark.case import HeldOutView
from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.benchmark.held_out import hausdorff95_2d, room_for
from PolyPoseLib.evaluation.benchmark.scores import score_case
from PolyPoseLib.evaluation.benchmark.smoothness import smoothness

VOXEL = 2.5
"""mm, the largest side of a voxel of either grid."""

PIXEL_MM2 = float(np.prod(scored_case.PITCH))

TRUE = Motion(scored_case.field_of(), {"femur": scored_case.MOTION})
REST = Motion(scored_case.field_of(np.eye(4)))
REVERSED = Motion(scored_case.field_of(np.linalg.inv(scored_case.MOTION)))


@pytest.fixture(scope="module")
def case():
    return scored_case.drawn_case()


@pytest.fixture(scope="module")
def scores(case):
    return {
        name: score_case(case, motion, minimum_mm2=50 * PIXEL_MM2)
        for name, motion in {"true": TRUE, "rest": REST, "reversed": REVERSED}.items()
    }


def test_the_true_field_scores_one_within_a_voxel(scores):
    for name in scored_case.SHAPES:
        row = scores["true"]["structures"][name]
        assert row["dice"] > 0.91 and row["hd95_mm"] <= VOXEL
        assert row["tre_max_mm"] < 1e-3 and row["rest_tre_mean_mm"] > 5
        assert not row["lost"]
        flat = scores["true"]["held_out"]["structures"][name]
        assert flat["dice"] > 0.93 and flat["views"] == 2
        assert flat["hd95_mm"] <= VOXEL * scored_case.SOURCE_TO_DETECTOR / 550  # magnified


def test_the_motion_the_other_way_round_is_worse_than_rest(scores):
    """Fixed to moving: who takes it for moving to fixed doubles the error, in 3D, in 2D and in mm."""
    for name in scored_case.SHAPES:
        of = {key: each["structures"][name] for key, each in scores.items()}
        flat = {key: each["held_out"]["structures"][name] for key, each in scores.items()}
        assert of["reversed"]["dice"] < of["rest"]["dice"] - 0.1 < of["true"]["dice"]
        assert flat["reversed"]["dice"] < flat["rest"]["dice"] < flat["true"]["dice"]
        assert of["reversed"]["tre_mean_mm"] > 1.8 * of["rest"]["tre_mean_mm"]
        assert of["rest"]["tre_mean_mm"] == pytest.approx(of["rest"]["rest_tre_mean_mm"], abs=1e-9)


def test_a_pose_is_scored_beside_the_field(case):
    poses = {"femur": scored_case.MOTION, "pelvis": np.eye(4)}
    rows = score_case(case, Motion(REST.field, poses))["structures"]
    assert rows["femur"]["pose_tre_mean_mm"] < 1e-9 < rows["femur"]["tre_mean_mm"]
    assert rows["pelvis"]["pose_tre_mean_mm"] == pytest.approx(rows["pelvis"]["rest_tre_mean_mm"])
    assert "pose_tre_mean_mm" not in rows["liver"]


def test_rest_equals_the_labels_that_were_never_warped(case, scores):
    """Resampled by SimpleITK onto the truth's grid and counted by SimpleITK and by brute force."""
    fixed, source = case.truth.labels, case.study.source_segmentation
    resampled = sitk.Resample(
        source.to_sitk(), fixed.to_sitk(), sitk.Transform(), sitk.sitkNearestNeighbor, 0
    )
    for name, (number, _, _) in scored_case.SHAPES.items():
        row = scores["rest"]["structures"][name]
        overlap = sitk.LabelOverlapMeasuresImageFilter()
        overlap.Execute(fixed.to_sitk() == number, resampled == number)
        assert row["dice"] == pytest.approx(overlap.GetDiceCoefficient(), rel=1e-14)
        masks = fixed.voxels == number, sitk.GetArrayFromImage(resampled) == number
        assert row["voxels"] == masks[0].sum()
        assert row["hd95_mm"] == pytest.approx(brute_hd95(*masks, fixed.affine), abs=1e-9)


def test_structures_and_rest_on_the_cts_own_grid(case):
    """Where both grids are one, doing nothing compares the two label maps as they are."""
    source = case.study.source_segmentation
    shifted = Volume(np.roll(source.voxels, 2, axis=1), source.affine)
    same = dataclasses.replace(
        case, truth=dataclasses.replace(case.truth, labels=shifted, held_out=(), field=None, poses={})
    )
    rows = score_case(same, REST)["structures"]
    for name, (number, _, _) in scored_case.SHAPES.items():
        first, second = source.voxels == number, shifted.voxels == number
        assert rows[name]["dice"] == 2 * (first & second).sum() / (first.sum() + second.sum())
        assert "tre_mean_mm" not in rows[name]


@pytest.mark.parametrize("seed", range(6))
def test_hausdorff_in_2d_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    masks = [rng.random((17, 23)) < rng.uniform(0.02, 0.9) for _ in range(2)]
    spacing = tuple(rng.uniform(0.3, 2.0, 2))
    borders = []
    for mask in masks:
        padded = np.pad(mask, 1)
        inner = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
        borders.append(np.argwhere(mask & ~inner))
    for scale, found in (((1, 1), hausdorff95_2d(*masks)), (spacing, hausdorff95_2d(*masks, spacing))):
        apart = cdist(borders[0] * scale, borders[1] * scale)
        expected = max(np.percentile(apart.min(1), 95), np.percentile(apart.min(0), 95))
        assert found == pytest.approx(expected, abs=1e-12)


def brute_hd95(first, second, affine):
    surfaces = []
    for mask in (first, second):
        padded = np.pad(mask, 1)
        inner = mask.copy()
        for axis in range(3):
            for step in (-1, 1):
                inner &= np.roll(padded, step, axis)[1:-1, 1:-1, 1:-1]
        index = np.argwhere(mask & ~inner)[:, ::-1]
        surfaces.append(index @ affine[:3, :3].T + affine[:3, 3])
    apart = cdist(*surfaces)
    return max(np.percentile(apart.min(1), 95), np.percentile(apart.min(0), 95))


def test_groups_are_means_over_structures(scores):
    rows, group = scores["rest"]["structures"], scores["rest"]["groups"]["bones"]
    for key in ("dice", "hd95_mm", "tre_mean_mm"):
        assert group[key] == pytest.approx((rows["pelvis"][key] + rows["femur"][key]) / 2)
    assert group["structures"] == 2
    assert scores["rest"]["groups"]["soft organs"]["dice"] == rows["liver"]["dice"]
    flat = scores["rest"]["held_out"]
    expected = np.mean([flat["structures"][name]["dice"] for name in ("pelvis", "femur")])
    assert flat["groups"]["bones"]["dice"] == pytest.approx(expected)


def test_small_silhouettes_are_left_out(case):
    pixels = {name: int(mask.sum()) for name, mask in case.truth.held_out[0].masks.items()}
    smallest = min(pixels, key=pixels.get)
    limit = (pixels[smallest] + 0.5) * PIXEL_MM2
    flat = score_case(case, REST, minimum_mm2=limit)["held_out"]
    assert smallest not in flat["views"]["held out 1"]
    assert set(flat["views"]["held out 1"]) == set(pixels) - {smallest}
    assert flat["minimum_mm2"] == limit
    kept = score_case(case, REST, minimum_mm2=limit - PIXEL_MM2)["held_out"]
    assert kept["views"]["held out 1"][smallest]["pixels"] == pixels[smallest]


@pytest.mark.parametrize(
    ("pitch", "pixels", "is_scored"),
    [(1.552, 500, True), (1.552, 499, False), (2.15, 261, True), (2.15, 260, False), (0.776, 1998, True)],
)
def test_the_papers_limit_is_an_area_whatever_the_pixels(case, pitch, pixels, is_scored):
    """500 pixels of DeepFluoro, and as much of a bone on any other detector."""
    mask = np.zeros(scored_case.PIXELS, bool)
    mask.reshape(-1)[:pixels] = True
    masks = {"pelvis": np.ones(scored_case.PIXELS, bool), "femur": mask, "liver": mask & False}
    camera = scored_case.view(0.4)
    view = HeldOutView("held out", camera, (pitch, pitch), masks)
    flat = score_case(replace_truth(case, labels=None, held_out=(view,)), REST)["held_out"]
    assert set(flat["structures"]) == ({"pelvis", "femur"} if is_scored else {"pelvis"})
    assert flat["left_out"] == (["liver"] if is_scored else ["femur", "liver"])


def test_a_structure_pushed_away_scores_worst_and_not_nothing(case):
    away = np.eye(4)
    away[2, 3] = 400.0
    table = score_case(case, Motion(scored_case.field_of(away)), minimum_mm2=50 * PIXEL_MM2)
    fixed = case.truth.labels
    far = np.linalg.norm(fixed.affine[:3, :3] @ fixed.shape[::-1])
    for row in table["structures"].values():
        assert row["dice"] == 0 and row["lost"] and row["hd95_mm"] == pytest.approx(far)
    for row in table["held_out"]["structures"].values():
        assert row["dice"] == 0 and row["lost"] == 2
        assert row["hd95_px"] == pytest.approx(np.hypot(*scored_case.PIXELS))
    assert json.loads(json.dumps(table, allow_nan=False)) == table


def test_a_structure_that_the_truth_lacks_has_no_score(case):
    voxels = np.where(case.truth.labels.voxels == 3, 0, case.truth.labels.voxels)
    without = dataclasses.replace(
        case, truth=dataclasses.replace(case.truth, labels=case.truth.labels.with_voxels(voxels), held_out=())
    )
    table = score_case(without, TRUE)
    assert table["structures"]["femur"]["dice"] is None and table["structures"]["femur"]["hd95_mm"] is None
    assert table["groups"]["bones"]["dice"] == table["structures"]["pelvis"]["dice"]
    assert table["groups"]["bones"]["structures"] == 1
    json.dumps(table, allow_nan=False)


def test_labels_cut_off_by_a_grids_end_are_said(case):
    affine, shape = scored_case.oblique((2.0, 1.5, 2.0), (56, 60, 56), False, (0.0, 0.1, 0.0))
    assert not score_case(case, TRUE)["structures"]["liver"]["cut_off"]
    cut = scored_case.drawn_case(views=0, truth_grid=(affine, (33, *shape[1:])))
    row = score_case(cut, TRUE)["structures"]["liver"]
    assert row["cut_off"] and row["dice"] > 0.92  # what both show is compared


def test_silhouettes_see_what_moves_out_of_the_ct():
    """Without true labels the warped ones lie on a grid with room for the motion."""
    away = np.eye(4)
    away[:3, 3] = (0.0, 0.0, 28.0)  # the CT ends 42 mm from its middle
    case = scored_case.drawn_case(away, labels=None, ct=None)
    table = score_case(case, Motion(scored_case.field_of(away)), minimum_mm2=50 * PIXEL_MM2)
    assert "dice" not in table["structures"]["pelvis"]
    for row in table["held_out"]["structures"].values():
        assert row["dice"] > 0.94
    assert table["structures"]["liver"]["tre_max_mm"] < 1e-3
    assert table["structures"]["liver"]["rest_tre_mean_mm"] == pytest.approx(28.0, abs=1e-3)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.int32, np.int64])
def test_labels_of_any_integer_type(case, kind):
    source, fixed = case.study.source_segmentation, case.truth.labels
    other = replace_study(case, source_segmentation=source.with_voxels(source.voxels.astype(kind)))
    other = replace_truth(other, labels=fixed.with_voxels(fixed.voxels.astype(kind)), held_out=())
    expected = score_case(replace_truth(case, held_out=()), TRUE)
    assert score_case(other, TRUE)["structures"] == expected["structures"]


def test_room_is_bounded_when_a_field_explodes(case):
    source = case.study.source_segmentation
    field = scored_case.field_of(np.diag([1e4, 1e4, 1e4, 1.0]))
    room = room_for(source, field)
    assert (np.array(room.shape[::-1]) * room.spacing < 2 * 160 + 120).all()


def test_a_fold_is_counted_on_the_cts_voxels_whatever_the_fields_grid():
    """u(x) = (a(x) - x, 0, 0) folds where a falls: known without any grid."""
    affine, shape = scored_case.oblique((1.0, 2.0, 2.0), (61, 12, 11), True, (0.0, 0.0, 0.0))
    ct = Volume(np.zeros(shape, np.float32), affine)
    for spacing in (1.0, 2.0):  # nodes at the kinks of a, so that trilinear interpolation is exact
        nodes = np.diag([spacing] * 3 + [1.0])
        nodes[:3, 3] = -40
        count = int(80 / spacing) + 1
        points = scored_case.world_points(nodes, (count,) * 3)
        x = points[..., 0]
        along = np.where(x < 0, 2 * x, np.where(x < 6, -x, x * 0.5 - 9))
        vectors = np.zeros_like(points)
        vectors[..., 0] = along - x
        table = smoothness(DisplacementField(vectors, nodes), ct)
        # Slopes 2, -1 and 0.5, and by central differences their means at the kinks: 0.5 at 0, -0.25 at 6.
        slopes = np.array([2.0] * 30 + [0.5] + [-1.0] * 5 + [-0.25] + [0.5] * 24)
        assert table["folds_percent"] == pytest.approx(100 * (slopes <= 0).mean())
        assert table["sd_log_jacobian"] == pytest.approx(np.log(slopes[slopes > 0]).std(), rel=1e-5)


def test_smoothness_in_slabs_is_that_of_the_whole(monkeypatch):
    import PolyPoseLib.evaluation.benchmark.smoothness as module

    rng = np.random.default_rng(3)
    affine, shape = scored_case.oblique((3.0, 3.0, 4.0), (15, 14, 13))
    field = DisplacementField(rng.normal(0, 2.0, (*shape, 3)), affine)
    grid = Volume(np.zeros(shape, np.float32), affine)
    whole = smoothness(field, grid)
    monkeypatch.setattr(module, "_VOXELS_AT_ONCE", 400)
    assert smoothness(field, grid) == pytest.approx(whole)
    assert 0 < whole["folds_percent"] < 100


def test_an_affine_motion_has_its_own_determinant():
    ct = Volume(np.zeros((9, 8, 7), np.float32), scored_case.oblique((2.0, 3.0, 4.0), (7, 8, 9))[0])
    stretched = np.diag([1.2, 0.9, 1.1, 1.0])
    assert smoothness(scored_case.field_of(stretched), ct)["sd_log_jacobian"] < 1e-5
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    assert smoothness(scored_case.field_of(mirrored), ct) == {"folds_percent": 100.0, "sd_log_jacobian": None}


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda case: replace_truth(case, labels=None, field=None, poses={}, held_out=()), "no truth"),
        (lambda case: replace_study(case, source_segmentation=None), "no label map"),
        (lambda case: replace_truth(case, labels=without_labels(case)), "number them"),
        (lambda case: replace_truth(case, held_out=(wrong_view(case, "pelvis", (3, 3)),)), "pixels"),
        (
            lambda case: replace_truth(case, held_out=(wrong_view(case, "spine", scored_case.PIXELS),)),
            '"spine", which',
        ),
        (lambda case: replace_truth(case, labels=fractions(case)), "whole numbers"),
    ],
)
def test_a_case_that_cannot_be_scored_is_refused_by_one_sentence(case, change, word):
    with pytest.raises(InputError, match=word):
        score_case(change(case), REST)


def replace_truth(case, **fields):
    return dataclasses.replace(case, truth=dataclasses.replace(case.truth, **fields))


def replace_study(case, **fields):
    return dataclasses.replace(case, study=dataclasses.replace(case.study, **fields))


def without_labels(case):
    return case.truth.labels.with_voxels(np.zeros_like(case.truth.labels.voxels))


def fractions(case):
    return case.truth.labels.with_voxels(case.truth.labels.voxels.astype(np.float32))


def wrong_view(case, name, shape):
    view = case.truth.held_out[0]
    return HeldOutView(view.name, view.camera, view.pixel_spacing_mm, {name: np.ones(shape, bool)})
