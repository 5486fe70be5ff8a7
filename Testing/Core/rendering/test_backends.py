"""The numba and torch backends carry out the same sums; a body's Jacobian is its image's derivative."""

import numpy as np
import pytest
from backend_cases import STEP, assert_close, random_body, random_view
from scipy.ndimage import gaussian_filter

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.rendering.backend import IndexField
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.rigid import index_rays, project_body
from PolyPoseLib.rendering.torch_backend import TorchBackend

FINE = 0.05
"""Distance of samples, mm, at which sums are integrals."""


def both():
    pytest.importorskip("numba")
    return NumbaBackend(), TorchBackend()


@pytest.mark.parametrize("seed", range(6))
def test_line_integrals_and_moments_agree(seed):
    body = random_body(seed)
    camera, pose = random_view(seed, body)
    rays = index_rays(body, camera, pose, (0, camera.height, 0, camera.width), STEP)
    fused, plain = (b.project(body.voxels, rays, True) for b in both())
    assert_close(fused[0], plain[0], 1e-5)
    assert_close(fused[1], plain[1], 1e-3)  # gradients jump where a rounded sample changes its voxel
    alone = [b.project(body.voxels, rays, False) for b in both()]
    for (image, moments), (with_moments, _) in zip(alone, (fused, plain), strict=True):
        assert moments is None
        assert_close(image, with_moments, 1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_projections_through_a_field_agree(seed):
    body = random_body(seed)
    camera, pose = random_view(seed, body)
    rng = np.random.default_rng(seed)
    size = np.array(body.voxels.shape[::-1])
    margin = 3.0
    shape = (6, 7, 8)
    span = (size - 1 + 2 * margin) / (np.array(shape[::-1]) - 1)
    vectors = gaussian_filter(rng.normal(0, 8, (*shape, 3)), (1, 1, 1, 0)).astype(np.float32)
    field = IndexField(vectors, 1 / span, margin / span, np.full(3, -margin), size - 1 + margin)
    rays = index_rays(body, camera, pose, (0, camera.height, 0, camera.width), STEP)
    fused, plain = (b.project_warped(body.voxels, field, rays) for b in both())
    assert fused.max() > 0
    assert_close(fused, plain, 1e-4)


def test_a_field_of_zeros_changes_nothing():
    body = random_body(1)
    camera, pose = random_view(1, body)
    size = np.array(body.voxels.shape[::-1])
    field = IndexField(
        np.zeros((3, 3, 3, 3), np.float32), 2 / (size - 1), np.zeros(3), np.zeros(3), size - 1.0
    )
    rays = index_rays(body, camera, pose, (0, camera.height, 0, camera.width), STEP)
    for backend in both():
        plain, _ = backend.project(body.voxels, rays, False)
        assert_close(backend.project_warped(body.voxels, field, rays), plain, 1e-5)


@pytest.mark.parametrize("name", ["numba", "torch"])
@pytest.mark.parametrize("seed", range(3))
def test_the_jacobian_is_the_derivative_of_the_image(name, seed):
    backend = dict(zip(("numba", "torch"), both(), strict=True))[name]
    body = random_body(seed, (28, 30, 32))
    camera, pose = random_view(seed, body, 9, 10)
    # Along the rays the derivative is the integral's, to which that of the samples comes close when they are dense.
    part = project_body(body, camera, pose, FINE, backend, jacobian=True)
    steps = [1e-4] * 3 + [5e-3] * 3  # small, because the image has a kink wherever a sample crosses a face
    window = (0, camera.height, 0, camera.width)

    def rendered(delta):
        moved = about(perturbation(delta), body.centre) @ pose
        rays = index_rays(body, camera, moved, window, FINE)
        image, _ = backend.project(body.voxels, rays, False)
        row0, row1, column0, column1 = part.window
        return image[row0:row1, column0:column1].astype(float)

    for n, step in enumerate(steps):
        delta = np.zeros(6)
        delta[n] = step
        numerical = (rendered(delta) - rendered(-delta)) / (2 * step)
        size = np.linalg.norm(part.jacobian[:3] if n < 3 else part.jacobian[3:])
        assert np.linalg.norm(part.jacobian[n] - numerical) < 0.02 * size


@pytest.mark.parametrize("name", ["numba", "torch"])
def test_a_body_beside_the_image_has_an_empty_window(name):
    backend = dict(zip(("numba", "torch"), both(), strict=True))[name]
    body = random_body(0)
    camera, pose = random_view(0, body)
    pose = pose.copy()
    pose[:3, 3] += camera.extrinsic[0, :3] * 1000
    part = project_body(body, camera, pose, STEP, backend, jacobian=True)
    assert part.image.size == 0 and part.jacobian.shape[0] == 6
