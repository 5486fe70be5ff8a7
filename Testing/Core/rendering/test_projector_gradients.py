"""The projector's gradients, chunks, batches and refusals."""

import numpy as np
import pytest
import torch
from projector_cases import VIEWS, camera_at, drr, gaussian, grid_affine, grid_points, matrices, random_case
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import look_at
from PolyPoseLib.rendering import projector
from PolyPoseLib.rendering.projector import render


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
