"""Volumes: frames, files of every kind, and sentences for what is wrong with them."""

import gzip
import warnings

import numpy as np
import pytest
import SimpleITK as sitk
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.volume import (
    Volume,
    hounsfield_to_attenuation,
    resample_labels_onto,
)
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.volumes import read_ct, read_volume, write_volume


def random_affine(rng: np.random.Generator, left_handed: bool) -> np.ndarray:
    """A random orthogonal affine with uneven spacing."""
    axes = Rotation.random(random_state=rng.integers(1 << 30)).as_matrix()
    if left_handed:
        axes[:, rng.integers(3)] *= -1
    affine = np.eye(4)
    affine[:3, :3] = axes * rng.uniform(0.4, 4, 3)
    affine[:3, 3] = rng.uniform(-300, 300, 3)
    return affine


def ct_like(rng: np.random.Generator, shape=(5, 6, 7)) -> np.ndarray:
    """Voxels with air, water and bone."""
    voxels = rng.integers(-1000, 1500, shape).astype(np.int16)
    voxels.flat[0], voxels.flat[1] = -1000, 1500
    return voxels


@pytest.mark.parametrize("left_handed", [False, True])
@pytest.mark.parametrize("ending", [".nii.gz", ".nii", ".nrrd", ".mha"])
def test_files_round_trip_any_direction(tmp_path, ending, left_handed):
    rng = np.random.default_rng(1)
    volume = Volume(ct_like(rng), random_affine(rng, left_handed))
    write_volume(volume, tmp_path / f"ct{ending}")
    back = read_volume(tmp_path / f"ct{ending}")
    assert np.array_equal(back.voxels, volume.voxels)
    assert back.same_grid(volume, 1e-3)
    assert (np.linalg.det(back.affine) < 0) == (np.linalg.det(volume.affine) < 0)


def test_points_and_indices_are_each_others_inverse():
    rng = np.random.default_rng(2)
    for left_handed in (False, True):
        volume = Volume(np.zeros((4, 5, 6)), random_affine(rng, left_handed))
        indices = rng.uniform(-3, 9, (50, 3))
        assert np.allclose(volume.to_index(volume.to_world(indices)), indices, atol=1e-9)
        image = volume.to_sitk()
        for index in indices[:5]:
            point = image.TransformContinuousIndexToPhysicalPoint(index.tolist())
            assert np.allclose(volume.to_world(index), point, atol=1e-8)
        assert np.allclose(volume.corners().mean(0), volume.bounds_center)


@pytest.mark.parametrize("seed", range(5))
def test_the_nearest_voxels_are_those_of_an_independent_resampler(seed):
    rng = np.random.default_rng(seed)
    volume = Volume(rng.integers(1, 200, (4, 5, 6)).astype(np.int16), random_affine(rng, seed % 2 == 1))
    index = rng.uniform(-2, 8, (200, 3))
    found = volume.voxels_at(index, -7)
    image = volume.to_sitk()
    for each, value in zip(index.tolist(), found.tolist(), strict=True):
        point = image.TransformContinuousIndexToPhysicalPoint(each)
        nearest = image.TransformPhysicalPointToIndex(point)
        held = all(0 <= n < size for n, size in zip(nearest, image.GetSize(), strict=True))
        assert value == (image[nearest] if held else -7)
    assert 20 < (found == -7).sum() < 195 and found.dtype == np.int16


def test_attenuation_is_zero_in_air_and_linear_above():
    hu = np.array([-3000, -2048, -1000, 0, 1000, 3000], dtype=np.float32)
    assert np.allclose(hounsfield_to_attenuation(hu), [0, 0, 0, 0.02, 0.04, 0.08], atol=1e-7)
    assert hounsfield_to_attenuation(hu)[2] == 0
    assert hounsfield_to_attenuation(hu).dtype == np.float32
    assert hu[0] == -3000


def test_padding_becomes_air(tmp_path):
    voxels = ct_like(np.random.default_rng(3))
    voxels[0] = -2048
    write_volume(Volume(voxels, np.eye(4)), tmp_path / "ct.nii.gz")
    ct = read_ct(tmp_path / "ct.nii.gz")
    assert ct.voxels.min() == -1000
    assert ct.voxels.dtype == np.float32
    assert np.array_equal(ct.voxels[1:], voxels[1:])


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (0, 255, "rescaled for display"),
        (0, 4095, "rescale intercept"),
        (-0.5, 1, "normalised"),
        (7, 7, "every voxel"),
    ],
)
def test_values_that_are_no_hounsfield_units_are_refused(tmp_path, low, high, words):
    voxels = np.linspace(low, high, 64, dtype=np.float32).reshape(4, 4, 4)
    write_volume(Volume(voxels, np.eye(4)), tmp_path / "ct.nii.gz")
    with pytest.raises(InputError, match=words):
        read_ct(tmp_path / "ct.nii.gz")


def test_wrong_dimensions_are_refused(tmp_path):
    image = sitk.GetImageFromArray(np.zeros((4, 5), np.float32))
    sitk.WriteImage(image, str(tmp_path / "flat.nii.gz"))
    with pytest.raises(InputError, match="2 dimensions"):
        read_volume(tmp_path / "flat.nii.gz")
    sitk.WriteImage(sitk.JoinSeries([sitk.Image(3, 4, 5, sitk.sitkInt16)] * 2), str(tmp_path / "four.nii.gz"))
    with pytest.raises(InputError, match="one time point"):
        read_volume(tmp_path / "four.nii.gz")
    sitk.WriteImage(sitk.Image([3, 4, 5], sitk.sitkVectorFloat32, 3), str(tmp_path / "vector.nrrd"))
    with pytest.raises(InputError, match="values per voxel"):
        read_volume(tmp_path / "vector.nrrd")
    write_volume(Volume(np.arange(20.0).reshape(1, 4, 5) - 1000, np.eye(4)), tmp_path / "slice.nii.gz")
    with pytest.raises(InputError, match="one slice"):
        read_ct(tmp_path / "slice.nii.gz")


