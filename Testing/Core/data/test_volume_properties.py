"""Volumes on any grid: left-handed, turned, anisotropic."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.shear import sideways_drift, straightened
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.io.volumes import read_volume, write_volume


@st.composite
def volumes(draw: st.DrawFn) -> Volume:
    """Up to 6 voxels a side, any orientation of either handedness, spacing from 0.1 to 10 mm, within 2 m."""
    rng = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    shape = tuple(draw(st.integers(1, 6)) for _ in range(3))
    axes = Rotation.random(random_state=rng).as_matrix()
    if draw(st.booleans()):
        axes = np.linalg.qr(np.eye(3)[rng.permutation(3)])[0]
    axes[:, draw(st.integers(0, 2))] *= draw(st.sampled_from([1, -1]))
    affine = np.eye(4)
    affine[:3, :3] = axes @ np.diag(10 ** rng.uniform(-1, 1, 3))
    affine[:3, 3] = rng.uniform(-2000, 2000, 3)
    return Volume(rng.integers(0, 200, shape).astype(np.uint8), affine)


@given(volumes(), st.integers(0, 100))
def test_index_and_world_are_inverse(volume, seed):
    index = np.random.default_rng(seed).uniform(-50, 50, (20, 3))
    np.testing.assert_allclose(volume.to_index(volume.to_world(index)), index, atol=1e-7)


@given(volumes())
def test_spacing_corners_and_centre_belong_to_one_grid(volume):
    corners, ends = volume.corners(), np.array(volume.shape[::-1]) - 1
    np.testing.assert_allclose(corners.mean(axis=0), volume.bounds_center, atol=1e-9)
    assert np.linalg.norm(corners[-1] - corners[0]) == pytest.approx(
        np.linalg.norm(ends * volume.spacing), abs=1e-9
    )
    for axis in range(3):
        step = volume.to_world(np.eye(3)[axis]) - volume.to_world(np.zeros(3))
        assert np.linalg.norm(step) == pytest.approx(volume.spacing[axis])


@given(volumes())
def test_the_toolkit_puts_voxels_where_the_affine_does(volume):
    image = volume.to_sitk()
    for index in ((0, 0, 0), tuple(n - 1 for n in volume.shape[::-1])):
        point = image.TransformIndexToPhysicalPoint(index)
        np.testing.assert_allclose(point, volume.to_world(np.array(index)), atol=1e-6)
        assert image[index] == volume.voxels[index[::-1]]
    back = Volume.from_sitk(image)
    assert np.array_equal(back.voxels, volume.voxels)
    np.testing.assert_allclose(back.affine, volume.affine, atol=1e-6)


@pytest.mark.parametrize("ending", [".nii.gz", ".nrrd", ".mha"])
def test_files_keep_voxels_and_grid(tmp_path, ending):
    @given(volumes())
    def examples(volume):
        path = tmp_path / f"v{ending}"
        write_volume(volume, path)
        back = read_volume(path)
        assert np.array_equal(back.voxels, volume.voxels)
        assert back.same_grid(volume)

    examples()


@given(volumes())
def test_labels_stay_on_their_own_grid(volume):
    same = resample_labels_onto(volume, Volume(np.zeros(volume.shape), volume.affine))
    assert np.array_equal(same.voxels, volume.voxels)


@given(volumes(), st.floats(-1e-3, 1e-3), st.sampled_from([(0, 1), (1, 2), (2, 0)]))
def test_axes_that_rounding_bent_are_made_perpendicular(volume, bend, pair):
    axes, sizes = volume.affine[:3, :3].copy(), np.array(volume.shape[::-1])
    axes[:, pair[0]] += bend * axes[:, pair[1]] / volume.spacing[pair[1]] * volume.spacing[pair[0]]
    straight = straightened(axes, sizes)
    assert sideways_drift(straight, sizes)[0] < 1e-6
    assert np.sign(np.linalg.det(straight)) == np.sign(np.linalg.det(axes))
    np.testing.assert_allclose(np.linalg.norm(straight, axis=0), np.linalg.norm(axes, axis=0), rtol=1e-9)
