"""The grid, the resampled CT and the units of fields that all 3D/3D systems share."""

import dataclasses

import numpy as np
import pytest
from ball_views import orbit, xray_of_balls
from fdk_case import FdkCase
from moved_volumes import ORIGIN, SHAPE, SPACING
from scipy.spatial.transform import Rotation

from PolyPoseLib.baselines.packages import is_installed
from PolyPoseLib.baselines.volumes import pair as pair_module
from PolyPoseLib.baselines.volumes.pair import (
    VolumePair,
    covering_lps_grid,
    pair_of,
    resampled_ct,
    seen_by_all,
)
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

BALL = (np.zeros(3), 20.0, 0.02)


def oblique_ct(seed, shape=(30, 26, 34)):
    """A CT on an oblique grid of any handedness, with a bright blob at a known point."""
    rng = np.random.default_rng(seed)
    axes = Rotation.random(random_state=seed).as_matrix() @ np.diag([rng.choice([-1, 1]), 1, 1])
    affine = np.eye(4)
    affine[:3, :3] = axes * rng.uniform(1.0, 5.0, 3)
    affine[:3, 3] = rng.uniform(-100, 100, 3)
    ct = Volume(np.zeros(shape, np.float32), affine)
    place = ct.to_world((np.array(shape[::-1]) - 1) * rng.uniform(0.3, 0.7, 3))
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)[..., ::-1]
    away = np.linalg.norm(ct.to_world(index) - place, axis=-1)
    return ct.with_voxels((1500 * np.exp(-0.5 * (away / 10) ** 2) - 1000).astype(np.float32)), place


@pytest.mark.parametrize("seed", range(8))
def test_the_grid_covers_the_ct_and_the_ct_stays_in_place(seed):
    ct, place = oblique_ct(seed)
    grid = covering_lps_grid(ct)
    edges = np.stack(np.meshgrid(*[[-0.5, n - 0.5] for n in ct.shape[::-1]], indexing="ij"), -1).reshape(
        -1, 3
    )
    index = grid.to_index(ct.to_world(edges))
    assert index.min() > -1e-6 and (index <= np.array(grid.shape[::-1]) - 1 + 1e-6).all()
    assert 2 <= grid.spacing.min() == grid.spacing.max() <= 4
    hu = resampled_ct(ct, grid)
    weight = np.clip(hu + 1000, 0, None) ** 2
    pair = VolumePair(hu, hu, grid.affine[:3, 3], float(grid.spacing[0]), np.ones(hu.shape, bool))
    found = (pair.points() * weight[..., None]).sum((0, 1, 2)) / weight.sum()
    assert np.linalg.norm(found - place) < 1.0
    assert hu.min() == -1000


def test_units_and_axes_of_fields():
    nothing = np.zeros(SHAPE, np.float32)
    pair = VolumePair(nothing, nothing, ORIGIN, SPACING, np.ones(SHAPE, bool))
    kji = np.zeros((*SHAPE, 3))
    kji[..., 0], kji[..., 1], kji[..., 2] = 1, 2, 3
    field = pair.field_of_voxels(kji)
    np.testing.assert_allclose(field.sample(pair.points()[3, 4, 5]), [9, 6, 3])
    fixed, _ = pair.images()
    np.testing.assert_allclose(fixed.TransformIndexToPhysicalPoint((5, 4, 3)), pair.points()[3, 4, 5])


def test_a_thin_ct_is_refused():
    thin = Volume(np.zeros((3, 40, 40), np.float32), np.diag([2.0, 2.0, 2.0, 1.0]))
    with pytest.raises(InputError, match="only 6 mm thick"):
        covering_lps_grid(thin)


def test_padding_repeats_the_end_and_fields_leave_it_out():
    volumes = (np.random.default_rng(i).random((9, 12, 13)) for i in (0, 1))
    pair = VolumePair(*volumes, ORIGIN, SPACING, np.random.default_rng(2).random((9, 12, 13)) < 0.5)
    fixed, moving, seen = pair.padded_to(6)
    assert fixed.shape == moving.shape == seen.shape == (12, 12, 18)
    np.testing.assert_array_equal(seen[11], seen[8])
    np.testing.assert_array_equal(moving[:9, :, :13], pair.moving)
    np.testing.assert_array_equal(fixed[11], fixed[8])
    assert pair.field_of_voxels(np.zeros((*fixed.shape, 3))).shape == (9, 12, 13)


def test_seen_is_what_falls_on_good_pixels_of_every_view():
    """Against rays: a voxel's pixel, view by view, one voxel at a time."""
    grid = Volume(np.zeros((19, 23, 21), np.float32), np.diag([9.0, 9.0, 9.0, 1.0]))
    grid.affine[:3, 3] = [-90.0, -99.0, -81.0]
    mask = np.ones((40, 50), bool)
    mask[:9] = False
    cameras = orbit(2, 60, pixels=(40, 50), pitch_mm=(3.0, 3.0))
    xrays = [xray_of_balls(cameras[0], (BALL,), mask=mask), xray_of_balls(cameras[1], (BALL,))]
    seen = seen_by_all(xrays, grid)
    assert 0.05 < seen.mean() < 0.9
    for k, j, i in np.random.default_rng(0).integers(0, grid.shape, (300, 3)):
        point = grid.to_world(np.array([i, j, k]))
        good = []
        for xray, camera in zip(xrays, cameras, strict=True):
            column, row = camera.project(point)
            on = -0.5 < column < 49.5 and -0.5 < row < 39.5
            good.append(on and xray.mask[round(row), round(column)])
        assert seen[k, j, i] == all(good)


def test_the_reconstruction_has_the_range_of_the_ct():
    if not is_installed("itk.RTKPython"):
        pytest.skip("itk-rtk is not installed")
    pair = pair_of(FdkCase(count=2, arc_deg=30.0).study)
    assert pair.fixed.min() == -1000 and pair.fixed.max() <= pair.moving.max()
    assert pair.fixed.dtype == np.float32 and pair.seen.any()


def test_x_rays_of_different_parts_are_refused(monkeypatch):
    """Their reconstruction is no volume; it is stood in for, so that the packages need not be there."""
    study = FdkCase(count=2, arc_deg=90.0).study
    away = study.xrays[1].extrinsic.copy()
    away[0, 3] += 4000
    xrays = (study.xrays[0], dataclasses.replace(study.xrays[1], extrinsic=away))
    monkeypatch.setattr(pair_module, "reconstruct", lambda xrays, grid, threads: grid)
    with pytest.raises(InputError, match="No part of the CT is in all of the X-rays"):
        pair_of(dataclasses.replace(study, xrays=xrays))
