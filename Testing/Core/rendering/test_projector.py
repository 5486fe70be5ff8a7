"""The projector's images against closed forms, another program and resampled volumes."""

import importlib.util

import numpy as np
import pytest
import torch
from projector_cases import (
    VIEWS,
    camera_at,
    drr,
    gaussian,
    gaussian_integral,
    grid_affine,
    grid_points,
    random_case,
    relative_l2,
    unit_rays,
)
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.geometry.rigid import rigid_inverse


@pytest.mark.parametrize("view", VIEWS)
def test_uniform_box_is_the_chord_of_the_voxels_faces(view):
    shape, spacing = (21, 30, 26), np.array([2.0, 1.5, 3.0])
    camera = camera_at(view)
    source, rays = camera.source, unit_rays(camera)
    half = spacing * np.array(shape[::-1]) / 2
    with np.errstate(divide="ignore"):
        faces = np.stack([(-half - source) / rays, (half - source) / rays])
    chord = np.maximum(faces.max(axis=0).min(axis=-1) - faces.min(axis=0).max(axis=-1), 0)
    image = drr(np.full(shape, 0.02), grid_affine(shape, spacing), camera)
    np.testing.assert_allclose(image, 0.02 * chord, atol=1e-11)
    assert image.min() == 0 < image.max()


