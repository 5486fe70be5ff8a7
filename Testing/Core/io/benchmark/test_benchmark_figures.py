"""Figures: which way is up and left, what is coloured how, and that every number drawn is the rows'."""

import dataclasses

import numpy as np
import pytest
import scored_case
import torch
from benchmark_rows import row

from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.options import Weighting
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.figures import canvas, draw_case, write_figures
from PolyPoseLib.io.benchmark.figures.curves import draw_curves
from PolyPoseLib.io.benchmark.figures.deformation import contributions, draw_deformation
from PolyPoseLib.io.benchmark.figures.overlays import composite, mean_difference
from PolyPoseLib.io.benchmark.figures.straight import (
    AXIAL,
    CORONAL,
    SAGITTAL,
    in_patient,
    richest_slice,
    straight_grid,
    unmoved,
)
from PolyPoseLib.warp.dense import warp_volume
from PolyPoseLib.warp.weights import distance_maps

pytest.importorskip("matplotlib")


@pytest.fixture(autouse=True)
def coarse_pictures(monkeypatch):
    """Pixels take time, and these pictures are only looked for."""
    monkeypatch.setattr(canvas, "DPI", 50)


@pytest.fixture(scope="module")
def case():
    return scored_case.drawn_case(views=0)


def brightest(picture):
    return np.array(np.unravel_index(np.nanargmax(picture), picture.shape)) / picture.shape


def test_the_patients_left_is_right_and_superior_is_up_whatever_the_scans_axes():
    """One bright voxel at the patient's left, back and top, in a scan whose axes are oblique and left-handed."""
    affine, shape = scored_case.oblique((3.0, 3.0, 3.0), (30, 30, 30), True, (0.2, -0.3, 0.4))
    voxels = np.zeros(shape, np.float32)
    place = np.rint(np.linalg.inv(affine) @ [20.0, 15.0, 25.0, 1.0]).astype(int)[:3]
    voxels[tuple(place[::-1])] = 1000.0
    ct = Volume(voxels, affine)
    straight = warp_volume(ct, unmoved(), straight_grid(ct), outside=np.nan)
    assert straight.to_world(
        np.array(np.unravel_index(np.nanargmax(straight.voxels), straight.shape))[::-1]
    ) == (pytest.approx([20.0, 15.0, 25.0], abs=3.0))
    at = np.unravel_index(np.nanargmax(straight.voxels), straight.shape)
    row_at, column_at = brightest(CORONAL.cut(straight.voxels, at[1]))
    assert row_at < 0.45 and column_at > 0.55  # superior is up, left is on the right
    row_at, column_at = brightest(SAGITTAL.cut(straight.voxels, at[2]))
    assert row_at < 0.45 and column_at > 0.55  # posterior is on the right
    row_at, column_at = brightest(AXIAL.cut(straight.voxels, at[0]))
    assert row_at > 0.55 and column_at > 0.55  # posterior is below


def test_the_straight_grid_holds_the_patient_and_no_more():
    affine, shape = scored_case.oblique((2.0, 2.0, 4.0), (60, 50, 40))
    voxels = np.full(shape, -1000.0, np.float32)
    voxels[10:20, 20:40, 15:35] = 40.0
    grid = straight_grid(Volume(voxels, affine))
    body = scored_case.world_points(affine, shape)[10:20, 20:40, 15:35].reshape(-1, 3)
    low, high = grid.to_world(np.zeros(3)), grid.to_world(np.array(grid.shape[::-1]) - 1)
    assert (low <= body.min(0)).all() and (high >= body.max(0)).all()
    assert (high - low < np.ptp(body, axis=0) + 45).all()
    with pytest.raises(InputError, match="no patient"):
        straight_grid(Volume(np.full(shape, -1000.0, np.float32), affine))


def test_what_agrees_is_grey_and_what_does_not_is_green_or_magenta():
    true, other = np.array([[1.0, 1.0, 0.0, 0.5]]), np.array([[1.0, 0.0, 1.0, 0.5]])
    assert composite(true, other).tolist() == [[[1, 1, 1], [0, 1, 0], [1, 0, 1], [0.5, 0.5, 0.5]]]


def test_differences_are_taken_where_both_reach():
    true, other = np.array([0.0, 100.0, -1000.0, np.nan]), np.array([50.0, 0.0, -1000.0, 7.0])
    assert mean_difference(true, other) == 75.0
    assert np.isnan(mean_difference(np.array([np.nan]), np.array([1.0])))


