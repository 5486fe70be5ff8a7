"""What is rendered of a CT: its bones and its soft tissue, or, of bones in air, what they add to soft tissue."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import phantom

from PolyPoseLib.data.volume import WATER_ATTENUATION_PER_MM, Volume
from PolyPoseLib.registration.scene import (
    AIR_HU,
    SOFT_TISSUE_HU,
    Scene,
    body_points,
    holds_bones_alone,
    with_air,
)
from PolyPoseLib.rendering.rigid import Body


@pytest.fixture(scope="module")
def whole():
    return phantom()


@pytest.fixture(scope="module")
def bare(whole):
    """The same bones in air, as segmented bones are exported."""
    ct, structures = whole
    return Volume(np.where(structures.labels > 0, ct.voxels, -1000.0), ct.affine), structures


def test_bones_in_air_are_told_from_a_whole_ct(whole, bare):
    assert holds_bones_alone(*bare) and not holds_bones_alone(*whole)


def test_a_patient_cropped_to_the_skin_is_whole(whole):
    ct, structures = whole
    inside = np.argwhere(ct.voxels > -300)
    box = tuple(slice(low, high + 1) for low, high in zip(inside.min(0), inside.max(0), strict=True))
    cropped = type(structures)(structures.names, structures.labels[box])
    assert not holds_bones_alone(Volume(ct.voxels[box], ct.affine), cropped)


def test_bones_in_air_add_what_they_add_to_soft_tissue(whole, bare):
    """A body is the difference to the soft tissue that fills its place, in air as well as in a patient."""
    water = WATER_ATTENUATION_PER_MM * (1 + SOFT_TISSUE_HU / 1000)
    for there, alone in zip(
        Scene(*whole, "pelvis").bodies(3.0), Scene(*bare, "pelvis").bodies(3.0), strict=True
    ):
        assert there.voxels.sum() == pytest.approx(alone.voxels.sum(), rel=0.2)
        assert alone.voxels.max() < there.voxels.max() + 0.2 * water


def test_bones_in_air_have_no_soft_tissue_and_no_border(bare):
    scene = Scene(*bare, "pelvis")
    assert scene.bare
    assert np.abs(scene.soft.voxels).max() < 1e-3 * WATER_ATTENUATION_PER_MM
    outside = scene.owners == 0
    assert np.abs(scene.whole.voxels[outside]).max() < 1e-3 * WATER_ATTENUATION_PER_MM


@pytest.mark.parametrize(("low", "high"), [(-160, 240), (-150, 250), (-200, 300)])
def test_a_ct_clipped_to_soft_tissue_has_its_air_again_and_the_rest_as_it_is(whole, low, high):
    ct, structures = whole
    clipped = Volume(np.clip(ct.voxels, low, high).astype(np.float32), ct.affine)
    mended = with_air(clipped).voxels
    air = ct.voxels <= low
    assert (mended[air] == AIR_HU).all()
    np.testing.assert_array_equal(mended[~air], clipped.voxels[~air])
    outside = Scene(*whole, "pelvis").whole.voxels == 0
    assert outside.any() and not Scene(clipped, structures, "pelvis").whole.voxels[outside].any()


def test_no_other_ct_gets_air(whole):
    ct, _structures = whole
    inside = np.argwhere(ct.voxels > -300)
    box = tuple(slice(low, high + 1) for low, high in zip(inside.min(0), inside.max(0), strict=True))
    soft = (
        np.random.default_rng(0).normal(-60, 20, (20, 20, 20)).astype(np.float32)
    )  # no air, lowest value near -140
    for voxels in (ct.voxels, np.clip(ct.voxels, -1024, 400), np.clip(ct.voxels, -100, 300), soft):
        given = Volume(np.asarray(voxels, np.float32), ct.affine)
        assert with_air(given) is given
    cropped = Volume(ct.voxels[box], ct.affine)
    assert with_air(cropped) is cropped


@pytest.mark.parametrize("seed", range(4))
def test_every_body_has_points_whether_dense_thin_or_nothing(seed):
    """An airway is thinner than what fills its place; a structure may be lost between coarse voxels."""
    rng = np.random.default_rng(seed)
    voxels = np.zeros((9, 10, 11), np.float32)
    voxels[3:6, 4:7, 2:8] = rng.uniform(0.5, 1.0, (3, 3, 6))
    affine = np.diag([2.0, 2.0, 3.0, 1.0])
    body = Body(voxels, affine, rng.normal(size=3))
    dense, thin, nothing = (body_points(replace(body, voxels=sign * voxels)) for sign in (1, -1, 0))
    assert len(dense) == 54 and np.isfinite(dense).all()
    np.testing.assert_array_equal(thin, dense)
    np.testing.assert_array_equal(nothing, body.centre[None])
