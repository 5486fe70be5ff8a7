"""The projector against closed forms, another program, resampled volumes and finite differences."""

import importlib.util

import numpy as np
import pytest
import torch
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at, rigid_inverse
from PolyPoseLib.rendering import projector
from PolyPoseLib.rendering.projector import render

VIEWS = {
    "anterior": ((0, -800, 0), (0, 0, 1)),
    "lateral": ((800, 0, 0), (0, 0, 1)),
    "oblique": ((300, -700, 250), (0, 0, 1)),
    "tilted": ((-500, -600, -150), (0.3, 0.1, 1)),
}


def camera_at(view, height=40, width=50, field_mm=200, target=(1.0, -2.0, 3.0)):
    """A camera 1000 mm from its detector, with a principal point off the centre."""
    offset, up = VIEWS[view]
    pitch = 1.25 * field_mm / max(height, width)
    intrinsics = intrinsics_matrix(1000, pitch, height, width)
    intrinsics[:2, 2] += (1.3, -0.7)
    target = np.asarray(target, float)
    return Camera(intrinsics, look_at(target + offset, target, up), height, width)


def drr(voxels, affine, *cameras, dtype=torch.float64, **options):
    intrinsics = torch.tensor(np.stack([camera.intrinsics for camera in cameras]))
    extrinsics = torch.tensor(np.stack([camera.extrinsic for camera in cameras]))
    images = render(
        torch.as_tensor(voxels).to(dtype),
        torch.as_tensor(affine),
        intrinsics,
        extrinsics,
        cameras[0].height,
        cameras[0].width,
        **options,
    )
    return images.numpy() if len(cameras) > 1 else images[0].numpy()


def grid_affine(shape, spacing, rotation=None, flip=(1, 1, 1), center=(0, 0, 0)):
    """A grid whose box is centred at `center`, of any direction matrix and handedness."""
    affine = np.eye(4)
    affine[:3, :3] = (np.eye(3) if rotation is None else rotation) @ np.diag(np.multiply(spacing, flip))
    affine[:3, 3] = center - affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2)
    return affine


def grid_points(shape, affine):
    index = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1)[..., ::-1]
    return index @ affine[:3, :3].T + affine[:3, 3]


def unit_rays(camera):
    directions = camera.pixel_directions()
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def relative_l2(found, expected):
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


SIGMAS = np.array([22.0, 15.0, 30.0])


def gaussian(points):
    """A smooth body of attenuation 0.02 / mm at its centre."""
    return 0.02 * np.exp(-0.5 * ((points / SIGMAS) ** 2).sum(-1))


def gaussian_integral(camera):
    source, rays = camera.source / SIGMAS, unit_rays(camera) / SIGMAS
    squared = (rays**2).sum(-1)
    along = rays @ source
    exponent = source @ source - along**2 / squared
    return 0.02 * np.sqrt(2 * np.pi / squared) * np.exp(-0.5 * exponent)


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
    magnification = camera.magnification_mm_per_px(middle[:3])
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
    from PolyPoseLib.imaging.volume import Volume, hounsfield_to_attenuation, read_ct
    from PolyPoseLib.sample import cached_sample

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
    from PolyPoseLib.evaluation.independent_projector import project, rtk_available

    if not rtk_available():
        pytest.skip("itk-rtk is not installed")
    camera = camera_at(view, 100, 120, field_mm=330, target=chest.bounds_center)
    expected = project(chest, camera, "rtk")
    found = drr(chest.voxels, chest.affine, camera, dtype=torch.float32)
    assert expected.max() > 4
    assert relative_l2(found, expected) < 1e-3
    assert np.corrcoef(found.ravel(), expected.ravel())[0, 1] > 1 - 1e-6