def test_a_trailing_dimension_of_one_is_dropped(tmp_path):
    sitk.WriteImage(sitk.JoinSeries([sitk.Image(3, 4, 5, sitk.sitkInt16)]), str(tmp_path / "one.nii.gz"))
    assert read_volume(tmp_path / "one.nii.gz").shape == (5, 4, 3)


def test_nan_is_counted(tmp_path):
    voxels = np.zeros((3, 3, 3), np.float32)
    voxels[1, 1, :2] = np.nan
    write_volume(Volume(voxels, np.eye(4)), tmp_path / "ct.nii.gz")
    with pytest.raises(InputError, match="2 voxels are NaN"):
        read_volume(tmp_path / "ct.nii.gz")


def test_damaged_missing_and_foreign_files_give_one_sentence(tmp_path):
    rng = np.random.default_rng(4)
    write_volume(Volume(ct_like(rng, (20, 20, 20)), np.eye(4)), tmp_path / "ct.nii.gz")
    whole = (tmp_path / "ct.nii.gz").read_bytes()
    for ending in ("nrrd", "mha"):
        write_volume(Volume(ct_like(rng, (20, 20, 20)), np.eye(4)), tmp_path / f"ct.{ending}")
    nrrd, mha = ((tmp_path / f"ct.{ending}").read_bytes() for ending in ("nrrd", "mha"))
    cases = {
        "cut.nrrd": nrrd[: len(nrrd) // 2],
        "cut.mha": mha[: len(mha) // 2],
        "cut.nii": gzip.decompress(whole)[:5000],
        "cut.nii.gz": whole[: len(whole) // 2],
        "empty.nii.gz": b"",
        "noise.nrrd": rng.bytes(500),
        "noise.mha": rng.bytes(500),
        "text.nii": b"hello",
        "ct.xyz": whole,
        "bomb.nii": gzip.decompress(whole)[:40] + b"\x07\x00" + b"\xff\x7f" * 7 + gzip.decompress(whole)[56:],
    }
    for name, content in cases.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError) as caught:
            read_volume(tmp_path / name)
        assert name in str(caught.value)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="no such file"):
        read_volume(tmp_path / "absent.nii.gz")


def test_writing_where_nothing_can_be_written(tmp_path):
    volume = Volume(np.zeros((2, 2, 2), np.int16), np.eye(4))
    with pytest.raises(InputError, match="does not exist"):
        write_volume(volume, tmp_path / "no" / "ct.nii.gz")


def test_a_nifti_whose_only_place_is_a_sheared_sform_keeps_it(tmp_path):
    image = sitk.GetImageFromArray(ct_like(np.random.default_rng(5)))
    sitk.WriteImage(image, str(tmp_path / "ct.nii"))
    content = bytearray((tmp_path / "ct.nii").read_bytes())
    content[252:256] = np.array([0, 2], "<i2").tobytes()
    sform = np.array([[1, 0, 0, 0], [0, 1, 0.3, 0], [0, 0, 1, 0]], "<f4")
    content[280:328] = sform.tobytes()
    (tmp_path / "ct.nii").write_bytes(content)
    assert np.allclose(read_volume(tmp_path / "ct.nii").affine[:3, 2], [0, -0.3, 1])


def test_labels_are_resampled_by_nearest_neighbour():
    rng = np.random.default_rng(6)
    reference = Volume(np.zeros((9, 10, 11), np.int16), random_affine(rng, True))
    labels = Volume(rng.integers(0, 200, (12, 13, 14)).astype(np.uint8), random_affine(rng, False))
    labels.affine[:3, 3] += reference.bounds_center - labels.bounds_center
    found = resample_labels_onto(labels, reference)
    assert found.same_grid(reference)
    k, j, i = np.meshgrid(*(np.arange(n) for n in reference.shape), indexing="ij")
    index = labels.to_index(reference.to_world(np.stack([i, j, k], axis=-1)))
    nearest = np.rint(index).astype(int)
    inside = np.all((index > -0.49) & (index < np.array(labels.shape[::-1]) - 0.51), axis=-1)
    clear = inside & (np.abs(index - np.floor(index) - 0.5) > 1e-3).all(axis=-1)
    assert clear.sum() > 50
    expected = labels.voxels[nearest[clear][:, 2], nearest[clear][:, 1], nearest[clear][:, 0]]
    assert np.array_equal(found.voxels[clear], expected)


@pytest.mark.parametrize(
    ("voxels", "affine"),
    [
        (np.zeros((2, 2)), np.eye(4)),
        (np.zeros((0, 2, 2)), np.eye(4)),
        (np.zeros((2, 2, 2)), np.diag([1, 1, 0, 1])),
        (np.zeros((2, 2, 2)), np.full((4, 4), np.nan)),
        (np.zeros((2, 2, 2)), np.diag([1, 1, 1, 2])),
    ],
)
def test_a_volume_that_exists_is_valid(voxels, affine):
    with warnings.catch_warnings(), pytest.raises(InputError):
        Volume(voxels, affine)