@pytest.mark.parametrize("step_mm", [7.0, 2.0])
def test_each_ray_is_a_midpoint_sum_of_trilinear_samples(step_mm):
    voxels, affine = (tensor.numpy() for tensor in random_case())
    camera = camera_at("tilted", 8, 9, field_mm=60)
    to_index = np.linalg.inv(affine)
    origin = to_index[:3, :3] @ camera.source + to_index[:3, 3]
    expected = np.zeros((8, 9))
    for pixel, ray in zip(np.ndindex(8, 9), unit_rays(camera).reshape(-1, 3), strict=True):
        direction = to_index[:3, :3] @ ray
        faces = np.stack(
            [(-0.5 - origin) / direction, (np.array(voxels.shape[::-1]) - 0.5 - origin) / direction]
        )
        near, far = faces.min(axis=0).max(), faces.max(axis=0).min()
        count = int(np.ceil((far - near) / step_mm)) if far > near else 0
        marks = near + (np.arange(count) + 0.5) * (far - near) / max(count, 1)
        points = origin + marks[:, None] * direction
        samples = map_coordinates(voxels.astype(float), points[:, ::-1].T, order=1, mode="nearest")
        expected[pixel] = samples.sum() * (far - near) / max(count, 1)
    assert (expected > 0).mean() > 0.5
    np.testing.assert_allclose(drr(voxels, affine, camera, step_mm=step_mm), expected, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("view", VIEWS)
def test_gaussian_body_has_its_closed_form(view):
    shape = (90, 70, 80)
    affine = grid_affine(shape, (2.0, 2.0, 2.5), center=(0.4, 0.3, -0.8))
    camera = camera_at(view)
    image = drr(gaussian(grid_points(shape, affine)), affine, camera, step_mm=1)
    # trilinear interpolation of a curve of width sigma adds h^2 / (12 sigma^2) or less
    assert relative_l2(image, gaussian_integral(camera)) < 3e-3


@pytest.mark.parametrize("view", VIEWS)
def test_ellipsoid_has_its_chord_length(view):
    shape, spacing = (96, 84, 90), 1.0
    semi_axes = np.array([38.0, 30.0, 41.0])
    affine = grid_affine(shape, (spacing,) * 3)
    # the share of each voxel inside, from its signed distance to the surface to first order
    points = grid_points(shape, affine)
    radius = np.linalg.norm(points / semi_axes, axis=-1)
    slope = np.linalg.norm(points / semi_axes**2, axis=-1) / np.maximum(radius, 1e-9)
    voxels = 0.02 * np.clip(0.5 + (1 - radius) / np.maximum(slope, 1e-9) / spacing, 0, 1)
    camera = camera_at(view, field_mm=120)
    source, rays = camera.source / semi_axes, unit_rays(camera) / semi_axes
    squared, along = (rays**2).sum(-1), rays @ source
    chord = 2 * np.sqrt(np.maximum(along**2 - squared * (source @ source - 1), 0)) / squared
    image = drr(voxels, affine, camera, dtype=torch.float32) / 0.02
    inner = chord > 30  # the edge, where the chord falls like a square root, is blurred by a voxel
    assert relative_l2(image[inner], chord[inner]) < 3e-3
    assert relative_l2(image, chord) < 2e-2
    assert abs(image.sum() / chord.sum() - 1) < 1e-3


@pytest.mark.parametrize("flip", [(1, 1, 1), (1, -1, 1), (-1, -1, 1)])
@pytest.mark.parametrize("view", ["anterior", "tilted"])
def test_a_voxel_cube_lands_on_its_pixel(view, flip):
    shape = (24, 26, 28)
    affine = grid_affine(shape, (2.0, 2.0, 2.0), flip=flip)
    voxels = np.zeros(shape)
    k, j, i = 5, 19, 8
    voxels[k : k + 3, j : j + 3, i : i + 3] = 1
    camera = camera_at(view, 120, 130, field_mm=60)
    image = drr(voxels, affine, camera, step_mm=0.25)
    middle = affine @ (i + 1, j + 1, k + 1, 1)
    rows, columns = np.indices(image.shape)
    found = np.array([(image * columns).sum(), (image * rows).sum()]) / image.sum()
    np.testing.assert_allclose(found, camera.project(middle[:3]), atol=0.02)
    magnification = camera.depth(middle[:3]) / camera.intrinsics[0, 0]
    assert image.sum() * magnification**2 == pytest.approx(27 * 8, rel=1e-2)


def test_flipped_and_permuted_axes_give_the_same_image():
    rng = np.random.default_rng(0)
    shape = (18, 22, 20)
    voxels = rng.random(shape)
    affine = grid_affine(shape, (3.0, 2.0, 2.5), Rotation.from_rotvec([0.2, -0.4, 0.3]).as_matrix())
    camera = camera_at("tilted", field_mm=90)
    expected = drr(voxels, affine, camera)
    for axis in range(3):  # i, j, k in turn: det = -1
        flipped = affine.copy()
        flipped[:3, 3] += affine[:3, axis] * (shape[2 - axis] - 1)
        flipped[:3, axis] *= -1
        assert np.linalg.det(flipped[:3, :3]) < 0
        np.testing.assert_allclose(
            drr(np.flip(voxels, 2 - axis).copy(), flipped, camera), expected, atol=1e-12
        )
    swapped = affine[:, [1, 0, 2, 3]]
    np.testing.assert_allclose(drr(voxels.swapaxes(1, 2).copy(), swapped, camera), expected, atol=1e-12)


@pytest.mark.parametrize("flip", [(1, 1, 1), (1, -1, 1)])
@pytest.mark.parametrize("view", VIEWS)
def test_an_oblique_grid_gives_the_image_of_the_resampled_volume(view, flip):
    sitk = pytest.importorskip("SimpleITK")
    rotation = Rotation.from_euler("xyz", [25, -15, 40], degrees=True).as_matrix()
    oblique = grid_affine((80, 90, 84), (2.0, 2.0, 2.5), rotation, flip, (3, 1, -2))
    straight = grid_affine((100, 100, 100), (2.0, 2.0, 2.0))
    voxels = gaussian(grid_points((80, 90, 84), oblique)).astype(np.float32)
    image = sitk.GetImageFromArray(voxels)
    image.SetSpacing((2.0, 2.0, 2.5))
    image.SetDirection((rotation @ np.diag(flip)).ravel().tolist())
    image.SetOrigin(oblique[:3, 3].tolist())
    reference = sitk.Image(100, 100, 100, sitk.sitkFloat32)
    reference.SetSpacing((2.0, 2.0, 2.0))
    reference.SetOrigin(straight[:3, 3].tolist())
    resampled = sitk.GetArrayFromImage(sitk.Resample(image, reference))
    camera = camera_at(view)
    assert relative_l2(drr(voxels, oblique, camera), drr(resampled, straight, camera)) < 2e-3


def test_moving_volume_and_camera_together_changes_nothing():
    rng = np.random.default_rng(3)
    voxels, camera = rng.random((12, 14, 16)), camera_at("oblique", field_mm=60)
    affine = grid_affine((12, 14, 16), (3.0, 3.0, 4.0))
    motion = np.eye(4)
    motion[:3, :3] = Rotation.random(random_state=1).as_matrix()
    motion[:3, 3] = (50, -20, 80)
    moved = camera.with_extrinsic(camera.extrinsic @ rigid_inverse(motion))
    np.testing.assert_allclose(drr(voxels, motion @ affine, moved), drr(voxels, affine, camera), atol=1e-9)


@pytest.fixture(scope="module")
def chest():
    """The chest CT as attenuation with one layer of air: programs differ only in the outer half voxel."""
    from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
    from PolyPoseLib.io.samples import cached_sample
    from PolyPoseLib.io.volumes import read_ct

    folder = cached_sample("chest")
    if folder is None:
        pytest.skip("the chest CT is not cached; run `python -m PolyPoseLib sample chest` first")
    ct = read_ct(folder / "ct.nii.gz")
    affine = ct.affine.copy()
    affine[:3, 3] -= affine[:3, :3].sum(axis=1)
    return Volume(np.pad(hounsfield_to_attenuation(ct.voxels), 1), affine)


@pytest.mark.skipif(importlib.util.find_spec("itk") is None, reason="itk-rtk is not installed")
@pytest.mark.parametrize("view", VIEWS)
def test_chest_ct_agrees_with_the_joseph_projector_of_rtk(chest, view):
    from PolyPoseLib.simulation.independent_projector import project, rtk_available

    if not rtk_available():
        pytest.skip("itk-rtk is not installed")
    camera = camera_at(view, 100, 120, field_mm=330, target=chest.bounds_center)
    expected = project(chest, camera, "rtk")
    found = drr(chest.voxels, chest.affine, camera, dtype=torch.float32)
    assert expected.max() > 4
    assert relative_l2(found, expected) < 1e-3
    assert np.corrcoef(found.ravel(), expected.ravel())[0, 1] > 1 - 1e-6


def test_a_source_inside_the_volume_sees_only_what_is_in_front():
    shape = (41, 41, 41)
    camera = Camera(intrinsics_matrix(100, 1, 3, 3), look_at((0, 0, 0), (0, 10, 0)), 3, 3)
    image = drr(np.ones(shape), grid_affine(shape, (1.0, 1.0, 1.0)), camera)
    assert image[1, 1] == pytest.approx(20.5)


def test_image_is_linear_in_the_volume():
    (a, affine), (b, _) = random_case(1), random_case(2)
    camera = camera_at("tilted")
    combined = drr(2 * a + 3 * b, affine, camera, dtype=torch.float32)
    separate = 2 * drr(a, affine, camera) + 3 * drr(b, affine, camera)
    np.testing.assert_allclose(combined, separate, rtol=1e-5, atol=1e-5)