@pytest.mark.parametrize("view", ["anterior", "tilted"])
def test_gradcheck_in_volume_pose_and_intrinsics(view):
    rng = np.random.default_rng(7)
    camera = camera_at(view, 4, 5, field_mm=14)
    volume = torch.tensor(rng.random((4, 5, 3)), requires_grad=True)
    affine = torch.tensor(
        grid_affine((4, 5, 3), (4.0, 3.0, 3.5), Rotation.random(random_state=2).as_matrix())
    )
    pose = torch.tensor(rng.normal(size=(2, 6)) * 1e-3, requires_grad=True)
    intrinsics = torch.tensor(camera.intrinsics)[None].repeat(2, 1, 1).requires_grad_()

    def image(volume, pose, intrinsics):
        extrinsics = torch.tensor(camera.extrinsic) @ se3.exp(pose)
        return render(volume, affine, intrinsics, extrinsics, 4, 5, step_mm=0.9, chunk_samples=50)

    assert (image(volume, pose, intrinsics) > 0).any()
    assert torch.autograd.gradcheck(image, (volume, pose, intrinsics), eps=1e-7, atol=1e-4)


def test_pose_gradient_follows_the_image_of_a_body():
    shape = (60, 60, 60)
    affine = grid_affine(shape, (3.0, 3.0, 3.0))
    volume = torch.from_numpy(gaussian(grid_points(shape, affine))).float()
    camera = camera_at("oblique")
    intrinsics, extrinsic = torch.tensor(camera.intrinsics)[None], torch.tensor(camera.extrinsic)[None]
    weight = torch.linspace(-1, 1, 40 * 50).reshape(1, 40, 50)

    def score(pose):
        return (weight * render(volume, affine, intrinsics, extrinsic @ se3.exp(pose), 40, 50)).sum()

    pose = torch.zeros(1, 6, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(score(pose), pose)
    for index, step in enumerate([1e-3] * 3 + [0.05] * 3):
        change = torch.zeros(1, 6, dtype=torch.float64)
        change[0, index] = step
        slope = (score(change) - score(-change)).item() / (2 * step)
        assert gradient[0, index].item() == pytest.approx(slope, rel=0.02, abs=2e-3)


def random_case(seed=0, shape=(20, 24, 28)):
    rng = np.random.default_rng(seed)
    return torch.tensor(rng.random(shape), dtype=torch.float32), torch.tensor(
        grid_affine(shape, (3.0, 2.5, 2.0))
    )


def matrices(*cameras):
    return (
        torch.tensor(np.stack([camera.intrinsics for camera in cameras])),
        torch.tensor(np.stack([camera.extrinsic for camera in cameras])),
    )


def test_views_of_a_batch_are_the_single_views():
    volume, affine = random_case()
    cameras = [camera_at(view) for view in VIEWS]
    together = drr(volume, affine, *cameras, dtype=torch.float32)
    for image, camera in zip(together, cameras, strict=True):
        alone = drr(volume, affine, camera, dtype=torch.float32)
        np.testing.assert_allclose(image, alone, rtol=1e-6, atol=1e-7)


def gradients(chunk_samples):
    volume, affine = random_case()
    volume.requires_grad_()
    intrinsics, extrinsics = matrices(camera_at("oblique"), camera_at("lateral"))
    extrinsics.requires_grad_()
    image = render(volume, affine, intrinsics, extrinsics, 40, 50, chunk_samples=chunk_samples)
    (image**2).sum().backward()
    return image.detach(), volume.grad, extrinsics.grad


def test_chunks_do_not_change_the_result():
    whole, small = gradients(1 << 30), gradients(1000)
    np.testing.assert_allclose(small[0], whole[0], rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(small[1], whole[1], rtol=1e-4, atol=1e-4 * whole[1].abs().max())
    np.testing.assert_allclose(small[2], whole[2], rtol=1e-4, atol=1e-4 * whole[2].abs().max())


def test_the_same_input_gives_the_same_bits_on_the_cpu():
    for first, second in zip(gradients(5000), gradients(5000), strict=True):
        assert torch.equal(first, second)


def test_the_number_of_threads_does_not_change_the_image():
    volume, affine = random_case()
    threads = torch.get_num_threads()
    images = []
    try:
        for count in (1, 3):
            torch.set_num_threads(count)
            images.append(drr(volume, affine, camera_at("tilted"), dtype=torch.float32))
    finally:
        torch.set_num_threads(threads)
    np.testing.assert_allclose(images[0], images[1], rtol=1e-6, atol=1e-7)


def test_the_graph_keeps_rays_but_no_samples():
    volume, affine = random_case()
    intrinsics, extrinsics = matrices(camera_at("anterior"))
    extrinsics.requires_grad_()

    def saved_values(step_mm):
        total = 0

        def pack(tensor):
            nonlocal total
            total += tensor.numel()
            return tensor

        with torch.autograd.graph.saved_tensors_hooks(pack, lambda tensor: tensor):
            render(volume, affine, intrinsics, extrinsics, 40, 50, step_mm=step_mm)
        return total

    assert saved_values(0.05) == saved_values(2)


def test_a_source_inside_the_volume_sees_only_what_is_in_front():
    shape = (41, 41, 41)
    camera = Camera(intrinsics_matrix(100, 1, 3, 3), look_at((0, 0, 0), (0, 10, 0)), 3, 3)
    image = drr(np.ones(shape), grid_affine(shape, (1.0, 1.0, 1.0)), camera)
    assert image[1, 1] == pytest.approx(20.5)


def test_rays_beside_the_volume_are_zero_and_have_zero_gradient():
    volume, affine = random_case()
    intrinsics, extrinsics = matrices(camera_at("anterior", target=(5000, 0, 0)))
    volume.requires_grad_(), extrinsics.requires_grad_()
    image = render(volume, affine, intrinsics, extrinsics, 40, 50)
    image.sum().backward()
    assert not image.any()
    assert not volume.grad.any()
    assert not extrinsics.grad.any()


def test_rays_parallel_to_an_axis_have_finite_gradients():
    volume, affine = random_case()
    intrinsics = torch.tensor([[[500.0, 0, 1], [0, 500, 1], [0, 0, 1]]], dtype=torch.float64)
    extrinsics = torch.tensor(look_at((0, -800, 0), (0, 0, 0)))[None].requires_grad_()
    image = render(volume, affine, intrinsics, extrinsics, 3, 3)
    image.sum().backward()
    assert image.min() > 0
    assert torch.isfinite(extrinsics.grad).all()


def test_image_is_linear_in_the_volume():
    (a, affine), (b, _) = random_case(1), random_case(2)
    camera = camera_at("tilted")
    combined = drr(2 * a + 3 * b, affine, camera, dtype=torch.float32)
    separate = 2 * drr(a, affine, camera) + 3 * drr(b, affine, camera)
    np.testing.assert_allclose(combined, separate, rtol=1e-5, atol=1e-5)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_cuda_agrees_with_the_cpu():
    volume, affine = random_case()
    intrinsics, extrinsics = matrices(camera_at("oblique"))
    results = []
    for device in ("cpu", "cuda"):
        here = volume.to(device).requires_grad_()
        pose = extrinsics.to(device).requires_grad_()
        image = render(here, affine, intrinsics, pose, 40, 50)
        (image**2).sum().backward()
        results.append([tensor.detach().cpu().numpy() for tensor in (image, here.grad, pose.grad)])
    for cpu, cuda in zip(*results, strict=True):
        np.testing.assert_allclose(cuda, cpu, rtol=1e-3, atol=1e-4 * np.abs(cpu).max())


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"volume": torch.zeros(3, 3)}, "volume"),
        ({"volume": torch.zeros(3, 3, 3, dtype=torch.int16)}, "floating"),
        ({"intrinsics": torch.eye(3).repeat(3, 1, 1)}, "intrinsics"),
        ({"extrinsics": torch.eye(4)}, "extrinsics"),
        ({"step_mm": 0.0}, "step_mm"),
    ],
)
def test_wrong_arguments_are_refused_by_name(change, word):
    valid = {
        "volume": torch.zeros(3, 3, 3),
        "affine": torch.eye(4),
        "intrinsics": torch.eye(3),
        "extrinsics": torch.eye(4).repeat(2, 1, 1),
        "height": 2,
        "width": 2,
    }
    assert render(**valid).shape == (2, 2, 2)
    with pytest.raises(ValueError, match=word):
        render(**(valid | change))


def test_default_chunk_is_bounded():
    assert projector.CHUNK_SAMPLES * 50 < 256 << 20