def test_lungs_are_in_the_patient_and_the_room_is_not():
    hu = np.full((20, 20), -1000.0)
    hu[4:16, 4:16] = 0.0
    hu[8:12, 8:12] = -800.0
    hu[0, 0] = np.nan
    inside = in_patient(hu)
    assert inside[10, 10] and inside[5, 5] and not inside[0, 0] and not inside[2, 10]


def test_the_slice_that_shows_most():
    labels = np.zeros((5, 6, 7), np.uint8)
    labels[2, 4, 1:5] = labels[1:4, 4, 3] = 1
    assert [richest_slice(labels, plane) for plane in (AXIAL, CORONAL, SAGITTAL)] == [2, 4, 3]
    assert richest_slice(np.zeros((5, 6, 7)), CORONAL) == 3


def test_weights_are_one_in_the_bone_where_its_pose_puts_it(case):
    motion = Motion(scored_case.field_of(), {"femur": scored_case.MOTION})
    inverse = np.linalg.inv(scored_case.MOTION)
    middle = inverse[:3, :3] @ scored_case.SHAPES["femur"][1] + inverse[:3, 3]
    points = np.array([[middle, scored_case.SHAPES["pelvis"][1], (40.0, 40.0, 40.0)]])
    names, found = contributions(case, motion, Weighting("rigid", "moving"), points)
    assert names == ("pelvis", "femur") and found.shape == (1, 3, 2)
    assert found.sum(axis=-1) == pytest.approx(1.0)
    assert found[0, 0, 1] > 0.999 and found[0, 1, 0] > 0.999  # the anchor has no pose and stays
    assert 0.01 < found[0, 2, 1] < 0.99


def test_weights_are_those_of_the_motion_itself(case):
    """The paper's are m / (1 + d^2), of the distances in the CT whatever has moved."""
    motion = Motion(scored_case.field_of(), {"femur": scored_case.MOTION})
    structures = case.study.structures
    inside = case.study.ct.to_world(np.argwhere(structures.mask("femur"))[:, ::-1]).mean(axis=0)
    points = inside + np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 30.0)])
    maps = distance_maps(structures, case.study.ct.affine, spacing_mm=3.0)
    distance = maps(torch.from_numpy(points)).numpy().T
    mass = structures.volume_share() / (1 + distance**2)
    names, found = contributions(case, motion, Weighting("mass", "fixed"), points)
    assert found == pytest.approx(mass / mass.sum(axis=1, keepdims=True), abs=1e-6)
    assert found[0, names.index("femur")] < 0.9999  # of the default's form it is 1 in the bone
    even = 1 / (1 + 0.3 * distance**2)
    _, found = contributions(case, motion, Weighting("epsilon", "fixed", 0.3), points)
    assert found == pytest.approx(even / even.sum(axis=1, keepdims=True), abs=1e-6)


@pytest.mark.parametrize("weighting", [None, Weighting("mass", "fixed")])
def test_weights_are_drawn_of_motions_that_poses_make(case, weighting):
    """One body for the whole patient has poses, and no weights."""
    motion = Motion(scored_case.field_of(), {"femur": scored_case.MOTION}, weighting=weighting)
    grid = straight_grid(case.study.ct)
    warped = warp_volume(case.study.ct, unmoved(), grid, outside=np.nan)
    figure = draw_deformation(case, motion, warped, warped.with_voxels(warped.voxels > 200), "a case")
    titles = [place.get_title() for place in figure.axes if place.get_title()]
    told = ["weights of the structures' motions"] if weighting else []
    assert titles == ["displacement, coronal", *told] and len(figure.legends) == len(told)


@pytest.mark.long
def test_pictures_of_a_case(case, tmp_path):
    weighting = Weighting("rigid", "moving")
    motion = Motion(scored_case.field_of(), {"femur": scored_case.MOTION}, weighting=weighting)
    names = draw_case(case, motion, tmp_path, "a $ystem_name")
    assert names == ["overlay.png", "projection.png", "deformation.png"]
    assert sorted(each.name for each in tmp_path.iterdir()) == sorted(names)
    for name in names:
        assert (tmp_path / name).read_bytes()[:4] == b"\x89PNG"


