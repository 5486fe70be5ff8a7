"""Values of CTs: sound ones of every kind pass in silence, those off by an intercept are refused."""

import numpy as np
import pytest
from ct_values import as_volume, padded, random_ct

from PolyPoseLib.data.hounsfield import (
    HIGHEST_HU,
    bone_is_clipped,
    impossible_hounsfield_values,
    impossible_size,
    odd_hounsfield_values,
)
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.volumes import read_ct, write_volume

SEEDS = range(12)


def verdict(values: np.ndarray) -> str:
    """What reading these Hounsfield units would end with."""
    fault = impossible_hounsfield_values(as_volume(values))
    odd = odd_hounsfield_values(as_volume(np.maximum(values, -1000)), "the CT")
    return fault or " ".join(odd) or "silent"


def bones_alone(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Values of bones, and where they are."""
    values = random_ct(rng, air=0, bone=rng.uniform(0.5, 1))
    return values, rng.random(values.shape) < rng.uniform(0.02, 0.3)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("padding", [None, -1024, -2000, -2048, -3024])
def test_sound_cts_pass_whatever_their_padding(seed, padding):
    values = random_ct(np.random.default_rng(seed))
    assert verdict(values if padding is None else padded(values, padding)) == "silent"


@pytest.mark.parametrize("seed", SEEDS)
def test_metal_contrast_and_crops_without_air_pass(seed):
    rng = np.random.default_rng(seed)
    values = random_ct(rng)
    metal = np.where(rng.random(values.shape) < 0.003, 30000, values)
    contrast = np.where((values > 20) & (rng.random(values.shape) < 0.2), values + 350, values)
    for sound in (metal, contrast, random_ct(rng, air=0, bone=rng.uniform(0.1, 0.8))):
        assert verdict(sound) == "silent"


@pytest.mark.parametrize("seed", SEEDS)
def test_bones_alone_in_air_water_or_formalin_pass(seed):
    rng = np.random.default_rng(seed)
    bone, where = bones_alone(rng)
    assert verdict(np.where(where, bone, -1000)) == "silent"
    for fluid, noise in ((0, 30), (40, 60)):
        dense = np.where(where, 2 * bone + 300, fluid) + rng.normal(0, noise, bone.shape)
        assert verdict(dense) == "silent"


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("padding", [None, -1000, -1024, -2000, -3024])
def test_values_without_their_intercept_are_refused(seed, padding):
    raw = np.clip(random_ct(np.random.default_rng(seed)) + 1024, 0, 4095)
    assert "intercept was not applied" in verdict(raw if padding is None else padded(raw, padding))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("padding", [None, -3024])
def test_an_intercept_applied_twice_is_refused(seed, padding):
    twice = random_ct(np.random.default_rng(seed)) - 1024
    assert "applied twice" in verdict(twice if padding is None else padded(twice, padding))


def test_a_painted_phantom_passes_and_its_intercept_counts():
    """Few values stand for all tissues: air, water and two bones."""
    phantom = np.full((12, 20, 24), -1000.0)
    phantom[2:-2, 3:-3, 4:-4] = 40
    phantom[4:7, 6:9, 6:12], phantom[4:7, 11:14, 12:18] = 900, 1200
    assert verdict(phantom) == "silent"
    assert "applied twice" in verdict(phantom - 1024)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_clipped_ct_and_poor_calibration_are_warnings(seed):
    rng = np.random.default_rng(seed)
    values = random_ct(rng)
    assert "clipped to a window (-160 to 240 HU)" in verdict(np.clip(values, -160, 240))
    assert "clipped to a window" in verdict(np.clip(values, -1000, 400))
    assert verdict(np.clip(values, -1000, 1000)) == "silent"
    assert bone_is_clipped(as_volume(np.clip(values, -1000, 400)))
    assert not any(bone_is_clipped(as_volume(each)) for each in (values, np.clip(values, -1000, 1000)))
    cone_beam = np.where(values > -800, values - 300, values) + rng.normal(0, 60, values.shape)
    assert "not well calibrated" in verdict(cone_beam)
    assert "no voxel is bone" in verdict(np.minimum(values, 150))


def test_a_ct_that_was_masked_with_water_is_a_warning():
    bone, where = bones_alone(np.random.default_rng(0))
    assert "exactly 0 HU, which is water" in verdict(np.where(where, bone, 0))


@pytest.mark.parametrize("highest", [HIGHEST_HU + 1, 64511, 1e30])
def test_no_material_attenuates_more_than_metal(highest, tmp_path):
    values = random_ct(np.random.default_rng(0))
    values.flat[0] = highest
    write_volume(as_volume(values), tmp_path / "ct.nii.gz")
    with pytest.raises(InputError, match=r"ct\.nii\.gz: its highest value .* export the original CT\.$"):
        read_ct(tmp_path / "ct.nii.gz")
    values.flat[0] = HIGHEST_HU
    assert impossible_hounsfield_values(as_volume(values)) is None


def test_a_ct_of_a_few_voxels_is_refused(tmp_path):
    for shape, words in (((2, 2, 2), "needs 3 along each axis"), ((1, 9, 9), "one slice")):
        ct = Volume(np.linspace(-1000, 900, np.prod(shape)).reshape(shape).astype(np.float32), np.eye(4))
        assert words in str(impossible_size(ct))
        write_volume(ct, tmp_path / "ct.nii.gz")
        with pytest.raises(InputError, match=words):
            read_ct(tmp_path / "ct.nii.gz")