def test_pictures_of_a_case_without_a_true_ct_or_poses(case, tmp_path):
    without = dataclasses.replace(case, truth=dataclasses.replace(case.truth, ct=None, labels=None))
    assert draw_case(without, Motion(scored_case.field_of()), tmp_path) == ["deformation.png"]


def rows_of(systems, views=("2x30", "2x180", "9x180")):
    return [
        row(system, f"s{n}", 0.5 + 0.1 * place + 0.01 * n, views=each, folds=place * 0.5)
        for place, system in enumerate(systems)
        for each in views
        for n in range(2)
    ]


def test_every_mean_is_drawn_where_it_belongs():
    rows = rows_of(("rest", "polypose", "dense-r3"))
    figure = draw_curves(rows)
    assert figure is not None
    places = figure.axes
    assert len(places) == 4  # Dice and folds, over 180 and over 30 degrees
    assert [place.get_title() for place in places[:2]] == ["over 180 degrees", "over 30 degrees"]
    for place in places[:2]:
        drawn = {round(float(y), 9) for line in place.lines for y in line.get_ydata()}
        assert drawn == {0.505, 0.605, 0.705}
    assert [round(x) for x in places[0].get_xticks()] == [2, 9]
    for place in places[2:]:
        assert {float(y) for line in place.lines for y in line.get_ydata()} == {0.0, 0.5, 1.0}
        low, high = place.get_ylim()
        assert low < 0 and high > 1


def test_unfinished_systems_are_hollow_and_failed_ones_absent():
    rows = rows_of(("polypose", "b", "c"), ("2x30",))
    rows[3] = row("b", "s1", status="failed", reason="x", views="2x30")
    rows[4] = row("c", "s0", status="failed", reason="x", views="2x30")
    rows[5] = row("c", "s1", status="failed", reason="x", views="2x30")
    figure = draw_curves(rows)
    assert figure is not None
    (legend,) = figure.legends
    texts = [each.get_text() for each in legend.get_texts()]
    assert texts == ["polypose", "b", "hollow: not finished on every case"]
    hollow = [line for line in figure.axes[0].lines if line.get_markerfacecolor() == "#ffffff"]
    assert [float(line.get_ydata()[0]) for line in hollow] == [0.6]


def test_seventeen_systems_differ_without_colours():
    figure = draw_curves(rows_of([f"system {n}" for n in range(17)]))
    assert figure is not None
    handles = figure.legends[0].legend_handles
    assert len({(each.get_marker(), each.get_linestyle(), each.get_color()) for each in handles}) == 17
    assert len({(each.get_marker(), each.get_linestyle()) for each in handles}) >= 15


def test_figures_are_one_per_data_set(tmp_path):
    other = [{**each, "dataset": "../o$ther"} for each in rows_of(("a", "b"), ("2x30",))]
    odd = [{**row("a", "s0", 0.5, views="sweep"), "dataset": "odd"}]
    failed = [{**row("a", "s0", status="failed", reason="x"), "dataset": "failed"}]
    (tmp_path / "in").mkdir()
    names = write_figures(rows_of(("a", "b"), ("2x30",)) + other + odd + failed, tmp_path / "in")
    assert len(names) == 4 and names[:2] == ["figure-drawn-views.png", "figure-drawn-views.svg"]
    assert sorted(each.name for each in (tmp_path / "in").iterdir()) == sorted(names)
    assert [each.name for each in tmp_path.iterdir()] == ["in"]
    with pytest.raises(InputError, match="no rows"):
        write_figures([], tmp_path)


@pytest.mark.parametrize("seed", range(2))
def test_no_point_lies_beyond_the_limits_that_its_row_shares(seed):
    """The arc that is drawn last may hold the lowest and the highest of all."""
    rng = np.random.default_rng(seed)
    rows = [
        row(
            system,
            f"s{n}",
            float(rng.uniform(0.05, 0.99)),
            views=views,
            folds=float(10 ** rng.uniform(-4, 2)),
        )
        for system in ("a", "b", "polypose", "rest")
        for views in ("2x180", "3x120", "2x60", "4x30")
        for n in range(2)
    ]
    figure = draw_curves(rows)
    assert figure is not None and len(figure.axes) == 8
    for place in figure.axes:
        low, high = place.get_ylim()
        drawn = [float(y) for line in place.lines for y in line.get_ydata()]
        assert len(drawn) >= 8 and low < min(drawn) and max(drawn) < high
